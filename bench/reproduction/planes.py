"""Figure 4: planes perpendicular to a sectioned orientation, and where they meet the mesh."""

from __future__ import annotations

import numpy as np

from bench.reproduction.circles import facing, turned_mesh
from bench.reproduction.drawing import GREEN, INK, Layer, bulk, dots, equal_axes
from bench.reproduction.lab import PIPELINES, Lab
from bench.reproduction.orientation import PLANES, angles_of, sectioned
from bench.reproduction.parts import Claim, Numbers, Picture, Section, both, number
from burrscan.arrays import Floats


def measure(lab: Lab) -> Numbers:
    """The sections of both scans at the true orientation: points, and how many planes meet the mesh."""
    found: dict[str, Floats] = {}
    for name, scan in lab.pair("wheel").items():
        test = sectioned(scan.vertices_mm, scan.faces, angles_of(scan.direction))
        turned, middle, drawn = turned_mesh(name, scan, test)
        found |= drawn | {
            f"{name}_height": np.linspace(turned[:, 2].min(), turned[:, 2].max(), PLANES + 1) - middle[2],
            f"{name}_met": np.asarray(float(len(np.unique(test.plane)))),
            f"{name}_cut_share": np.asarray(len(test.plane) / len(scan.faces)),
            f"{name}_triangles": np.asarray(float(len(scan.faces))),
        }
    return found


def draw(n: Numbers) -> Section:
    """Mesh, planes and intersection points, seen obliquely."""
    cut = {v: PLANES * number(n, f"{v}_triangles") ** 0.5 / number(n, f"{v}_triangles") for v in PIPELINES}
    ours = both(lambda v: f"{number(n, f'{v}_cut_share'):.1%} of the triangles")
    return Section(
        title="Figure 4: the test of one orientation",
        reports="P + 1 = 11 planes perpendicular to the orientation are spread evenly over the mesh; the "
        "first and the last meet it in one vertex only, so P − 1 = 9 sections are sectioned. The mean "
        "corner of each intersected triangle stands for the intersection, and about P √T triangles are "
        "intersected.",
        measured=f"At the true orientation {number(n, 'seed_met'):.0f} and {number(n, 'default_met'):.0f} "
        "of the 9 planes meet the mesh; a plane may miss where the scan has no data. Intersected: "
        f"{ours[0]} (seed), {ours[1]} (default); P √T would be {cut['seed']:.1%} and {cut['default']:.1%}.",
        claims=(
            Claim("3.2, figure 4", "P √T triangles are intersected by P planes",
                  f"{cut['default']:.1%} of the triangles", *ours,
                  "yes" if _within(n, cut) else "partly",
                  "" if _within(n, cut) else "the scan is a band, wider around than along the axis: its rows "
                  "are longer than √T"),
        ),
        pictures=tuple(_picture(n, name) for name in PIPELINES),
    )  # fmt: skip


def _within(n: Numbers, expected: dict[str, float]) -> bool:
    return all(0.67 < number(n, f"{v}_cut_share") / share < 1.5 for v, share in expected.items())


def _picture(n: Numbers, name: str) -> Picture:
    mesh, points = n[f"{name}_mesh"].astype(float), n[f"{name}_sections"].astype(float)
    view = facing(mesh, elevation_deg=18.0)
    corners = _corners(n[f"{name}_height"], mesh)
    flat = [corner @ view[:2].T for corner in corners]
    axes = equal_axes(np.concatenate([bulk(mesh @ view[:2].T), *flat]), "across, mm", "along the axis, mm")
    planes = [axes.line(outline, "plane") for outline in flat]
    layers = [Layer(mesh @ view[:2].T, INK), Layer(points @ view[:2].T, GREEN, 2)]
    legend = ((INK, "mesh"), (GREEN, "intersection points"), ("#1463b5", "planes"))
    picture = dots(axes, layers)
    body = axes.svg([*planes, picture], "planes perpendicular to the true axis and their intersections")
    return Picture("Planes and intersection points", body, "seed" if name == "seed" else "default", legend)


def _corners(heights: Floats, mesh: Floats) -> list[Floats]:
    """Closed outlines of the planes, a little larger than the mesh."""
    low, high = bulk(mesh[:, :2]) + np.array([[-6.0], [6.0]])
    square = np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]], low])
    return [np.column_stack([square, np.full(5, z)]) for z in heights]
