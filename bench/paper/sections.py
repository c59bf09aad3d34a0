"""The sections of the page, in the paper's order: short name to module."""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass

from bench.paper.lab import Lab
from bench.paper.parts import Numbers, Section
from burrscan.errors import InputError
from burrscan.variants import suggest

MODULES: dict[str, str] = {
    "figure-4": "bench.paper.planes",
    "figure-5": "bench.paper.sampling",
    "figure-6": "bench.paper.axis_found",
    "ransac-table": "bench.paper.ransac_table",
    "figure-10": "bench.paper.landscape",
}
"""What ``burrscan paper --only`` takes, and who makes it."""
NAMES = tuple(MODULES)


@dataclass(frozen=True)
class Maker:
    """A section's two halves, and the source that a kept measurement belongs to."""

    name: str
    measure: Callable[[Lab], Numbers]
    draw: Callable[[Numbers], Section]
    source: str


def maker(name: str) -> Maker:
    """A section by its short name.

    Raises
    ------
    InputError
        When there is none of this name.

    """
    if name not in MODULES:
        raise InputError(f"the page has no section '{name}': {suggest(name, list(NAMES))}")
    module = importlib.import_module(MODULES[name])
    return Maker(name, module.measure, module.draw, str(module.__file__))
