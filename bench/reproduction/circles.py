"""The picture of figures 6 and 9: mesh, intersection points, circles and centres of one orientation."""

from __future__ import annotations

import numpy as np

from bench.plotting.pictures import view_from
from bench.reproduction.drawing import GREEN, INK, SHOWN, Layer, bulk, dots, equal_axes, ring, spot
from bench.reproduction.orientation import Sectioned, angles_of, sectioned
from bench.reproduction.parts import Numbers, Picture, Variant
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats

_WIDEST = 1.6
"""Circles larger than so many times the mesh's extent run out of the picture."""


def shown(prefix: str, scan: Scanned, direction: Floats) -> dict[str, Floats]:
    """What the picture needs, under a prefix; z is the orientation, the origin the mesh's mean."""
    test = sectioned(scan.vertices_mm, scan.faces, angles_of(direction))
    _, middle, found = turned_mesh(prefix, scan, test)
    circles = test.good.copy()
    circles[:, :3] -= middle
    return {
        **found,
        f"{prefix}_circles": circles,
        f"{prefix}_off": np.asarray(scan.error_deg(direction)),
        f"{prefix}_spread": np.asarray(float(np.hypot(*np.std(circles[:, :2], axis=0)))),
    }


def turned_mesh(prefix: str, scan: Scanned, test: Sectioned) -> tuple[Floats, Floats, dict[str, Floats]]:
    """A mesh (V, 3) turned as its sections are and its middle (3,); what is drawn of both, about that."""
    turned = scan.vertices_mm @ test.turn.T
    middle = turned.mean(axis=0)
    return (
        turned,
        middle,
        {
            f"{prefix}_mesh": (turned - middle)[:: max(len(turned) // SHOWN, 1)].astype(np.float32),
            f"{prefix}_sections": (test.points_mm - middle).astype(np.float32),
        },
    )


def picture(n: Numbers, prefix: str, title: str, variant: Variant) -> Picture:
    """Mesh, sections, circles and centres, seen from the scanner's side and above."""
    view = facing(n[f"{prefix}_mesh"].astype(float), elevation_deg=35.0)
    mesh, points = (n[f"{prefix}_{key}"].astype(float) @ view[:2].T for key in ("mesh", "sections"))
    circles = n[f"{prefix}_circles"]
    rings = [np.column_stack([ring(c[:2], c[3]), np.full(120, c[2])]) @ view[:2].T for c in circles]
    limit = _WIDEST * float(np.ptp(bulk(mesh), axis=0).max())
    inside = [r for r in rings if np.ptp(r, axis=0).max() < limit and np.abs(r).max() < limit]
    axes = equal_axes(np.concatenate([bulk(mesh), *inside]), "across, mm", "along the orientation, mm")
    centres = circles[:, :3] @ view[:2].T
    parts = [dots(axes, [Layer(mesh, INK), Layer(points, GREEN, 2)])]
    parts += [axes.line(r, "circle") for r in rings] + [spot(axes, c, "centre", 3.6) for c in centres]
    legend = ((INK, "mesh"), (GREEN, "intersection points"), ("#d62728", "circles"), ("#1463b5", "centres"))
    return Picture(title, axes.svg(parts, "circles of the sections"), variant, legend)


def facing(mesh: Floats, *, elevation_deg: float) -> Floats:
    """(3, 3) a view along the chord of the arc's middle, from the side the scan is seen from, and above."""
    spread = np.linalg.eigh(np.cov(mesh[:, :2].T))[1]
    azimuth = float(np.degrees(np.arctan2(spread[1, 0], spread[0, 0])))
    return view_from(azimuth_deg=azimuth, elevation_deg=elevation_deg)
