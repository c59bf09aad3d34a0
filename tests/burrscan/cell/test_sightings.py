"""Looks of one burr joined, the arm's moves between them unknown."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.cell.positioner import PositionerSheet
from burrscan.cell.sightings import Sighting, place_now, place_to_go
from tests.tiers import some_of

_SHEET = PositionerSheet(reach_mm=1300.0)
_LEVER_MM = 500.0
_SCATTER_MM = float(np.hypot(_SHEET.scatter_mm, np.radians(_SHEET.scatter_deg) * _LEVER_MM))


def _pose(across: float, *, height: float = 0.0) -> Floats:
    pose = np.eye(4)
    pose[1:3, 3] = across, height
    return pose


def _runs(count: int, *, own: float, looks: int) -> list[tuple[list[Sighting], float]]:
    """Looks of a burr at 0 with moves that scatter, and where it is by the arm's word at the last."""
    rng = np.random.default_rng(7)
    runs = []
    for _ in range(count):
        moved = _SCATTER_MM * rng.normal(size=looks)
        sights = [
            Sighting(_pose(m + own * rng.normal()), _pose(0.0, height=8.0), own, number)
            for number, m in enumerate(moved)
        ]
        runs.append((sights, float(moved[-1])))
    return runs


def _joined(sights: list[Sighting]) -> tuple[float, float, float]:
    now, sigma = place_now(sights, sheet=_SHEET, lever_mm=_LEVER_MM)
    return float(now[1, 3]), sigma, float(place_to_go(sights, sheet=_SHEET, lever_mm=_LEVER_MM)[1, 3])


def test_one_look_is_what_it_says() -> None:
    now, sigma, go = _joined([Sighting(_pose(0.3), _pose(0.0), 0.02, 0)])
    assert (now, go) == (0.3, 0.3)
    assert np.isclose(sigma, 0.02)


@some_of("looks", [2, 3, 5])
def test_where_the_mill_stands_is_for_the_last_look_to_say_and_where_to_go_for_all(looks: int) -> None:
    for own in (0.01, 0.06):
        runs = _runs(800, own=own, looks=looks)
        joined = np.array([[*_joined(sights), true] for sights, true in runs])
        now = joined[:, 0] - joined[:, 3]
        alone = np.array([sights[-1].T_base_burr[1, 3] - true for sights, true in runs])
        last = np.array([sights[-1].T_base_burr[1, 3] for sights, _ in runs])
        # the last look and a mean of those before it, which share its move: the bound of two errors
        before = (own**2 + _SCATTER_MM**2) / (looks - 1) + _SCATTER_MM**2
        bound = (own**-2.0 + 1.0 / before) ** -0.5
        assert now.std() < alone.std()
        assert now.std() == pytest.approx(bound, rel=0.08)  # three standard errors of 800
        # stated as it is, with what looks that happen to disagree add (Birge); with two it is a sixth
        assert 0.8 < now.std() / np.sqrt((joined[:, 1] ** 2).mean()) < 1.04
        # the next move scatters about the mean of the moves, which is 0
        assert joined[:, 2].std() < 1.1 * last.std() / np.sqrt(looks)


def test_looks_that_disagree_make_it_less_sure() -> None:
    apart = [Sighting(_pose(y), _pose(0.0), 0.01, n) for n, y in enumerate((0.0, 0.6, -0.5))]
    assert _joined(apart)[1] > 0.03


def test_looks_after_one_move_share_its_error_and_half_of_their_own() -> None:
    own = 0.06
    first = Sighting(_pose(0.0), _pose(0.0), own, 0)
    alone = place_now([first], sheet=_SHEET, lever_mm=_LEVER_MM)[1]
    same = place_now([first, first], sheet=_SHEET, lever_mm=_LEVER_MM)[1]
    other = place_now([first, first._replace(move=1)], sheet=_SHEET, lever_mm=_LEVER_MM)[1]
    assert same == pytest.approx(alone * np.sqrt(0.75))  # no move between; a correlation of one half
    assert other == pytest.approx((own**-2.0 + 1.0 / (own**2 + 2.0 * _SCATTER_MM**2)) ** -0.5)
    # where to go next the error of one move is not averaged away by looking twice
    apart = first._replace(T_base_burr=_pose(0.3), move=1)
    go = place_to_go([first, first, first, apart], sheet=_SHEET, lever_mm=_LEVER_MM)[1, 3]
    assert 0.3 * 0.25 < go < 0.3 * 0.5


def test_a_flange_that_swings_about_the_mill_has_another_error() -> None:
    """Its place was taken for the mill's, which stands still while the flange goes 70 mm."""
    swung = _pose(0.0)
    swung[:3, :3] = Rotation.from_euler("x", 8.0, degrees=True).as_matrix()
    swung[:3, 3] = 0.0, -_LEVER_MM * np.sin(np.radians(8.0)), 0.0
    swung_look = Sighting(_pose(0.4), swung, 0.02, 0)
    near_look = Sighting(_pose(0.4), _pose(0.0), 0.02, 0)
    last = Sighting(_pose(0.0), _pose(0.0), 0.02, 1)
    assert _joined([swung_look, last])[2] < 0.5 * _joined([near_look, last])[2]


def test_a_look_from_far_away_says_little() -> None:
    far, near = (Sighting(_pose(0.4), _pose(0.0, height=h), 0.02, 0) for h in (150.0, 9.0))
    last = Sighting(_pose(0.0), _pose(0.0, height=8.0), 0.02, 1)
    assert abs(_joined([far, last])[0]) < 0.01 < abs(_joined([near, last])[0])
