"""The sections of the page, in the paper's order: short name to module."""

from __future__ import annotations

import importlib
from types import ModuleType

from burrscan.errors import InputError
from burrscan.variants import suggest

MODULES: dict[str, str] = {
    "figure-4": "bench.paper.planes",
    "figure-5": "bench.paper.sampling",
    "figure-6": "bench.paper.axis_found",
    "ransac-table": "bench.paper.ransac_table",
    "figure-7": "bench.paper.burr_angle",
    "section-4": "bench.paper.burr_ransac",
    "figure-9": "bench.paper.wrong_minima",
    "figure-10": "bench.paper.landscape",
}
"""What ``burrscan paper --only`` takes, and who makes it."""
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
