"""The sections of the page, in the paper's order: short name to module."""

from __future__ import annotations

import importlib
from types import ModuleType

from burrscan.errors import InputError
from burrscan.variants import suggest

MODULES: dict[str, str] = {
    "figure-1": "bench.reproduction.range_scan",
    "figure-2": "bench.reproduction.mirror_plane",
    "figure-3": "bench.reproduction.adaptation",
    "photometry": "bench.reproduction.photometry",
    "interreflection": "bench.reproduction.interreflection",
    "single-frame": "bench.reproduction.single_frame",
    "figure-4": "bench.reproduction.planes",
    "figure-5": "bench.reproduction.sampling",
    "figure-6": "bench.reproduction.axis_found",
    "other-shapes": "bench.reproduction.other_shapes",
    "symmetry": "bench.reproduction.symmetry",
    "mean-corner": "bench.reproduction.mean_corner",
    "ransac-table": "bench.reproduction.ransac_table",
    "cost": "bench.reproduction.cost",
    "simplification": "bench.reproduction.simplification",
    "choices": "bench.reproduction.choices",
    "figure-7": "bench.reproduction.burr_angle",
    "section-4": "bench.reproduction.burr_ransac",
    "section-5": "bench.reproduction.speed_accuracy",
    "figure-9": "bench.reproduction.wrong_minima",
    "figure-10": "bench.reproduction.landscape",
    "outliers": "bench.reproduction.outliers",
    "figure-11": "bench.reproduction.generatrix_band",
    "rivals": "bench.reproduction.rivals",
    "future-work": "bench.reproduction.multiview",
    "servoing": "bench.reproduction.servoing",
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
