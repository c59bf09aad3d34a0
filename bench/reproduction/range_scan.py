"""Figure 1: the range scan of the wheel, and what section 3.2 says of its mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from bench.plotting.pictures import view_from
from bench.reproduction.camera_view import OPPOSITE, seen_photo
from bench.reproduction.drawing import grey
from bench.reproduction.lab import PIPELINES, Lab
from bench.reproduction.parts import (
    SIDES,
    Claim,
    Numbers,
    Picture,
    Section,
    Side,
    Table,
    both,
    number,
    whole_range,
)
from bench.reproduction.scanned import Scanned
from bench.reproduction.shade import frame_of, shaded
from burrscan.arrays import Floats, Ints32
from burrscan.turns import turn_deg

_OBLIQUE = view_from(azimuth_deg=-65.0, elevation_deg=20.0) @ np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
"""From beside the scanner and above: a hole that it could not see shows from there."""


def mesh_counts(faces: Ints32) -> tuple[int, int, int, float]:
    """Vertices of triangles, those on a border, strips, and the largest strip's share of the triangles.

    A border edge has one triangle; strips are what shares vertices.
    """
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    once, count = np.unique(edges, axis=0, return_counts=True)
    size = int(faces.max()) + 1
    links = coo_array((np.ones(len(once)), (once[:, 0], once[:, 1])), shape=(size, size))
    label = connected_components(links, directed=False)[1][faces[:, 0]]
    strips = np.unique(label, return_counts=True)[1]
    return (
        len(np.unique(faces)),
        len(np.unique(once[count == 1])),
        len(strips),
        float(strips.max() / len(faces)),
    )


def triangles_of(vertices: int, border: int) -> int:
    """T = Vo + 2 Vi - 2 of the paper's section 3.2, for one strip without holes."""
    return border + 2 * (vertices - border) - 2


def seen_arc_deg(scan: Scanned) -> float:
    """Angle about the true axis that holds 98 % of the vertices of the outer surface.

    Outer is what is farther from the axis than three quarters of the wheel's radius: the end face is seen all
    around.
    """
    outer = np.hypot(*scan.part_mm[:, :2].T) > 0.75 * scan.arrays["outline_zr_mm"][:, 1].max()
    angle = np.degrees(np.arctan2(scan.part_mm[outer, 1], scan.part_mm[outer, 0]))
    middle = float(np.degrees(np.angle(np.exp(1j * np.radians(angle)).mean())))
    return float(np.ptp(np.quantile(turn_deg(angle - middle), [0.01, 0.99])))


def distances_mm(scan: Scanned) -> tuple[float, float]:
    """Median distance to the true points along the camera's rays; share of points more than 1 mm off.

    NaN where nothing was measured.
    """
    measured, true = (np.linalg.norm(scan.arrays[key], axis=-1) for key in ("points_mm", "true_points_mm"))
    error = np.abs(measured - true)
    known = error[np.isfinite(error)].astype(float)
    if not len(known):
        return np.nan, np.nan
    return float(np.median(known)), float(np.mean(known > 1.0))


def _view_counts(scan: Scanned) -> tuple[float, float, float, float]:
    """Arc seen, degrees; the largest strip's share; border over √V; how far T is from the formula, share."""
    vertices, border, _, largest = mesh_counts(scan.faces)
    excess = abs(len(scan.faces) / triangles_of(vertices, border) - 1.0)
    return seen_arc_deg(scan), largest, border / float(np.sqrt(vertices)), excess


def measure(lab: Lab) -> Numbers:
    """Both scans as pictures, and their meshes counted."""
    found: dict[str, Any] = {}
    pair = lab.pair("wheel")
    counted = np.array(
        [
            [
                _view_counts(lab.glance("wheel", pipeline.scan.method, spin_deg=turn))
                for pipeline in PIPELINES.values()
            ]
            for turn in lab.turns_deg()
        ]
    )
    found |= {f"{name}_views": counted[:, k] for k, name in enumerate(PIPELINES)}
    frames = [frame_of(pair["default"].vertices_mm, view) for view in (OPPOSITE, _OBLIQUE)]
    for name, scan in pair.items():
        for key, view, frame in zip(("front", "oblique"), (OPPOSITE, _OBLIQUE), frames, strict=True):
            found[f"{name}_{key}"] = shaded(scan.vertices_mm, scan.faces, view, frame_mm=frame)
        found[f"{name}_photo"] = seen_photo(scan.arrays["white"], scan)
        found[f"{name}_mesh"] = np.array([len(scan.faces), *mesh_counts(scan.faces)])
        found[f"{name}_distance"] = np.array(distances_mm(scan))
        found[f"{name}_covered"] = np.asarray(scan.coverage())
    return found


def draw(n: Numbers) -> Section:
    """The range scans, and counts of their meshes; claims are medians over views."""
    arc = both(lambda v: _span(n[f"{v}_views"][:, 0], ".0f") + "°")
    largest = {v: float(n[f"{v}_mesh"][4]) for v in SIDES}
    border = {v: float(n[f"{v}_mesh"][2] / np.sqrt(n[f"{v}_mesh"][1])) for v in SIDES}
    excess = {v: _excess(n[f"{v}_mesh"]) for v in SIDES}
    square = all(3.0 < np.median(n[f"{v}_views"][:, 2]) < 5.5 for v in SIDES)
    strips = {v: float(np.median(n[f"{v}_views"][:, 1])) for v in SIDES}
    return Section(
        title="Figure 1: the range scan",
        reports="A range scan of the wheel with its specular reflections compensated. It is partial: only "
        "one side is seen. Its points lie roughly on a rectangular grid; most meshes are one strip, of T = "
        "Vo + 2 Vi − 2 triangles, with about Vo = 4 √V vertices on the border. The photograph of the robot "
        "has no counterpart here.",
        measured=f"The scans hold {n['seed_mesh'][0]:,.0f} (seed) and {n['default_mesh'][0]:,.0f} (default) "
        f"triangles, the paper's 123,000; {len(n['seed_views'])} views all around, on half the raster, see "
        f"{arc[0]} and {arc[1]} of the turn (median, least to largest). The median distance "
        f"to the truth is {1e3 * n['seed_distance'][0]:.0f} µm (seed) and "
        f"{1e3 * n['default_distance'][0]:.0f} µm (default). The largest strip has {largest['seed']:.0%} "
        f"and {largest['default']:.0%} of the triangles: our mesh is cut where depth jumps, at the wheel's "
        f"steps. So the border is longer than a square's, {border['seed']:.0f} √V and "
        f"{border['default']:.0f} √V, and T differs from the formula by {excess['seed']:.1%} and "
        f"{excess['default']:.1%}.",
        claims=(
            Claim("1", "the scan is partial: only one side of the object is given", "one side", *arc, "yes"),
            Claim(
                "3.2",
                "most meshes are a single strip",
                "one strip",
                *both(lambda v: f"largest: {_span(n[f'{v}_views'][:, 1], '.0%')} of the triangles"),
                "yes" if min(strips.values()) > 0.9 else "partly",
                "" if min(strips.values()) > 0.9 else "we cut the mesh at jumps of depth, the wheel's steps",
            ),
            Claim(
                "3.2",
                "T = Vo + 2 Vi − 2, and Vo is about 4 √V",
                "4 √V",
                *both(
                    lambda v: (
                        f"T within {_span(n[f'{v}_views'][:, 3], '.1%')}; "
                        f"Vo = {_span(n[f'{v}_views'][:, 2], '.1f')} √V"
                    )
                ),
                "yes" if square else "partly",
                ""
                if square
                else "T holds; the border is longer than a square's, for strips are many and holes have "
                "borders too. It weighs little in the cost",
            ),
        ),
        pictures=tuple(picture for v in SIDES for picture in _pictures(n, v)),
        tables=(_table(n),),
    )


def _span(values: Floats, form: str) -> str:
    return whole_range(values, f"{{:{form}}}".format)


def _excess(mesh: Floats) -> float:
    return abs(float(mesh[0]) / triangles_of(int(mesh[1]), int(mesh[2])) - 1.0)


def _pictures(n: Numbers, variant: Side) -> list[Picture]:
    return [
        Picture("The wheel in white light", grey(n[f"{variant}_photo"], "white light"), variant),
        Picture("Range scan, seen from the camera", grey(n[f"{variant}_front"], "range scan"), variant),
        Picture(
            "Range scan, seen from aside", grey(n[f"{variant}_oblique"], "range scan from aside"), variant
        ),
    ]


def _table(n: Numbers) -> Table:
    rows = []
    for v in SIDES:
        mesh, off = n[f"{v}_mesh"], n[f"{v}_distance"]
        rows.append(
            (
                f"{v} scan", f"{mesh[0]:,.0f}", f"{mesh[1]:,.0f}", f"{mesh[2]:,.0f}", f"{mesh[3]:.0f}",
                f"{number(n, f'{v}_covered'):.1%}", f"{1e3 * off[0]:.0f} µm", f"{off[1]:.2%}",
            )
        )  # fmt: skip
    heads = (
        "",
        "triangles",
        "vertices",
        "on a border",
        "strips",
        "measured",
        "median distance to truth",
        "over 1 mm off",
    )
    return Table(heads, tuple(rows))
