"""Local minima of an error over all orientations: found on a grid, and followed to their bottoms."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.reproduction.orientation import direction_of
from burrscan.arrays import Bools, Floats, Ints

BASIN_DEG = 12.0
"""A local minimum is lower than everything within this angle."""
DEEPENED = 10
"""The best minima of the grid are followed to their bottoms."""
LEAST_DEG = 0.1
"""Step at which the bottom of a basin is reached."""
MERGED_DEG = 4.0
"""Bottoms nearer than this are of one basin, which was followed from two places of the grid."""
Objective = Callable[[Floats], float]
_SIDES = np.array([(a, b) for a in (-1.0, 0.0, 1.0) for b in (-1.0, 0.0, 1.0) if a or b])
"""The eight neighbours of an orientation in (θ, φ)."""


@dataclass(frozen=True)
class Minima:
    """The local minima of a landscape, best first."""

    index: Ints
    values: Floats


def grid_of(steps: int) -> Floats:
    """(steps², 2) all (θ, φ) from 0 to π, φ fastest."""
    angle = np.linspace(0.0, np.pi, steps)
    return np.stack(np.meshgrid(angle, angle, indexing="ij"), axis=-1).reshape(-1, 2)


def minima_of(values: Floats, grid: Floats) -> Minima:
    """Orientations lower than all others within an angle; opposite senses are one, as are the poles."""
    directions = np.array([direction_of(angles) for angles in grid])
    near = np.abs(directions @ directions.T) >= np.cos(np.radians(BASIN_DEG))
    finite = np.where(np.isfinite(values), values, np.inf)
    lowest: Bools = np.array([finite[k] <= finite[near[k]].min() for k in range(len(grid))])
    lowest &= np.isfinite(finite)
    kept: list[int] = []
    for k in np.flatnonzero(lowest)[np.argsort(finite[lowest], kind="stable")]:
        if not any(near[k, other] for other in kept):
            kept.append(int(k))
    return Minima(np.array(kept, np.int64), finite[kept])


def settled(objective: Objective, angles: Floats, *, step_deg: float) -> Floats:
    """The bottom of a basin: the best of eight neighbours, the step halved where none is better."""
    best, value = angles, objective(angles)
    step = np.radians(step_deg)
    while step > np.radians(LEAST_DEG):
        trials = [best + step * side for side in _SIDES]
        reached = [objective(trial) for trial in trials]
        k = int(np.argmin(reached))
        if reached[k] < value:
            best, value = trials[k], reached[k]
        else:
            step /= 2.0
    return np.append(best, value)


def bottoms(objective: Objective, minima: Minima, grid: Floats, *, step_deg: float) -> Floats:
    """(K, 3) θ, φ and value at the bottom of the best basins, best first, each basin once."""
    found = [settled(objective, grid[k], step_deg=step_deg) for k in minima.index[:DEEPENED]]
    found.sort(key=lambda row: float(row[2]))
    kept: list[Floats] = []
    for row in found:
        near = [abs(direction_of(row[:2]) @ direction_of(other[:2])) for other in kept]
        if all(cosine < np.cos(np.radians(MERGED_DEG)) for cosine in near):
            kept.append(row)
    return np.array(kept)
