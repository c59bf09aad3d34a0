"""Ridge or nick: places of wheels rendered by path tracing, and what must not change the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.light.side import Looks, side_of
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

    def told(self) -> int:
        return side_of(self.cells, self.looks, self.surface, widest_mm=WIDEST_MM)


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
        angle, np.zeros((2, *cells.shape)), np.ones(cells.shape, bool), float(of["step"]),
        T_part_camera[:3, 3], (T_part_camera @ np.linalg.inv(of["T"]))[:3, 3],
    )  # fmt: skip
    return Rendered(int(of["side"]), cells, looks, surface)


def test_no_rendered_place_is_told_wrong_and_most_are_told() -> None:
    """Ridges and nicks of 0.3 to 2 mm, five metals and matte, on wheels that nothing was tuned to."""
    places = rendered()
    told = np.array([one.told() for one in places])
    side = np.array([one.side for one in places])
    assert (int((side > 0).sum()), int((side < 0).sum())) == (34, 33)
    assert not (told == -side).any()
    assert (told == side).mean() > 0.7


def test_a_place_that_runs_round_the_axis_is_left_open() -> None:
    place = rendered()[0]
    wide = np.zeros_like(place.cells)
    wide[:, place.cells.any(axis=0).argmax() :][:, : 3 * len(place.cells)] = True
    assert replace(place, cells=wide).told() == 0


def test_nothing_is_told_where_nothing_is_seen() -> None:
    place = rendered()[0]
    nothing = np.full(place.cells.shape, np.nan)
    assert replace(place, looks=Looks(nothing, nothing, nothing)).told() == 0
    blind = Looks(nothing, place.looks.predicted, nothing)
    assert replace(place, looks=blind).told() == 0
