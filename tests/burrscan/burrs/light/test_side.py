"""Ridge or nick: places of wheels rendered by path tracing, and what must not change the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh, perpendicular_basis
from burrscan.burrs.light.disturbed import Place
from burrscan.burrs.light.section import BOUNCE_TILTS_DEG, TILTS_DEG, seen, shaped
from burrscan.burrs.light.side import Looks, Told, told_of
from burrscan.burrs.light.unrolled import Unrolled

PLACES = Path(__file__).parents[3] / "data" / "rendered_places.npz"
WIDEST_MM = 3.0


@dataclass(frozen=True)
class Rendered:
    """A disturbed place of a rendered scan, and the side of the burr that is there."""

    side: int
    cells: Bools
    looks: Looks
    surface: Unrolled

    def told(self) -> Told | None:
        return told_of(self.cells, self.looks, self.surface, widest_mm=WIDEST_MM)

    def leaning(self) -> float:
        told = self.told()
        return 0.0 if told is None else told.ridge_over_nick


def rendered() -> list[Rendered]:
    with np.load(PLACES) as file:
        every = [name.split("_") for name in file]
        return [
            _place({key: file[f"{number}_{key}"] for one, key in every if one == number})
            for number in sorted({one for one, _ in every})
        ]


def _place(of: dict[str, Floats]) -> Rendered:
    rows, near = of["light"].shape
    parallel = of["parallel"].astype(float)
    columns = slice(int(of["first"]), int(of["first"]) + near)

    def wide(values: Floats) -> Floats:
        whole = np.full((rows, len(parallel)), np.nan)
        whole[:, columns] = values
        return whole

    cells = np.zeros((rows, len(parallel)), bool)
    cells[:, columns] = of["cells"]
    z, r = of["zr"][:2]
    looks = Looks(wide(of["light"]), np.tile(parallel, (rows, 1)), wide(of["deviation"]))
    angle = np.linspace(of["angle"][0], of["angle"][1], len(parallel))
    T_part_camera = T_part_mesh(of["point"], of["direction"])
    surface = Unrolled(
        np.full(rows, z), np.full(rows, r), np.tile([0.0, 1.0], (rows, 1)),
        angle, np.zeros((2, *cells.shape)), np.ones(cells.shape, bool), np.ones(cells.shape),
        float(of["step"]), T_part_camera[:3, 3], (T_part_camera @ np.linalg.inv(of["T"]))[:3, 3],
        T_part_camera[:3, :3] @ of["T"][1, :3],
    )  # fmt: skip
    return Rendered(int(of["side"]), cells, looks, surface)


def told_by(misfits: Floats) -> Told:
    """Misfits (2, 3, 12) of sizes, and nothing of where the burr is."""
    return Told(np.ones(3), np.geomspace(0.06, 2.4, 12), misfits, np.zeros(2), np.zeros((2, 2)))


@pytest.mark.study
def test_no_rendered_place_is_told_wrong_and_most_are_told() -> None:
    """Ridges and nicks of 0.3 to 2 mm, five metals and matte, on wheels that nothing was tuned to."""
    places = rendered()
    right = np.array([one.side * one.leaning() for one in places])
    side = np.array([one.side for one in places])
    assert (int((side > 0).sum()), int((side < 0).sum())) == (34, 33)
    assert (right > -4.0).all()  # a likelihood ratio of two standard deviations
    assert (right >= 4.0).mean() > 0.7
    assert (right <= -1.0).sum() <= 1  # of 17 that are told less clearly


def test_a_place_that_runs_round_the_axis_is_left_open() -> None:
    place = rendered()[0]
    wide = np.zeros_like(place.cells)
    wide[:, place.cells.any(axis=0).argmax() :][:, : 3 * len(place.cells)] = True
    assert replace(place, cells=wide).told() is None


def test_nothing_is_told_where_nothing_is_seen() -> None:
    place = rendered()[0]
    nothing = np.full(place.cells.shape, np.nan)
    assert replace(place, looks=Looks(nothing, nothing, nothing)).told() is None
    blind = Looks(nothing, place.looks.predicted, nothing)
    assert abs(replace(place, looks=blind).leaning()) < 1.0


def test_no_side_is_told_by_what_is_too_steep_or_too_flat() -> None:
    """Such a nick explained a flake of 1.7 mm on polished metal."""
    misfits = np.full((2, 3, 12), 20.0)
    for end in (0, 1, 10, 11):
        one = misfits.copy()
        one[1, :, end] = 2.0
        assert told_by(one).ridge_over_nick == 0.0
    misfits[1, :, 5] = 2.0
    assert told_by(misfits).ridge_over_nick == -18.0


@pytest.mark.parametrize(
    ("above", "below", "better", "side", "open_"),
    [
        (53, 39, 3.3, -1, False),  # a nick on polished metal, 0.8 mm: its walls mirror each other
        (65, 35, 1.8, -1, True),
        (81, 53, 1.1, -1, True),
        (35, 50, 0.0, -1, True),  # a curl 0.5 mm wide
        (5, 95, -1.5, -1, False),  # nearly all below outweighs what is told weakly
        (5, 95, -4.0, 1, False),  # and no more
        (50, 50, 1.1, -1, False),
        (50, 50, 0.9, -1, True),
    ],
)
@pytest.mark.parametrize("sign", [-1, 1])
def test_what_is_told_and_what_is_counted_add_up(
    above: int, below: int, better: float, side: int, sign: int, *, open_: bool
) -> None:
    """The first three were called ridges: the cells had decided. ``better`` is by how much a nick is."""
    misfits = np.full((2, 3, 12), 15.0)
    misfits[int(sign * better > 0.0), :, 5] -= abs(better)
    told = told_by(misfits)
    nothing = np.zeros((1, 1), bool)
    up, down = (above, below)[::sign]
    place = Place(nothing, above=up, below=down, unmeasured=0, contrast=1.0, told=told)
    assert place.undecided == open_
    assert place.side == side * sign


def test_a_height_is_told_by_what_its_burr_shows() -> None:
    """Burrs made by the model itself, on metal: their heights lie within what is stated, wrong ones do not.

    Six pulls of a side: a root mean square above 1.6 has a chance of one in a thousand. Flat ones are told as
    well as steep ones: nothing is held of them beforehand.
    """
    place = next(one for one in rendered() if one.side < 0)
    rng, pulls = np.random.default_rng(2), []
    for side in (1, -1) * 6:
        width, aspect = float(rng.uniform(1.8, 2.8)), float(rng.uniform(0.2, 0.95))
        told = replace(place, looks=_shown(place, side * aspect * width, width)).told()
        assert told is not None
        assert not told.contradicts(aspect * width, side=side)
        assert told.contradicts(6.0 * aspect * width, side=side)
        height = told.height(side=side)
        pulls.append((height.value - aspect * width) / height.sigma)
    assert np.abs(pulls).max() < 3.0
    assert np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_where_nothing_is_told_every_width_and_flank_is_as_likely() -> None:
    told = told_by(np.full((2, 3, 12), 7.0))
    heights = told.widths_mm[:, None] * told.aspects
    for side in (1, -1):
        assert told.height(side=side).value == pytest.approx(heights.mean())
        assert told.height(side=side).sigma > heights.std()


def test_an_angle_is_told_by_what_its_burr_shows() -> None:
    """Wherever in the place it is: pulls as of the heights."""
    place = next(one for one in rendered() if one.side < 0)
    rng, pulls = np.random.default_rng(3), []
    radius = float(place.surface.r_mm[0])
    for side in (1, -1) * 6:
        width, aspect = float(rng.uniform(1.8, 2.8)), float(rng.uniform(0.45, 0.95))
        off = float(rng.uniform(-0.5, 0.5)) / radius
        told = replace(place, looks=_shown(place, side * aspect * width, width, off_rad=off)).told()
        assert told is not None
        angle = told.angle_rad(side=side)
        assert radius * angle.sigma < 0.3
        pulls.append((angle.value - _middle(place) - off) / angle.sigma)
    assert np.abs(pulls).max() < 3.0
    assert np.sqrt(np.mean(np.square(pulls))) < 1.6


def test_a_ridge_lit_from_aside_is_not_where_most_is_high() -> None:
    """The wheel before it mirrors its flank: what looks high there outshines the ridge's own crest."""
    place = next(one for one in rendered() if one.side < 0)
    middle, far = _middle(place), 700.0
    # the projector flatter than the camera, and a place wide enough for the ridge and what it is mirrored in
    camera, projector = (
        far * np.array([np.cos(middle + aside), np.sin(middle + aside), 0.0]) for aside in (0.6, 0.95)
    )
    surface = replace(place.surface, camera_mm=camera, projector_mm=projector)
    columns = np.flatnonzero(place.cells.any(axis=0))
    wide = np.zeros_like(place.cells)
    wide[:, columns[0] - 4 : columns[-1] + 5] = True
    lit = replace(place, surface=surface, cells=wide)
    shown = _shown(lit, 1.2, 1.0)
    high = np.clip(np.nan_to_num(shown.deviation_mm[0]), 0.0, None) * np.exp(shown.light[0])
    radius = float(surface.r_mm[0])
    seen_mm = radius * (float(high @ surface.angle / high.sum()) - middle)
    told = replace(lit, looks=shown).told()
    assert told is not None
    assert seen_mm > 2.0
    assert abs(radius * (told.angle_rad(side=1).value - middle)) < 0.2


def _middle(place: Rendered) -> float:
    columns = np.flatnonzero(place.cells.any(axis=0))
    return 0.5 * float(place.surface.angle[columns[0]] + place.surface.angle[columns[-1]])


def _shown(place: Rendered, height: float, width: float, *, off_rad: float = 0.0) -> Looks:
    """What a straight burr beside the middle of a place would show, in every row."""
    surface, middle = place.surface, _middle(place) + off_rad
    burr = shaped(float(surface.r_mm[0]), middle, width, height)
    lobe = np.exp(-0.5 * (TILTS_DEG / 8.0) ** 2) + 0.01
    facets = np.exp(-0.5 * (BOUNCE_TILTS_DEG / 8.0) ** 2)
    lobes, bounces = np.stack([lobe, lobe]), np.stack([facets, facets]) / facets.sum()
    row = (0.0, 0.0, float(surface.z_mm[0]))
    device = surface.camera_mm - row, surface.projector_mm - row, perpendicular_basis(surface.columns)
    every = np.array([seen(angle, burr, lobes, bounces, *device) for angle in surface.angle])
    bare = shaped(float(surface.r_mm[0]), middle, width, 1e-6)
    without = np.array([seen(angle, bare, lobes, bounces, *device)[0] for angle in surface.angle])
    rows = (len(place.cells), 1)
    return Looks(
        np.tile(np.log(every[:, 0] + 0.005), rows),
        np.tile(np.log(without + 0.005), rows),
        np.tile(np.where(every[:, 0] > 0.0, every[:, 1], np.nan), rows),
    )
