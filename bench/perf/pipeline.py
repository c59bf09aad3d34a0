"""Images to mesh, stage by stage, for the adaptive default: 60 recorded frames replayed from memory.

    python -m bench.perf.pipeline [--scene NAME] [--scale S] [--rounds N]

The pictures are taken once; then the scan's own work on them is timed without the taking. Printed: wall and
processor milliseconds (median over the rounds) of each stage; of planning, which chooses the next patterns
while the scan runs and turns no image into geometry; of all the rest, images to mesh; and what reading every
frame once costs, which no decoder can undercut.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable
from types import FunctionType
from typing import Any

import numpy as np

from burrscan.arrays import Image
from burrscan.meshing import surface
from burrscan.scan import adaptive
from burrscan.scanner import PassThrough, Patterns, Scanner
from scenes.scene import scene_document, scene_from
from scenes.simulate import simulate

_STAGES = (
    "bracket", "read", "lens_of", "mixed_pixels", "light_bias_px", "interreflection_sigma_px", "believed",
    "_fuse", "fuse",
)  # fmt: skip
_PLANNING = ("plan_exposures_ms", "fill_columns", "epipolar_v", "intensities", "patterns")
Times = dict[str, list[tuple[float, float]]]


class Tape(PassThrough):
    """A scanner whose pictures are kept, and then given again in the same order."""

    def __init__(self, scanner: Scanner) -> None:
        super().__init__(scanner)
        self.images: list[Image] = []
        self._next = -1

    def rewind(self) -> None:
        """From now on give what was kept."""
        self._next = 0

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Take and keep, or give again."""
        if self._next < 0:
            self.images.append(self._scanner.capture(patterns, exposure_ms))
            return self.images[-1]
        self._next += 1
        return self.images[self._next - 1]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scene", default="paper")
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    document = scene_document(given.scene)
    document["rig"] = document.get("rig", {}) | {"scale": given.scale}
    tape = Tape(simulate(scene_from(document, source=given.scene)).scanner())
    first = adaptive.scan_adaptive(tape)
    surface(first.correspondence, tape.rig, radiance=first.radiance)  # compiles, and records
    times: Times = {}
    _clock_stages(times)
    for _ in range(given.rounds):
        tape.rewind()
        scan = _clocked(adaptive.scan_adaptive, "scan in all", times)(tape)
        _clocked(surface, "mesh", times)(scan.correspondence, tape.rig, radiance=scan.radiance)
        _clocked(_read_once, "reading all frames once", times)(tape.images)
    _say(times, given.rounds)


def _clock_stages(times: Times) -> None:
    """Put a clock around each stage in every module of the scan that calls it."""
    modules = [module for name, module in sys.modules.items() if name.startswith("burrscan.scan.")]
    for stage in _STAGES + _PLANNING:
        plain = {getattr(module, stage, None) for module in modules}
        clocked = {one: _clocked(one, stage, times) for one in plain if isinstance(one, FunctionType)}
        for module in modules:
            if getattr(module, stage, None) in clocked:
                setattr(module, stage, clocked[getattr(module, stage)])


def _read_once(images: list[Image]) -> int:
    return sum(int(stack.max()) for stack in images)


def _clocked(work: Callable[..., Any], name: str, times: Times) -> Callable[..., Any]:
    """The same function, its wall and processor seconds written down."""

    def timed(*args: Any, **kwargs: Any) -> Any:
        wall, processor = time.perf_counter(), time.process_time()
        result = work(*args, **kwargs)
        spent = time.perf_counter() - wall, time.process_time() - processor
        times.setdefault(name, []).append(spent)
        return result

    return timed


def _say(times: Times, rounds: int) -> None:
    print(f"{'':26}{'wall':>9}{'processor':>11}   ms per scan")
    median = {
        name: 1e3 * np.median(np.array(spent).reshape(rounds, -1, 2).sum(axis=1), axis=0)
        for name, spent in times.items()
    }
    planning = sum((median[name] for name in _PLANNING if name in median), np.zeros(2))
    median["planning"] = planning
    median["images to mesh"] = median["scan in all"] + median["mesh"] - planning
    for name, (wall, processor) in median.items():
        print(f"{name:26}{wall:9.0f}{processor:11.0f}{'   planning' if name in _PLANNING else ''}")


if __name__ == "__main__":
    main()
