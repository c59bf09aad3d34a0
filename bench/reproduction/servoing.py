"""Future work: a robot arm that follows what it sees to the burr, on a part that somebody has moved."""

from __future__ import annotations

import numpy as np

from bench.reproduction.lab import DEFAULT, SEED, Lab
from bench.reproduction.parts import Claim, Numbers, Section, Table
from bench.reproduction.scenery import paper_scene
from burrscan.arrays import Floats
from burrscan.cell.servo import servo
from burrscan.cell.station import turned
from burrscan.cell.toolpath import lift
from burrscan.cell.toolpose import move_tool
from burrscan.cell.turning import facing_turn
from burrscan.inspection import Burr, Value
from burrscan.pipeline import Pipeline
from scenes.cell.spec import CellSpec
from scenes.cell.truth import base_pose, tool_over
from scenes.cell.workcell import SimulatedCell
from scenes.scene import scene_from
from scenes.wheel import TrueBurr

SCENE = "catalogue"
DRAWS, SEED_DRAWS = 20, 5
"""Of the robot's errors, the part's place and how it is moved."""
TOLERANCE_MM = 0.05
"""Within which mill and burr shall agree: the servo's default."""
_BY_DEFAULT, _BY_SEED = 0, 1
"""Kinds of rows."""
_MOST = 0.9
"""Share of runs that must converge for the claim to stand."""


def measure(lab: Lab) -> Numbers:
    """Per draw: pipeline, looks, converged, true distance after servoing, and before it."""
    rows: list[list[float]] = []
    for kind, pipeline, draws in ((_BY_DEFAULT, DEFAULT, DRAWS), (_BY_SEED, SEED, SEED_DRAWS)):
        rows += [[kind, *_run(lab, pipeline, draw)] for draw in range(lab.repeats(draws))]
    return {"rows": np.array(rows)}


def draw(n: Numbers) -> Section:
    """Two lines of a table, and what they say."""
    ours, theirs = (n["rows"][n["rows"][:, 0] == kind][:, 1:] for kind in (_BY_DEFAULT, _BY_SEED))
    after = _after(ours)
    good = bool(ours[:, 1].mean() >= _MOST and np.median(after) <= 2.0 * TOLERANCE_MM)
    reached = f"to {np.median(after):.3f} mm in truth" if len(after) else "to nowhere"
    return Section(
        title="Future work: visual servoing to the burr",
        reports="Visual servoing of a robotic arm based on this detection is work in progress: the arm shall "
        "operate a tool that removes the burr.",
        measured="A simulated arm brings a mill over the burr by looking again from near by (burrscan.cell). "
        f"Without a look it is {np.median(ours[:, 2]):.1f} mm off; {_share(ours)} of {len(ours)} runs "
        f"converge, in {np.median(ours[:, 0]):.0f} looks, {reached}. With "
        f"the paper's own scan, axis and generatrix {_share(theirs)} of {len(theirs)} do.",
        claims=(
            Claim(
                "1, 6",
                "the detection serves visual servoing",
                "work in progress",
                _figure(theirs),
                _figure(ours),
                "yes" if good else "partly",
                "" if good else "not every run converges, or it ends farther away than the tolerance",
            ),
        ),
        tables=(
            Table(
                _HEADS,
                (_row("the default", ours), _row("the paper's method", theirs)),
                "Arm off by 0.5 mm and 0.2°, part moved by 2 mm and 1°; a run has converged when a look "
                f"measures no more than {TOLERANCE_MM} mm across the burr and along its normal",
            ),
        ),
    )


_HEADS = (
    "looks of", "draws", "converged", "looks, median", "mill off before, mm", "after, median mm",
    "after, largest mm",
)  # fmt: skip


def _row(name: str, rows: Floats) -> tuple[str, ...]:
    after = _after(rows)
    ends = (f"{np.median(after):.3f}", f"{after.max():.3f}") if len(after) else ("–", "–")
    return (
        name, str(len(rows)), f"{100 * rows[:, 1].mean():.0f} %", f"{np.median(rows[:, 0]):.0f}",
        f"{np.median(rows[:, 2]):.2f}", *ends,
    )  # fmt: skip


def _after(rows: Floats) -> Floats:
    """True distances of the runs that converged."""
    return np.asarray(rows[rows[:, 1] > 0.0, 3])


def _figure(rows: Floats) -> str:
    after = _after(rows)
    share = f"{_share(rows)} converge"
    return f"{share}, {np.median(after):.3f} mm" if len(after) else share


def _share(rows: Floats) -> str:
    return f"{100 * rows[:, 1].mean():.0f} %"


def _run(lab: Lab, pipeline: Pipeline, draw_: int) -> list[float]:
    """One servo: looks, whether it converged, true distance before any look, and in the end."""
    scene = scene_from(paper_scene(SCENE, scale=0.75 * lab.scale), source="paper")
    cell = SimulatedCell(scene, CellSpec(), identity=(draw_,))
    station = cell.station()
    target = stated_burr(cell.wheel.burrs[0], base_pose(cell.wheel, 0))
    where = cell.T_plate_part @ target.T_mesh_burr
    cell.disturb()
    blind = np.asarray(station.table.move(turned(station.T_base_plate, facing_turn(station, where))) @ where)
    move_tool(station, lift(blind, 60.0))
    before = _off(cell, 60.0)
    reached = servo(station, target, where, tolerance_mm=TOLERANCE_MM, pipeline=pipeline)
    after = _off(cell, reached.glances[-1].height_mm)
    return [float(len(reached.glances)), float(reached.converged), before, after]


def _off(cell: SimulatedCell, height_mm: float) -> float:
    across, normal = tool_over(cell.T_part_tool, cell.wheel, 0)
    return max(abs(across), abs(normal - height_mm))


def stated_burr(true: TrueBurr, pose: Floats) -> Burr:
    """The burr as an earlier inspection would have stated it, in the part frame."""
    return Burr(
        side=true.side, angle_deg=Value(true.angle_deg, 0.1), z_start_mm=Value(true.z_start_mm, 0.1),
        z_end_mm=Value(true.z_end_mm, 0.1), height_mm=Value(true.height_mm, 0.05),
        width_mm=Value(true.width_mm, 0.1), length_mm=Value(true.length_mm, 0.1),
        area_mm2=Value(true.area_mm2, 0.1), volume_mm3=Value(true.volume_mm3, 1.0), T_mesh_burr=pose,
        significance=10.0,
    )  # fmt: skip
