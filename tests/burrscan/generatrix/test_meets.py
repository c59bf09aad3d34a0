"""Ends of pieces that meet in a corner: which are joined, and where."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.generatrix.tracing.meets import met


def side(start: tuple[float, float], end: tuple[float, float]) -> Floats:
    """Nodes a millimetre apart."""
    count = round(float(np.hypot(end[0] - start[0], end[1] - start[1])))
    return np.linspace(start, end, count + 1)


def joined(*pieces: Floats) -> list[Floats]:
    return met(list(pieces), spacing_mm=1.0, reach_mm=2.3)


@pytest.mark.parametrize("turned", [False, True])
def test_two_sides_of_a_corner_are_one_piece(turned: bool) -> None:  # noqa: FBT001
    """One ends short of it, and the other follows a burr beyond it; whichever way each runs."""
    flat, wall = side((0.0, 70.0), (18.8, 70.0)), side((20.0, 71.0), (20.0, 50.0))
    (piece,) = joined(flat, wall[::-1] if turned else wall)
    ends = sorted([piece[0].tolist(), piece[-1].tolist()])
    assert ends == [[0.0, 70.0], [20.0, 50.0]]
    off = np.hypot(*(piece - [20.0, 70.0]).T)
    assert off.min() < 1e-9
    assert piece[:, 1].max() <= 70.0 + 1e-9
    assert np.linalg.norm(np.diff(piece, axis=0), axis=1).sum() == pytest.approx(40.0)


def test_others_stay_apart() -> None:
    flat = side((0.0, 70.0), (17.0, 70.0))
    corner_far = side((20.0, 70.0), (20.0, 50.0))
    across_a_groove = side((18.5, 70.0), (30.0, 70.0))
    back_along_a_thin_wall = side((17.5, 68.0), (0.0, 68.0))
    for other in (corner_far, across_a_groove, back_along_a_thin_wall):
        assert len(joined(flat, other)) == 2
    rounded_off = side((20.0, 69.0), (20.0, 50.0))
    assert (
        len(joined(flat[:-1], rounded_off)) == len(joined(side((0.0, 70.0), (19.0, 70.0)), rounded_off)) == 2
    )
    turning = np.concatenate([side((0.0, 70.0), (19.0, 70.0)), [[19.9, 69.2]]])
    assert len(joined(turning, side((20.0, 70.0), (20.0, 50.0)))) == 2
    bent = side((0.0, 70.0), (18.8, 70.0))
    bent[-4:, 1] += [0.0, 0.8, 0.0, 0.8]
    assert len(joined(bent, side((20.0, 70.0), (20.0, 50.0)))) == 2


def test_the_nearest_corner_comes_first_and_closed_pieces_have_none() -> None:
    flat, wall, step = (
        side((0.0, 70.0), (19.0, 70.0)),
        side((20.0, 69.8), (20.0, 50.0)),
        side((21.8, 70.0), (40.0, 70.0)),
    )
    pieces = joined(step, flat, wall)
    assert sorted(len(piece) for piece in pieces) == sorted([len(step), len(flat) + len(wall) + 1])
    turn = np.linspace(0.0, 2.0 * np.pi, 40)
    ring = np.stack([22.0 + 3.0 * np.cos(turn), 70.0 + 3.0 * np.sin(turn)], axis=1)
    ring[-1] = ring[0]
    assert len(joined(flat, ring)) == 2


def test_what_reaches_further_out_elsewhere_stays() -> None:
    """A hub above a flange lies beyond the line of the flange's other wall, and is no end of it."""
    hub_and_flange = np.concatenate(
        [
            side((-30.0, 90.0), (-10.0, 90.0)),
            side((-10.0, 89.0), (-10.0, 70.0)),
            side((-9.0, 70.0), (18.8, 70.0)),
        ]
    )
    (piece,) = joined(hub_and_flange, side((20.0, 71.0), (20.0, 50.0))[::-1])
    assert len(piece) == len(hub_and_flange) + 1 + 20
    (other,) = joined(
        side((0.0, 70.0), (19.0, 70.0)),
        np.concatenate(
            [
                side((20.0, 69.9), (20.0, 50.0)),
                side((21.0, 50.0), (45.0, 50.0)),
                side((45.0, 51.0), (45.0, 85.0)),
            ]
        ),
    )
    assert other[:, 1].max() == 85.0
