"""Where to look next: a drum seen from one side, and what each planner makes of it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np
import pytest

from burrscan.arrays import Floats, Image
from burrscan.cell.belief import belief_of, shifted
from burrscan.cell.chart import chart_of
from burrscan.cell.choices import Choice, all_choices, arm_poses, outlooks, stand_of
from burrscan.cell.outlook import Outlook
from burrscan.cell.planners.baselines import greedy, random, ring
from burrscan.cell.planners.expected import expected
from burrscan.cell.planners.known import Known
from burrscan.cell.positioner import PositionerSheet
from burrscan.cell.station import Station, go, turned
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import Rig
from burrscan.scanner import Patterns
from scenes.scene import scene_from
from tests.burrscan.cell.parts import generatrix, rig

Planner = Callable[[Known], list[int]]
_SCENE = scene_from({"wheel": "cylinder", "finish": "matte"}, source="test")


@dataclass
class Ideal:
    """A positioner that goes where it is sent."""

    sheet: PositionerSheet = PositionerSheet(reach_mm=5000.0)

    def move(self, T_base_flange: Floats) -> Floats:
        return T_base_flange


class Blind:
    """A scanner that takes no pictures."""

    rig: Rig = rig()
    camera: CameraSheet = _SCENE.camera.sheet
    projector: ProjectorSheet = _SCENE.projector.sheet

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        raise AssertionError((patterns, exposure_ms))


def station() -> Station:
    plate = np.eye(4)
    plate[:3, 3] = 900.0, 0.0, -300.0
    return Station(
        arm=Ideal(), table=Ideal(), scanner=Blind(), T_flange_camera=np.eye(4), T_camera_tool=np.eye(4),
        T_base_plate=plate, standoff_mm=600.0, middle_mm=np.array([0.0, 0.0, 20.0]),
    )  # fmt: skip


def known(taken: tuple[int, ...], *, most: int = 8, suspicion: tuple[int, float] | None = None) -> Known:
    """After looks that measured all that they had in sight."""
    cell, chart = station(), chart_of(generatrix())
    poses = arm_poses(cell)
    choices = all_choices(poses)
    arms = outlooks(chart, rig(), cell, poses, np.eye(4))
    looks = []
    for number in taken:
        choice = choices[number]
        still = arms[choice.arm].surface
        view = Outlook(
            **{field.name: shifted(getattr(still, field.name), -choice.cells) for field in fields(Outlook)}
        )
        looks.append((view, view.seen.astype(float)))
    belief = belief_of(chart, looks)
    if suspicion is not None:
        belief.suspicion[0, 5, suspicion[0]] = suspicion[1]
    return Known(
        station=cell, choices=choices, taken=taken, most=most, burrs=2.0, rng=np.random.default_rng(3),
        chart=chart, belief=belief, arms=arms,
    )  # fmt: skip


def _apart(one: Choice, other: Choice) -> float:
    return abs((one.turn_deg - other.turn_deg + 180.0) % 360.0 - 180.0)


@pytest.mark.parametrize("planner", [expected, greedy])
def test_the_next_look_is_at_what_was_not_seen(planner: Planner) -> None:
    state = known((0,))
    best = state.choices[planner(state)[0]]
    assert _apart(best, state.choices[0]) > 60.0


def test_planned_looks_see_the_drum_sooner_than_random_ones() -> None:
    def seen_after(planner: Planner, count: int) -> float:
        taken: tuple[int, ...] = ()
        for _ in range(count):
            state = known(taken) if taken else known((0,))
            taken = (*taken, planner(state)[0]) if taken else (0,)
        left = known(taken).belief
        assert left is not None
        return float(1.0 - left.left.mean())

    planned, even = seen_after(expected, 4), seen_after(ring, 4)
    drawn = np.mean([seen_after(random, 4) for _ in range(3)])
    # of a bare drum nothing is better than four even turns; looking one step ahead costs little of that
    assert planned > 0.92 * even
    assert planned > drawn


def test_a_suspicious_place_draws_a_look_once_all_is_seen() -> None:
    everything = tuple(range(0, 24, 2))
    # in front of the arm, cell by cell: at turn 0 the arm sees the part's angle 180, cell 60
    for cell in (10, 60, 100):
        state = known(everything, suspicion=(cell, 0.25))
        choice = state.choices[expected(state)[0]]
        flanks = state.arms[choice.arm].flanks
        assert any(shifted(flank.seen, -choice.cells)[5, cell] for flank in flanks)


@pytest.mark.parametrize(("found", "line"), [((9.0, 0.0), 0), ((0.0, 9.0), 1)])
def test_the_next_look_faces_burrs_that_lie_as_those_found_did(found: tuple[float, float], line: int) -> None:
    state = known((0,))
    assert state.belief is not None
    state.belief.found = np.array(found)
    surface = state.arms[state.choices[expected(state)[0]].arm].surface
    facing = surface.faces & surface.seen
    assert facing[line].sum() > 2 * facing[1 - line].sum()


def test_a_ring_is_even_whenever_it_is_broken_off() -> None:
    taken: tuple[int, ...] = ()
    turns = []
    for _ in range(8):
        number = ring(known((0,), most=8) if not taken else known(taken, most=8))[0] if taken else 0
        taken = (*taken, number)
        turns.append(known(taken).choices[number].turn_deg)
    assert sorted(turns) == pytest.approx([45.0 * n for n in range(8)])
    assert sorted(turns[:4]) == pytest.approx([0.0, 90.0, 180.0, 270.0])


def test_no_planner_looks_twice_from_one_place() -> None:
    state = known((0, 3, 30))
    for planner in (ring, random):
        assert not set(planner(state)) & {0, 3, 30}
    for planner in (expected, greedy):
        assert planner(state)[0] not in {0, 3, 30}


def test_a_stand_is_where_the_arm_and_the_table_go() -> None:
    cell = station()
    poses = arm_poses(cell)
    choice = Choice(0, 30.0)
    reported = go(cell, stand_of(choice, poses))
    by_hand = np.linalg.inv(turned(cell.T_base_plate, 30.0)) @ poses[0]
    assert np.allclose(reported, by_hand)
    # the middle of the part is in the middle of the picture, a standoff away
    seen = np.linalg.inv(reported) @ [0.0, 0.0, 20.0, 1.0]
    assert np.allclose(seen, [0.0, 0.0, 600.0, 1.0], atol=1e-9)
