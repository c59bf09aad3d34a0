"""When a servo should stop: how many runs do, and how many of those are within the tolerance.

    python -m bench.experiments.servo_rule

One coordinate, normal errors: a look measures where the burr is, a move corrects it and scatters, four looks
at most, all joined by their variances (Kalman 1960). Printed for looks of several standard deviations and
each rule: the table of ``burrscan/cell/README.md``. A second.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ndtr

from burrscan.arrays import Bools, Floats

_TOLERANCE_MM = 0.05
"""The servo's default."""
_SCATTER_MM = 0.035
"""Of a move: 0.05 mm and 0.01 degrees by ISO 9283, at a lever of half a metre."""
_FIRST_MM = 2.0
"""How far the burr is from where it is expected."""
_LOOKS, _RUNS = 4, 20_000
"""The servo looks as often by default; shares are then known to a third of a percent."""
_KNOWN = 0.5
"""Share of the tolerance that the place must be known to, by the rule that is none of probability."""


def stopped(look_mm: float, sure: float | None, *, seed: int = 0) -> tuple[float, float]:
    """Shares of runs that stop, and of those that are within the tolerance; ``sure`` None: the old rule."""
    rng = np.random.default_rng(seed)
    off = rng.normal(0.0, _FIRST_MM, _RUNS)
    mean, variance = np.zeros(_RUNS), np.full(_RUNS, _FIRST_MM**2)
    done = np.zeros(_RUNS, bool)
    for look in range(_LOOKS):
        gain = variance / (variance + look_mm**2)
        mean = mean + gain * (off + rng.normal(0.0, look_mm, _RUNS) - mean)
        variance = variance * (1.0 - gain)
        done |= _agrees(mean, np.sqrt(variance), sure) & (look > 0)
        moved = np.where(done, 0.0, rng.normal(0.0, _SCATTER_MM, _RUNS) - mean)
        off, mean = off + moved, np.where(done, mean, 0.0)
        variance = np.where(done, variance, variance + _SCATTER_MM**2)
    within = np.abs(off[done]) <= _TOLERANCE_MM
    return float(done.mean()), float(within.mean()) if len(within) else np.nan


def _agrees(mean: Floats, sigma: Floats, sure: float | None) -> Bools:
    if sure is None:
        return np.asarray((np.abs(mean) <= _TOLERANCE_MM) & (sigma <= _KNOWN * _TOLERANCE_MM))
    inside = ndtr((_TOLERANCE_MM - mean) / sigma) - ndtr((-_TOLERANCE_MM - mean) / sigma)
    return np.asarray(inside >= sure)


def main() -> None:
    """Print the table."""
    looks_mm = (0.015, 0.025, 0.035, 0.045)
    print("a look knows the place to, mm: " + ", ".join(map(str, looks_mm)) + "; stop / within, %")
    for sure in (None, 0.95, 0.9, 0.8, 0.7, 0.6):
        name = "known to half of the tolerance" if sure is None else f"{sure:g} sure"
        cells = [f"{100 * a:.0f} / {100 * b:.0f}" for a, b in (stopped(look, sure) for look in looks_mm)]
        print(f"{name}: " + ", ".join(cells))


if __name__ == "__main__":
    main()
