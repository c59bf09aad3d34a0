"""The report's charts: the unrolled part with its burrs, the generatrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.plotting.axes import Axes, padded, round_up
from bench.plotting.pictures import signed_map
from burrscan.arrays import Floats
from scenes.wheel import deviation_mm


@dataclass(frozen=True)
class Mark:
    """A burr to draw on the unrolled part: where it is, and whether it is true, found, missed or false."""

    angle_deg: tuple[float, float]
    z_mm: tuple[float, float]
    css: str
    label: str


@dataclass(frozen=True)
class Unrolled:
    """A map of deviations over angle and position along the axis.

    Parameters
    ----------
    deviation_mm
        (A, Z), NaN where nothing was seen.
    angle_deg, z_mm
        Edges of the first and last row, of the first and last column.

    """

    deviation_mm: Floats
    angle_deg: tuple[float, float]
    z_mm: tuple[float, float]


def unrolled(part: Unrolled, marks: Sequence[Mark], limit_mm: float, label: str) -> Markup:
    """The unrolled part: angle to the right, the axis upwards, deviation as colour, burrs as frames."""
    axes = Axes(part.angle_deg, part.z_mm, "angle about the axis, deg", "along the axis, mm", 230.0)
    picture = axes.image(signed_map(part.deviation_mm.T[::-1], limit_mm))
    drawn = [_drawn(axes, mark) for mark in marks if _overlaps(mark.angle_deg, part.angle_deg)]
    return axes.svg([picture, *drawn], label, css="panel map")


def _drawn(axes: Axes, mark: Mark) -> Markup:
    angles = (max(mark.angle_deg[0], axes.x[0]), min(mark.angle_deg[1], axes.x[1]))
    halo, frame = (axes.box(angles, mark.z_mm, css, pad=4.0) for css in ("halo", mark.css))
    return Markup("<g><title>{}</title>{}{}</g>").format(mark.label, halo, frame)


def _overlaps(a: tuple[float, float], b: tuple[float, float]) -> bool:
    return a[0] <= b[1] and b[0] <= a[1]


def turned_into(angle_deg: tuple[float, float], window: tuple[float, float]) -> tuple[float, float]:
    """The same arc, whole turns added so that it lies nearest to the middle of a window."""
    turns = round(((window[0] + window[1]) - (angle_deg[0] + angle_deg[1])) / 2 / 360.0)
    return angle_deg[0] + 360.0 * turns, angle_deg[1] + 360.0 * turns


def generatrix(true_zr_mm: Floats, found_zr_mm: Mapping[str, Floats]) -> Markup:
    """The profile: distance from the axis over position along it, truth as a wide band under what was found.

    The picture shows the part of the profile that was found.

    Parameters
    ----------
    true_zr_mm
        (K, 2).
    found_zr_mm
        Style class to curve (K, 2).

    """
    seen = np.concatenate([*found_zr_mm.values()] or [true_zr_mm])
    axes = Axes(padded(seen[:, 0]), padded(seen[:, 1]), "along the axis, mm", "radius, mm", 230.0)
    curves = [axes.line(curve, f"curve {css}") for css, curve in found_zr_mm.items()]
    return axes.svg([axes.line(true_zr_mm, "truth"), *curves], "generatrix found and true")


def generatrix_error(true_zr_mm: Floats, found_zr_mm: Mapping[str, Floats], limit_um: float) -> Markup:
    """Distance of the profile found from the true one along its normal, outwards positive, micrometres."""
    z = padded(np.concatenate([curve[:, 0] for curve in found_zr_mm.values()] or [true_zr_mm[:, 0]]))
    axes = Axes(z, (-limit_um, limit_um), "along the axis, mm", "found minus true, µm", 230.0)
    curves = [
        axes.line(np.column_stack([curve[:, 0], error_um(curve, true_zr_mm)]), f"curve {css}")
        for css, curve in found_zr_mm.items()
    ]
    zero = axes.line(np.array([[z[0], 0.0], [z[1], 0.0]]), "zero")
    return axes.svg([zero, *curves], "error of the generatrix along its normal")


def error_um(found_zr_mm: Floats, true_zr_mm: Floats) -> Floats:
    """(K,) signed distance of points found from the true profile, micrometres."""
    error = np.full(len(found_zr_mm), np.nan)
    known = np.isfinite(found_zr_mm).all(axis=1)
    z, r = found_zr_mm[known].T
    error[known] = deviation_mm(np.column_stack([r, np.zeros_like(r), z]), true_zr_mm) * 1000.0
    return error


def error_limit_um(errors_um: Sequence[Floats]) -> float:
    """A round limit that shows nearly everything."""
    every = np.abs(np.concatenate([np.zeros(1), *errors_um]))
    every = every[np.isfinite(every)]
    return round_up(max(float(np.percentile(every, 98.0)) * 1.1, 1.0))
