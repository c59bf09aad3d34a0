"""How fast each planner finds burrs: share found against looks, on many parts, nothing being rendered.

    python -m bench.experiments.planner_curve [--parts N]

The planners themselves, the arm and the choices of the suite's cell, and the evidence as it is joined; only
the looks are drawn: a cell in sight is measured, and a burr in it called as often as
:class:`burrscan.cell.outlook.Outlook` says, as clearly as rendered burrs are. So the world is what the
planner believes it is, and what is compared is how well it plans. Two worlds: six burrs anywhere that some
pose shows, lying along the generatrix or around the axis, and six along the generatrix on the outermost tenth
of the radius. Three wheels in turn, put down at any angle; all planners meet the same burrs. The table of
``burrscan/cell/README.md`` is of 120 parts: a minute and a half of one core.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.pose import pose_on_surface
from burrscan.cell.belief import SURE
from burrscan.cell.chart import AROUND, Chart, chart_of
from burrscan.cell.choices import Arm, Choice, all_choices, arm_poses, outlooks
from burrscan.cell.evidence import CLEAR, LEAST, Call
from burrscan.cell.fusion import believed
from burrscan.cell.outlook import Outlook, outlook
from burrscan.cell.planners import METHODS
from burrscan.cell.planners.known import Known
from burrscan.cell.station import Station, turned
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.variants import resolve
from scenes.cell.spec import CellSpec
from scenes.cell.workcell import SimulatedCell
from scenes.scene import scene_from

_WHEELS = ("paper", "stepped_hub", "vase")
_LOOKS = 8
"""Of the suite."""
_BURRS = 6
"""On a part, as in the suite."""
_MEASURED = 0.99
"""Share of a cell in sight that a look measures: the coverage of the suite ``standard``."""
_OUTER = 0.9
"""Share of the largest radius from which a cell is on the outside."""
_ASIDE_DEG = 45.0
"""Said of a call that does not face its burr; sizes are not asked for here."""
_PARTS = 60
"""Of each world; the means are then known to 2 points."""


@dataclass(frozen=True)
class World:
    """A wheel in the cell, and what every choice of a stand shows of it."""

    station: Station
    chart: Chart
    choices: tuple[Choice, ...]
    arms: tuple[Arm, ...]
    axis: Axis
    views: tuple[Outlook, ...]


@dataclass(frozen=True)
class Placed:
    """A burr: how it lies (0 along the generatrix, 1 around the axis), its cell, and what is said of it."""

    cell: tuple[int, int, int]
    burr: Burr


def world_of(wheel: str) -> World:
    """A wheel of the catalogue, upright in the middle of the table."""
    scene = scene_from({"wheel": wheel, "rig": {"scale": 0.5}}, source=wheel)
    cell = SimulatedCell(scene, CellSpec(placed_mm=0.0, placed_deg=0.0, turned_deg=0.0))
    station = cell.station()
    z, r = cell.wheel.generatrix_zr_mm.T
    lift = cell.T_plate_part[2, 3]  # the part's frame is the plate's
    chart = chart_of(Generatrix(z + lift, r, np.zeros(len(z)), np.zeros(len(z))))
    poses = arm_poses(station)
    choices = all_choices(poses)
    rig = station.scanner.rig
    # by their poses, not as turns of the map: what the planner gets wrong about turns must show
    views = [
        outlook(
            chart,
            rig,
            np.linalg.inv(poses[choice.arm]) @ turned(station.T_base_plate, choice.turn_deg),
            chart.angles,
        )
        for choice in choices
    ]
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), method="truth")
    arms = outlooks(chart, rig, station, poses, np.eye(4))
    return World(station, chart, choices, arms, axis, tuple(views))


def _rows(world: World, *, outside: bool) -> Ints:
    """Cells along the generatrix that some pose shows."""
    seen: Bools = np.any([view.seen.any(axis=1) for view in world.views], axis=0)
    r = world.chart.zr_mm[:, 1]
    return np.flatnonzero(seen & ((r > _OUTER * r.max()) if outside else True))


def burrs_on(world: World, rng: np.random.Generator, *, outside: bool) -> list[Placed]:
    """Burrs drawn by area: anywhere and lying either way, or outside and along the generatrix."""
    rows = _rows(world, outside=outside)
    area = world.chart.area_mm2[rows]
    return [
        _stated(
            world,
            0 if outside else int(rng.integers(2)),
            int(rng.choice(rows, p=area / area.sum())),
            int(rng.integers(AROUND)),
            float(rng.exponential(CLEAR)),
        )
        for _ in range(_BURRS)
    ]


def _stated(world: World, line: int, row: int, around: int, clear: float) -> Placed:
    chart, angle = world.chart, float(world.chart.angles[around])
    direction = np.array([1.0, 0.0] if line else [0.0, 1.0])
    pose = pose_on_surface(chart.zr_mm[row], chart.normals_zr[row], angle, direction, world.axis)
    one, z = Value(1.0, 0.1), Value(float(chart.zr_mm[row, 0]), 0.1)
    burr = Burr(
        side="protrusion", angle_deg=Value(float(np.degrees(angle)), 0.1), z_start_mm=z, z_end_mm=z,
        height_mm=one, width_mm=one, length_mm=one, area_mm2=one, volume_mm3=one, T_mesh_burr=pose,
        significance=LEAST + clear,
    )  # fmt: skip
    return Placed((line, row, around), burr)


def found_by_look(world: World, planner: str, burrs: list[Placed], *, seed: int) -> Floats:
    """(looks,) share of burrs called for certain after each."""
    plan = resolve(planner, METHODS, stage="planner")
    rng, draws = np.random.default_rng(seed), np.random.default_rng(seed)
    calls: list[Call] = []
    looks: list[tuple[Outlook, Floats]] = []
    known = Known(world.station, world.choices, (), _LOOKS, 2.0, draws)
    share = []
    for look in range(_LOOKS):
        number = plan(known)[0]
        view = world.views[number]
        looks.append((view, np.where(view.seen, _MEASURED, 0.0)))
        for one in burrs:
            chance = SURE * _MEASURED * view.seen[one.cell[1:]] * view.shows[one.cell]
            if rng.random() < chance:
                faced = bool(view.faces[one.cell])
                aside = 0.0 if faced else _ASIDE_DEG
                along = bool(view.along[one.cell])
                calls.append(Call(look, one.burr, one.burr.T_mesh_burr, aside, faced, along))
        belief, places = believed(calls, looks, axis=world.axis, chart=world.chart, burrs=2.0)
        sure = {id(call.burr) for place in places if place.certain for call in place.calls}
        share.append(np.mean([id(one.burr) in sure for one in burrs]))
        known = replace(
            known, taken=(*known.taken, number), chart=world.chart, belief=belief, arms=world.arms
        )
    return np.array(share)


def main() -> None:
    """Print the table."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    parser.add_argument("--parts", type=int, default=_PARTS)
    parts = parser.parse_args().parts
    worlds = [world_of(wheel) for wheel in _WHEELS]
    for outside in (False, True):
        where = "outside, along the generatrix" if outside else "anywhere"
        print(f"{where}: {parts} parts, found by look, %")
        curves = {planner: np.empty((parts, _LOOKS)) for planner in METHODS}
        for part in range(parts):
            world = worlds[part % len(worlds)]
            burrs = burrs_on(world, np.random.default_rng((part, int(outside))), outside=outside)
            for planner in METHODS:
                curves[planner][part] = 100.0 * found_by_look(world, planner, burrs, seed=part)
        for planner, curve in curves.items():
            less = (curves["expected"] - curve).mean(axis=1)
            shares = " ".join(f"{share:3.0f}" for share in curve.mean(axis=0))
            below = f"{less.mean():.1f} ± {less.std() / np.sqrt(parts):.1f} below expected"
            print(f"{planner:>9}: {shares}, mean {curve.mean():.1f}, {below}", flush=True)


if __name__ == "__main__":
    main()
