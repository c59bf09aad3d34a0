"""How often a servo can converge: the real arm's errors, and looks that err by a given amount.

    python -m bench.experiments.servo_bound

The servo itself, with the arm of the suite's cell and a part moved by 2 mm and 1 degree; only the looks are
not rendered: each has the burr's true place with a normal error across it and a quarter of that along the
normal. Printed for several of such errors, and for several probabilities at which the servo stops: how many
runs stop in four looks, and how many of those are within the tolerance in truth, across and along the normal.
The table of ``burrscan/cell/README.md``. Two minutes of one core.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.reproduction.scenery import paper_scene
from bench.reproduction.servoing import stated_burr
from burrscan.arrays import Floats
from burrscan.cell.servo import Finding, servo
from burrscan.cell.track import Tracked
from burrscan.inspection import Burr
from scenes.cell.spec import CellSpec
from scenes.cell.truth import base_pose, tool_over
from scenes.cell.workcell import SimulatedCell
from scenes.scene import scene_from
from scenes.wheel import build_wheel

_TOLERANCE_MM = 0.05
"""The servo's default."""
_LOOKS_MM = (0.0, 0.015, 0.025, 0.035, 0.045)
"""Standard deviations of a look's place across the burr."""
_SURE = (0.9, 0.8, 0.7, 0.6)
"""Probabilities at which to stop."""
_ALONG_NORMAL = 0.25
"""Of a look's error across the burr: the surface is known by many more points."""
_LEAST_MM = 1e-4
"""What a look without error states."""
_RUNS = 200
"""Shares are then known to 3 %."""


class _Telling:
    """A finder that knows the truth and errs by a given amount."""

    def __init__(self, cell: SimulatedCell, burr: Burr, pose: Floats, sigma_mm: float, seed: int) -> None:
        self._cell, self._burr, self._pose, self._sigma_mm = cell, burr, pose, sigma_mm
        self._rng = np.random.default_rng(seed)

    def __call__(self, T_camera_burr: Floats, gate_mm: float) -> Finding:
        """Where the burr is, nearly; nothing where it is farther from its place than it may be."""
        true = self._cell.T_camera_part @ self._pose
        if abs(float((np.linalg.inv(T_camera_burr) @ true)[1, 3])) > gate_mm:
            return Finding(None)
        error = np.eye(4)
        error[1:3, 3] = self._sigma_mm * self._rng.normal(size=2) * [1.0, _ALONG_NORMAL]
        seen = replace(self._burr, T_mesh_burr=true @ error)
        return Finding(Tracked(seen, max(self._sigma_mm, _LEAST_MM)))


def stopped(look_mm: float, sure: float) -> tuple[float, float]:
    """Shares of runs that stop, and of those that are within the tolerance, across and along the normal."""
    scene = scene_from(paper_scene("catalogue", scale=0.5), source="paper")
    wheel = build_wheel(scene.wheel, scene.burrs)
    stop, within = [], []
    for seed in range(_RUNS):
        cell = SimulatedCell(scene, CellSpec(), identity=(seed,), wheel=wheel)
        pose = base_pose(cell.wheel, 0)
        burr = stated_burr(cell.wheel.burrs[0], pose)
        where = cell.T_plate_part @ pose
        cell.disturb()
        finder = _Telling(cell, burr, pose, look_mm, seed)
        reached = servo(cell.station(), burr, where, tolerance_mm=_TOLERANCE_MM, sure=sure, find=finder)
        stop.append(reached.converged)
        across, normal = tool_over(cell.T_part_tool, cell.wheel, 0)
        off = max(abs(across), abs(normal - reached.glances[-1].height_mm))
        within.append(off <= _TOLERANCE_MM)
    stops = np.array(stop)
    return float(stops.mean()), float(np.array(within)[stops].mean()) if stops.any() else np.nan


def main() -> None:
    """Print the table."""
    print("a look errs by, mm: " + ", ".join(map(str, _LOOKS_MM)) + "; stop / of those within, %")
    for sure in _SURE:
        cells = [f"{100 * a:.0f} / {100 * b:.0f}" for a, b in (stopped(look, sure) for look in _LOOKS_MM)]
        print(f"{sure:g} sure: " + ", ".join(cells), flush=True)


if __name__ == "__main__":
    main()
