"""Machine parts that are not wholly of revolution: their teeth, knurls and flats must not turn the axis."""

import numpy as np

from bench.synthetic.depth_view import single_view
from bench.synthetic.revolution import axis_angle_deg
from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis import find_axis
from tests.tiers import some_of


def stacked(sections: list[tuple[Floats, float, float]]) -> tuple[Floats, Ints32]:
    """Prisms with caps on a common axis z: each an outline (K, 2) star-shaped about it, from z to z."""
    vertices: list[Floats] = []
    faces: list[Ints] = []
    count = 0
    for outline, low, high in sections:
        k = len(outline)
        ring, after = np.arange(k), (np.arange(k) + 1) % k
        for z in (low, high):
            vertices += [np.column_stack([outline, np.full(k, z)]), np.array([[0.0, 0.0, z]])]
        top = k + 1
        faces += [
            np.stack(corners, axis=1) + count
            for corners in (
                (ring, after, ring + top),
                (after, after + top, ring + top),
                (after, ring, np.full(k, k)),
                (ring + top, after + top, np.full(k, k + top)),
            )
        ]
        count += 2 * top
    return np.concatenate(vertices), np.concatenate(faces).astype(np.int32)


def wheel(radii: list[float], places: list[float], repeats: int) -> Floats:
    """An outline whose radius takes the given values at the given places of each of so many sectors."""
    turn = 2.0 * np.pi * (np.arange(repeats)[:, None] + np.array(places)).ravel() / repeats
    radius = np.tile(radii, repeats)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=1)


def disc(radius: float) -> Floats:
    return wheel([radius], [0.0], 160)


PARTS = {
    "gear": [
        (wheel([40, 40, 46, 46, 40], [0, 0.3, 0.4, 0.75, 0.85], 24), 0.0, 15.0),
        (disc(18.0), 15.0, 30.0),
    ],
    "hex bolt": [(wheel([14.4], [0.0], 6), -9.0, 0.0), (disc(8.0), 0.0, 60.0)],
    "knurled knob": [(wheel([30, 31.2], [0, 0.5], 90), 0.0, 25.0), (disc(21.0), 25.0, 34.0)],
}


@some_of("name", PARTS)
def test_single_views_of_machine_parts(name: str) -> None:
    vertices, faces = stacked(PARTS[name])
    for i, view in enumerate(np.random.default_rng(8).normal(size=(3, 3))):
        size = 1e-3 * float(np.sqrt(vertices.var(axis=0).sum()))
        points, triangles = single_view(vertices, faces, view, pixels=200, sigma=size, seed=i)
        axis = find_axis(points, triangles)
        assert axis_angle_deg(axis.direction, np.eye(3)[2]) < 0.3, view
        assert axis.undetermined == ()
