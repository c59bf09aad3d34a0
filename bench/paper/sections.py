"""The sections of the page, in the paper's order: short name to module."""

from __future__ import annotations

import importlib
from types import ModuleType

from burrscan.errors import InputError
from burrscan.variants import suggest

MODULES: dict[str, str] = {
    "figure-1": "bench.paper.range_scan",
    "figure-2": "bench.paper.mirror_plane",
    "figure-3": "bench.paper.adaptation",
    "figure-4": "bench.paper.planes",
    "figure-5": "bench.paper.sampling",
    "figure-6": "bench.paper.axis_found",
    "ransac-table": "bench.paper.ransac_table",
    "cost": "bench.paper.cost",
    "simplification": "bench.paper.simplification",
    "choices": "bench.paper.choices",
    "figure-7": "bench.paper.burr_angle",
    "section-4": "bench.paper.burr_ransac",
    "section-5": "bench.paper.speed_accuracy",
    "figure-9": "bench.paper.wrong_minima",
    "figure-10": "bench.paper.landscape",
    "figure-11": "bench.paper.generatrix_band",
    "rivals": "bench.paper.rivals",
    "future-work": "bench.paper.multiview",
}
"""What ``burrscan paper --only`` takes, and who makes it; figures 7 and 8 are one section."""
NAMES = tuple(MODULES)


def module_of(name: str) -> ModuleType:
    """A section's module by its short name; it has ``measure(lab)`` and ``draw(numbers)``.

    Raises
    ------
    InputError
        When there is none of this name.

    """
    if name not in MODULES:
        raise InputError(f"the page has no section '{name}': {suggest(name, list(NAMES))}")
    return importlib.import_module(MODULES[name])
