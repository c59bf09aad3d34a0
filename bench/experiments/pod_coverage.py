"""How often detection curves' intervals hold the truth, on burrs simulated from known curves.

    python -m bench.experiments.pod_coverage [TRIALS]

Five minutes for 400 trials; curves with an asymptote are tried on a tenth of that.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import expit, logit
from scipy.stats import norm

from bench.detection import PodCurve, fit_hit_miss, fit_signal
from burrscan.arrays import Floats

MIDDLE, WIDTH = math.log(0.5), 0.35
"""Of the true logistic curve, in log mm: half of 0.5 mm burrs are found."""
SLOPE, OFFSET, NOISE, THRESHOLD = 0.9, -0.1, 0.3, 0.4
"""Of the true signal response: logarithm of mm over that of mm, and the limit it is called at."""


def main() -> None:
    """Print coverages: two-sided a90, a90/95, and the band at three sizes."""
    trials = int(sys.argv[1]) if len(sys.argv) > 1 else 400
    random = np.random.default_rng(0)
    for burrs in (60, 120, 300):
        _say(
            f"hit/miss, {burrs} burrs", [_hit_miss(random, burrs, 0.0) for _ in range(trials)], _odds_pod(0.0)
        )
        _say(f"signal, {burrs} burrs", [_signal(random, burrs) for _ in range(trials)], _signal_pod)
    some = [_hit_miss(random, 200, 0.05) for _ in range(trials // 10)]
    _say("hit/miss with a ceiling of 0.95, 200 burrs", some, _odds_pod(0.05))


def _sizes(random: np.random.Generator, burrs: int) -> Floats:
    return np.exp(random.uniform(math.log(0.1), math.log(3.0), burrs))


def _hit_miss(random: np.random.Generator, burrs: int, hidden: float) -> PodCurve:
    size = _sizes(random, burrs)
    return fit_hit_miss(size, random.random(burrs) < _odds_pod(hidden)(size), ceiling=hidden > 0.0)


def _signal(random: np.random.Generator, burrs: int) -> PodCurve:
    size = _sizes(random, burrs)
    log = SLOPE * np.log(size) + OFFSET + NOISE * random.standard_normal(burrs)
    return fit_signal(size, np.where(log >= math.log(THRESHOLD), np.exp(log), np.nan), threshold=THRESHOLD)


def _odds_pod(hidden: float) -> Callable[[Floats], Floats]:
    return lambda size: np.asarray((1.0 - hidden) * expit((np.log(size) - MIDDLE) / WIDTH), np.float64)


def _signal_pod(size: Floats) -> Floats:
    return np.asarray(norm.cdf((SLOPE * np.log(size) + OFFSET - math.log(THRESHOLD)) / NOISE), np.float64)


def _a90(pod: Callable[[Floats], Floats]) -> float:
    sizes = np.exp(np.linspace(math.log(0.1), math.log(3.0), 20001))
    return float(np.exp(np.interp(logit(0.9), logit(pod(sizes)), np.log(sizes))))


def _say(name: str, fits: Sequence[PodCurve], pod: Callable[[Floats], Floats]) -> None:
    truth = _a90(pod)
    two = np.mean([fit.a90_interval[0] <= truth <= fit.a90_interval[1] for fit in fits])
    one = np.mean([fit.a90_95 >= truth for fit in fits])
    band = np.mean([((f.low <= pod(f.size)) & (pod(f.size) <= f.high))[[20, 40, 60]] for f in fits], axis=0)
    shares = " ".join(f"{share:.3f}" for share in band)
    print(f"{name:<44} a90 {two:.3f}  a90/95 {one:.3f}  band {shares}", flush=True)


if __name__ == "__main__":
    main()
