"""The pictures and charts of one case."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from bench.plotting import pictures
from bench.plotting.axes import round_up
from bench.report import charts
from bench.report.charts import Mark, Unrolled
from bench.report.sides import Arrays, Side
from bench.report.solid import Solid, viewer
from burrscan.arrays import Levels

_FAIR_SHARE = 0.15
"""Of the best seen angle's: less is a strip at the limb, which would make the map wide and empty."""
_OUTSIDE = np.array([1000.0, 0.0, 500.0])  # where to look from at what no camera saw

PIXEL_COLOURS = {1: "#e0a030", 2: "#3f8f5f", 3: "#c0392b", 4: "#7a5cc0"}
"""Missed, right, wrong, saturated: the codes of ``pixels`` in :mod:`bench.run.artefacts`."""


@dataclass(frozen=True)
class Scales:
    """Colour limits shared by all cases, so that pictures can be compared."""

    depth_mm: float
    deviation_mm: float
    generatrix_um: float


@dataclass(frozen=True)
class Figure:
    """A picture with its heading; ``kind`` picks the legend, ``css`` the colour of the heading's mark."""

    title: str
    body: Markup
    kind: str = ""
    css: str = ""


def scales(looks: Sequence[tuple[Side, str]]) -> Scales:
    """Limits that suit all that is shown: sides and cases.

    Depth: nine errors of ten are inside in the median case. Deviation: half the lowest burr, so that every
    burr stands out. Generatrix: nearly everything is inside in the median case.
    """
    depths, profiles, heights = [], [], []
    for side, case in looks:
        truth, found = side.truth(case), side.found(case)
        if not (truth and found):
            continue
        errors = np.abs(found.get("depth_error_mm", np.zeros(0)).astype(float))
        errors = errors[np.isfinite(errors)]
        depths += [np.percentile(errors, 90.0)] if errors.size else []
        profiles.append(charts.error_limit_um([charts.error_um(found["generatrix"], truth["generatrix"])]))
        heights += list(truth["burr_height_mm"])
    return Scales(
        round_up(float(np.median(depths))) if depths else 0.1,
        float(f"{min(heights) / 2:.2g}") if heights else 0.1,
        round_up(float(np.median(profiles))) if profiles else 100.0,
    )


Found = Mapping[Side, Arrays]
"""What was kept of a case by the sides whose pictures are shown."""


def photo_figures(truth: Arrays, found: Found) -> list[Figure]:
    """The part as the camera sees it under white light; nothing for a mesh that nobody scanned."""
    whites = [arrays["white"] for arrays in found.values() if "white" in arrays and "measurable" in truth]
    return [Figure("As the camera sees it", _camera(w, truth, "camera, white light")) for w in whites[:1]]


def map_figures(truth: Arrays, found: Found, limits: Scales) -> list[Figure]:
    """The true deviations, and what each side measured and reported, unrolled."""
    if not truth:
        return []
    measured = [
        Figure(side.label, _found_map(truth, arrays, limits), css=side.css)
        for side, arrays in found.items()
        if arrays
    ]
    return [Figure("Truth", _true_map(truth, limits)), *measured]


def profile_figures(truth: Arrays, found: Found, limits: Scales) -> list[Figure]:
    """The generatrix of every side with the truth, and its error."""
    curves = {side.css: arrays["generatrix"].astype(float) for side, arrays in found.items() if arrays}
    if not (truth and curves):
        return []
    profile = truth["generatrix"].astype(float)
    error = charts.generatrix_error(profile, curves, limits.generatrix_um)
    return [
        Figure("Generatrix", charts.generatrix(profile, curves), "profile"),
        Figure("Error of the generatrix", error, "profile"),
    ]


def solid_figure(found: Found, limits: Scales, *, first: str) -> Markup:
    """The measured surfaces, to turn by hand; nothing where none was kept.

    First shown is that of the side so called, else the last one.
    """
    solids = [
        Solid(
            side.label,
            side.css,
            arrays["mesh_mm"].astype(float),
            arrays["mesh_faces"],
            arrays["mesh_values_mm"].astype(float),
            arrays["camera_mm"].astype(float) if "camera_mm" in arrays else _OUTSIDE,
        )
        for side, arrays in found.items()
        if "mesh_mm" in arrays
    ]
    labels = [solid.label for solid in solids]
    number = labels.index(first) if first in labels else len(labels) - 1
    return viewer(solids, limits.deviation_mm, "measured surface, coloured by its deviation", first=number)


def scan_figures(truth: Arrays, found: Arrays, limits: Scales) -> tuple[Figure, ...]:
    """What the scanner showed, saw and decoded; nothing for a mesh that nobody scanned."""
    if not truth or "pixels" not in found:
        return ()
    part = pictures.window(truth)
    depth = pictures.signed_map(found["depth_error_mm"][part].astype(float), limits.depth_mm)
    fates = pictures.classes(found["pixels"][part], PIXEL_COLOURS)
    figures = [Figure("A pattern as the camera saw it", _camera(found["image"], truth, "camera image"))]
    if "intensity" in found:
        mask = pictures.picture(pictures.photo(found["intensity"]), "intensity mask")
        figures.append(Figure("Adapted intensity of the projector", mask, "intensity"))
    return (
        *figures,
        Figure("What became of each pixel", pictures.picture(fates, "fate of the pixels"), "pixels"),
        Figure("Depth error, mm", pictures.picture(depth, "depth error"), "depth"),
    )


def _camera(image: Levels, truth: Arrays, label: str) -> Markup:
    return pictures.picture(pictures.photo(pictures.brightened(image[pictures.window(truth)])), label)


def _true_map(truth: Arrays, limits: Scales) -> Markup:
    part = _unrolled(truth, truth["unrolled_mm"])
    marks = [_true_mark(truth, index, "true") for index in range(len(truth["burr_angle_deg"]))]
    return charts.unrolled(part, marks, limits.deviation_mm, "true deviation, unrolled")


def _found_map(truth: Arrays, found: Arrays, limits: Scales) -> Markup:
    part = _unrolled(truth, found["unrolled_mm"])
    matched = set(found["burr_match"].tolist())
    marks = [
        _true_mark(truth, index, "true" if index in matched else "missed")
        for index in range(len(truth["burr_angle_deg"]))
    ]
    marks += [_found_mark(truth, found, int(k)) for k in np.flatnonzero(np.isfinite(found["burr_angle_deg"]))]
    marks.sort(key=lambda mark: mark.css != "false")  # false calls lie under the burrs that are there
    return charts.unrolled(part, marks, limits.deviation_mm, "measured deviation, unrolled")


def _unrolled(truth: Arrays, deviation_mm: NDArray[Any]) -> Unrolled:
    rows = seen_rows(truth)
    edges = np.linspace(*_pair(truth["unrolled_deg"]), len(deviation_mm) + 1)
    angle_deg = (float(edges[rows.start]), float(edges[rows.stop]))
    return Unrolled(deviation_mm[rows].astype(float), angle_deg, _pair(truth["unrolled_z_mm"]))


def seen_rows(truth: Arrays) -> slice:
    """Angles of the unrolled map at which a fair part of the surface can be seen, with a margin."""
    share = np.isfinite(truth["unrolled_mm"]).mean(axis=1)
    rows = np.flatnonzero(share >= _FAIR_SHARE * share.max())
    margin = len(share) // 50
    return slice(max(int(rows[0]) - margin, 0), min(int(rows[-1]) + 1 + margin, len(share)))


def _true_mark(truth: Arrays, index: int, css: str) -> Mark:
    angle, arc = float(truth["burr_angle_deg"][index]), float(truth["burr_arc_deg"][index])
    label = f"{css} burr, {truth['burr_height_mm'][index]:.2f} mm high, at {angle:.1f}°"
    return _mark(truth, (angle - arc, angle + arc), truth["burr_z_mm"][index], css, label)


def _found_mark(truth: Arrays, found: Arrays, index: int) -> Mark:
    angle = float(found["burr_angle_deg"][index])
    css = "found" if found["burr_match"][index] >= 0 else "false"
    label = f"{css}: {found['burr_height_mm'][index]:.2f} mm high, at {angle:.1f}°"
    return _mark(truth, (angle, angle), found["burr_z_mm"][index], css, label)


def _mark(truth: Arrays, angle: tuple[float, float], z_mm: NDArray[Any], css: str, label: str) -> Mark:
    return Mark(charts.turned_into(angle, _pair(truth["unrolled_deg"])), _pair(z_mm), css, label)


def _pair(values: NDArray[Any]) -> tuple[float, float]:
    return float(values[0]), float(values[1])
