"""How often 95 % intervals of a mean over few scenes hold it: sign flips, Student's, percentile and BCa.

    python -m bench.experiments.ab_coverage [TRIALS]

Scenes are drawn from symmetric, skewed, heavy-tailed and two-humped distributions. A minute for 300.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable

import numpy as np
from scipy import stats

from bench.statistics.flips import mean_test
from burrscan.arrays import Floats

COUNTS = (8, 16, 24)
"""Scenes of small comparisons; eight is the fewest whose signs can be significant at 1 %."""
_DRAWS = 2000
"""Bootstrap resamples: an end of a 95 % interval is the fiftieth of them."""
Ends = tuple[float, float]


def main() -> None:
    """Print one line per distribution and number of scenes."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    methods: dict[str, Callable[[Floats], Ends]] = {
        "flips": _flips, "student": _student, "percentile": _percentile, "bca": _bca,
    }  # fmt: skip
    for name, (draw, mean) in _distributions().items():
        for count in COUNTS:
            random = np.random.default_rng(count)
            samples = [draw(random, count) for _ in range(trials)]
            held = {
                label: np.mean([low <= mean <= high for low, high in map(ends, samples)])
                for label, ends in methods.items()
            }
            text = "  ".join(f"{label} {share:.3f}" for label, share in held.items())
            print(f"{name:<12} {count:3d} scenes  {text}", flush=True)


def _distributions() -> dict[str, tuple[Callable[[np.random.Generator, int], Floats], float]]:
    return {
        "normal": (lambda random, count: random.standard_normal(count), 0.0),
        "t, 3 df": (lambda random, count: random.standard_t(3, count), 0.0),
        "exponential": (lambda random, count: random.exponential(size=count), 1.0),
        "log-normal": (lambda random, count: random.lognormal(size=count), math.exp(0.5)),
        "two humps": (_two_humps, 0.75),
    }


def _two_humps(random: np.random.Generator, count: int) -> Floats:
    """A quarter of the scenes hardly differs, the others do: a method that helps on shiny metal alone."""
    calm, helped = random.normal(0.0, 0.02, count), random.normal(1.0, 0.15, count)
    return np.where(random.random(count) < 0.25, calm, helped)


def _flips(scenes: Floats) -> Ends:
    return mean_test(scenes).interval(0.05)


def _student(scenes: Floats) -> Ends:
    half = float(stats.t.ppf(0.975, len(scenes) - 1)) * float(scenes.std(ddof=1)) / math.sqrt(len(scenes))
    return float(scenes.mean()) - half, float(scenes.mean()) + half


def _means(scenes: Floats) -> Floats:
    draws = np.random.default_rng(1).integers(0, len(scenes), (_DRAWS, len(scenes)))
    means: Floats = scenes[draws].mean(axis=1)
    return means


def _percentile(scenes: Floats) -> Ends:
    low, high = np.quantile(_means(scenes), [0.025, 0.975])
    return float(low), float(high)


def _bca(scenes: Floats) -> Ends:
    means = _means(scenes)
    bias = stats.norm.ppf(np.clip(np.mean(means < scenes.mean()), 1e-4, 1.0 - 1e-4))
    influence = scenes - scenes.mean()
    skew = float((influence**3).sum() / (6.0 * (influence**2).sum() ** 1.5))
    z = bias + stats.norm.ppf([0.025, 0.975])
    low, high = np.quantile(means, stats.norm.cdf(bias + z / (1.0 - skew * z)))
    return float(low), float(high)


if __name__ == "__main__":
    main()
