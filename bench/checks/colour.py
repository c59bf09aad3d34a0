"""Grey against colour: the same copper wheel by one channel, and by three with crosstalk.

Usage: ``python -m bench.checks.colour [SCALE]``; the table of ``burrscan/colour/README.md`` is SCALE 0.4.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

from burrscan.colour.scan import scan_colour
from burrscan.correspondence import Scan
from burrscan.robust import SIGMA_PER_MEDIAN
from burrscan.scan.adaptive import scan_adaptive
from burrscan.scan.rivals.fixed import scan_fixed
from scenes.scene import scene_document, scene_from
from scenes.simulate import Simulation, simulate
from scenes.transport.store import default_folder
from scenes.truth import Truth

_CAMERA = [[1.0, 0.12, 0.03], [0.10, 1.0, 0.08], [0.02, 0.15, 1.0]]
"""Crosstalk of usual size and no symmetry."""
_PROJECTOR = [[1.0, 0.08, 0.01], [0.06, 1.0, 0.07], [0.01, 0.05, 1.0]]
"""The same of the projector, and other numbers."""
_GREY: dict[str, tuple[Callable[..., Scan], dict[str, Any]]] = {
    "grey, adaptive": (scan_adaptive, {}),
    "grey, adaptive, 42 frames": (scan_adaptive, {"frames": 42}),
    "grey, fixed": (scan_fixed, {}),
}
"""Scans by one channel, which know no crosstalk."""
_COLOUR: dict[str, tuple[Callable[..., Scan], dict[str, Any]]] = {
    "colour, adaptive": (scan_colour, {}),
    "colour, adaptive, 150 frames": (scan_colour, {"parameters": {"frames": 150}}),
    "colour, adaptive, by the sheets": (scan_colour, {"unmix": "sheets"}),
    "colour, adaptive, left mixed": (scan_colour, {"unmix": "none"}),
    "colour, fixed": (scan_colour, {"method": "fixed"}),
    "colour, fixed, left mixed": (scan_colour, {"method": "fixed", "unmix": "none"}),
}


def main(scale: float) -> None:
    """Print the table."""
    print("| scan | pictures | coverage | wrong | u RMS px | pull |\n| --- | --- | --- | --- | --- | --- |")
    mixed = {"camera": {"crosstalk": _CAMERA}, "projector": {"crosstalk": _PROJECTOR}}
    for tables, scans in (({}, _GREY), ({"channels": "rgb", **mixed}, _COLOUR)):
        simulation = _simulation(scale, tables)
        for name, (scan, parameters) in scans.items():
            print(_row(name, scan(simulation.scanner(), **parameters), simulation.truth), flush=True)


def _simulation(scale: float, tables: dict[str, Any]) -> Simulation:
    finish = {"name": "ground", "metal": "copper"}
    document = scene_document("paper") | {"finish": finish, "rig": {"scale": scale}} | tables
    return simulate(scene_from(document, source="colour"), cache_dir=default_folder())


def _row(name: str, scan: Scan, truth: Truth) -> str:
    found = scan.correspondence
    seen = found.mask & np.isfinite(truth.u_response_px)
    off = (found.u_px - truth.u_response_px)[seen]
    near = np.abs(off) <= 1.0
    pulls = (off / found.sigma_u_px[seen])[near]
    pull = SIGMA_PER_MEDIAN * np.median(np.abs(pulls - np.median(pulls)))
    coverage = (found.mask & truth.measurable).sum() / truth.measurable.sum()
    rms = np.sqrt(np.mean(off[near] ** 2))
    return f"| {name} | {scan.frames} | {coverage:.1%} | {1 - near.mean():.2%} | {rms:.3f} | {pull:.2f} |"


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 0.4)
