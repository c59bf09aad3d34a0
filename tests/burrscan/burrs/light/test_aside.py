"""What high and low say, seen or lit from aside: places of rendered wheels, and what must change nothing."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light.aside import MOST, aside, stand
from burrscan.burrs.light.disturbed import Place
from burrscan.burrs.light.side import Looks, Told
from burrscan.burrs.light.unrolled import Unrolled

PLACES = Path(__file__).parents[3] / "data" / "flank_places.npz"
ANGLE = np.radians(np.linspace(-4.0, 4.0, 17))
RIDGE = np.array([0, 0, 0, 0.0, 0.7, 0.8, 0.4, 0.1, -0.6, -0.9, -0.4, -0.1, 0, 0, 0, 0, 0])
"""High beyond low, for a camera at larger angles: a curl of 0.7 mm on chrome, as it was measured."""


class Seen(NamedTuple):
    """A disturbed place of a rendered scan, and the side of the burr that is there."""

    side: int
    cells: Bools
    looks: Looks
    surface: Unrolled

    def told(self) -> float:
        return aside(self.cells, self.looks, stand(self.cells, self.surface))


def surface(angle: Floats, rows: int, *, camera_mm: Floats, projector_mm: Floats) -> Unrolled:
    shape = rows, len(angle)
    return Unrolled(
        np.arange(rows, dtype=float), np.full(rows, 50.0), np.tile([0.0, 1.0], (rows, 1)), angle,
        np.zeros((2, *shape)), np.ones(shape, bool), np.ones(shape), 0.4, camera_mm, projector_mm,
        np.array([0.0, 0.0, 1.0]),
    )  # fmt: skip


def rendered() -> list[Seen]:
    with np.load(PLACES) as file:
        every = {int(name.split("_")[0]) for name in file}
        places = [
            {key: file[f"{n}_{key}"] for key in ("side", "angle", "at", "light", "deviation", "cells")}
            for n in every
        ]
    return [
        Seen(
            int(of["side"]),
            of["cells"],
            looks(of["deviation"].astype(float), of["light"].astype(float)),
            surface(
                of["angle"].astype(float), len(of["cells"]), camera_mm=of["at"][0], projector_mm=of["at"][1]
            ),
        )
        for of in places
    ]


def looks(deviation_mm: Floats, brighter: Floats) -> Looks:
    """Depths, and by how much the logarithm of the light exceeds what was to be expected."""
    return Looks(brighter, np.zeros_like(brighter), deviation_mm)


def at(azimuth_deg: float) -> Floats:
    azimuth = np.radians(azimuth_deg)
    return np.array([600.0 * np.cos(azimuth), 600.0 * np.sin(azimuth), 100.0])


def seen(profile: Floats, *, camera_deg: float, projector_deg: float, noise: float = 0.0) -> Seen:
    """A place of ten rows that all show the same, as bright as the surface."""
    deviation = np.tile(profile, (10, 1)) + noise * np.random.default_rng(4).standard_normal(
        (10, len(profile))
    )
    cells = np.tile(np.abs(profile) > 0.05, (10, 1))
    devices = {"camera_mm": at(camera_deg), "projector_mm": at(projector_deg)}
    return Seen(0, cells, looks(deviation, np.zeros_like(deviation)), surface(ANGLE, 10, **devices))


def test_flanks_of_rendered_wheels_are_told() -> None:
    """Drawn after the rule was made: ridges and nicks 25 to 55 degrees aside of the camera, six metals.

    A rule that knows nothing has a chance below 1e-4 to be right at four fifths of so many of either side.
    """
    places = rendered()
    right = np.array([one.side * one.told() for one in places])
    side = np.array([one.side for one in places])
    for each in (1, -1):
        says = right[(side == each) & (np.abs(right) >= 1.0)]
        assert len(says) >= 20
        assert (says > 0.0).mean() >= 0.8


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_high_beyond_low_stands_up_and_the_other_way_round_is_cut_in(way: float, noise: float) -> None:
    profile = RIDGE[:: int(way)]
    devices = {"camera_deg": 40.0 * way, "projector_deg": 22.0 * way}
    assert seen(profile, noise=noise, **devices).told() == pytest.approx(MOST)
    assert seen(-profile, noise=noise, **devices).told() == pytest.approx(-MOST)


@pytest.mark.parametrize(
    ("camera_deg", "projector_deg"),
    [(0.0, -18.0), (20.0, 2.0), (10.0, 28.0), (40.0, 40.0), (-50.0, -55.0)],
)
def test_from_the_front_or_with_both_as_far_aside_one_side_says_nothing(
    camera_deg: float, projector_deg: float
) -> None:
    devices = {"camera_deg": camera_deg, "projector_deg": projector_deg}
    for profile in (np.maximum(RIDGE, 0.0), np.minimum(RIDGE, 0.0)):
        assert seen(profile, **devices).told() == 0.0


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_walls_that_mirror_each_other_swap_places(way: float, noise: float) -> None:
    """Six of 44 nicks were called ridges. Light from wall to wall makes the projector's side look high."""
    crossed = RIDGE[:: int(way)]  # high at smaller angles, or at larger ones

    def told(profile: Floats, camera_deg: float, projector_deg: float) -> float:
        devices = {"camera_deg": way * camera_deg, "projector_deg": way * projector_deg}
        return seen(profile, noise=noise, **devices).told()

    # the projector at smaller angles, and farther aside
    for devices in ((-5.0, -24.0), (-20.0, -38.0)):
        assert told(crossed, *devices) == pytest.approx(-MOST, rel=0.01)
        assert told(-crossed, *devices) == pytest.approx(MOST, rel=0.01)
    # the camera farther aside sees the ridge's image before it, as high and low as a nick's
    assert told(crossed, 20.0, 1.0) == 0.0
    assert told(-crossed, 20.0, 1.0) == MOST
    assert 0.0 > told(crossed, 6.0, -14.0) > told(crossed, 2.0, -18.0) > -MOST
    # patterns along the place swap nothing
    assert told(crossed, -20.0, -23.0) == told(-crossed, -20.0, -23.0) == 0.0


def test_it_grows_with_the_angle() -> None:
    grown = [seen(RIDGE, camera_deg=deg, projector_deg=deg - 18.0).told() for deg in (24.0, 27.0, 30.0, 33.0)]
    assert grown[0] == 0.0
    assert grown[0] < grown[1] < grown[2] < grown[3] == pytest.approx(MOST)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_lit_from_aside_what_shines_tells(way: float) -> None:
    """The far wall of a nick 2.4 mm wide on chrome shines and is low; what bounced is high, and darker."""
    depth = np.array([0, 0, 0, -0.1, -0.5, -0.9, -1.2, -0.8, 0.9, 1.2, 0.7, 0.4, 0.3, 0, 0, 0, 0])
    shine = np.array([0, 0, 0, 0.5, 1.5, 2.0, 2.0, 1.0, -0.5, -0.5, -0.5, -0.5, -0.5, 0, 0, 0, 0])
    depth, shine = depth[:: int(way)], shine[:: int(way)]

    def told(lit_deg: float) -> float:
        place = seen(depth, camera_deg=way * (lit_deg - 18.0), projector_deg=way * lit_deg)
        assert place.told() == pytest.approx(-MOST)  # as much of either, and crossed
        return place._replace(looks=looks(place.looks.deviation_mm, np.tile(shine, (10, 1)))).told()

    assert told(25.0) == 0.0
    assert told(45.0) == told(58.0) < -0.7 * MOST
    assert told(35.0) == pytest.approx(0.5 * told(45.0), rel=0.1)
    high = seen(np.maximum(depth, 0.0), camera_deg=way * 27.0, projector_deg=way * 45.0)
    assert high.told() == pytest.approx(MOST)


def test_what_is_nearly_all_high_or_low_is_that() -> None:
    """A ridge of 1.5 mm on polished metal, six parts in seven high, was told a nick by its model."""
    devices = {"camera_deg": 40.0, "projector_deg": 22.0}
    for profile in (RIDGE, RIDGE[::-1]):
        assert seen(np.maximum(profile, -0.05), **devices).told() == pytest.approx(MOST)
        assert seen(np.minimum(profile, 0.05), **devices).told() == pytest.approx(-MOST)
    nothing = seen(np.where(RIDGE != 0.0, np.nan, 0.0), **devices)
    assert nothing._replace(cells=np.tile(RIDGE != 0.0, (10, 1))).told() == 0.0


def test_beside_a_flank_that_shines_a_depth_is_its_border_s() -> None:
    """A ridge of 0.8 mm on turned metal as it was measured: lit, its far border looked low, and it a nick."""
    deviation = np.array([0, 0, 0, 0, -0.32, 0.61, 0.45, 0.28, 0.02, -0.09, 0.09, 0.05, 0, 0, 0, 0, 0])
    shine = np.array([0, 0, 0, 0, 0, 1.6, 2.4, 2.5, 2.0, 0.7, 0.3, 0.1, 0, 0, 0, 0, 0])
    dull = seen(deviation, camera_deg=40.0, projector_deg=22.0)

    def told(brighter: Floats) -> float:
        return dull._replace(looks=looks(dull.looks.deviation_mm, np.tile(brighter, (10, 1)))).told()

    assert dull.told() == told(np.full(17, 1.0)) == told(np.full(17, -1.0)) == pytest.approx(-MOST)
    assert told(shine) == pytest.approx(MOST)


def test_neither_outweighs_the_other() -> None:
    """A curl on chrome, 0.85 mm: triangles told a nick by 11, and it was called one."""
    misfits = np.full((2, 3, 12), 20.0)
    misfits[1, :, 5] -= 10.9
    told = Told(np.ones(3), np.geomspace(0.06, 2.4, 12), misfits, np.zeros(2), np.zeros((2, 2)))
    cells = np.zeros((1, 1), bool)
    place = Place(cells, above=60, below=40, unmeasured=0, contrast=1.0, told=told, aside=MOST)
    assert place.side == 1
    assert place.undecided  # then the depth decides
    assert Place(cells, above=60, below=40, unmeasured=0, contrast=1.0, told=told).side == -1
