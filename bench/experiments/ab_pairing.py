"""How many scenes pairing saves: scenes needed for a power of 0.8, paired and unpaired.

    python -m bench.experiments.ab_pairing
    python -m bench.experiments.ab_pairing RUN BASE NEW

The first form draws arms whose looks differ: for each metric the difference is set to what some ten paired
scenes of two seeds catch in 8 of 10 trials at a level of 0.05. Paired, both arms see the same scenes;
unpaired, each arm sees scenes of its own (Welch's test). Spreads are those of real records
(:mod:`bench.experiments.synthetic`). Half a minute.

The second takes two variants of a real run, which share the noise as well, as two runs of one seed do. Scenes
needed for any power go with the variance of what is averaged, so pairing needs
``(var(base) + var(new)) / var(new - base)`` times fewer; its interval is from resampled scenes.
``burrscan run bench/experiments/pairing.toml`` makes a run for it.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy import stats

from bench.compare.margins import margin_of
from bench.compare.pairs import arm_of, pair
from bench.compare.values import paired_values
from bench.experiments.synthetic import FOUND, NAMES, spreads, unscaled
from bench.run.directory import load_run
from burrscan.arrays import Floats

_TRIALS = 1000
_SEEDS = 2
_POWER = 0.8
_PAIRED = 10
_MOST = 20_000


def main() -> None:
    """Print the table."""
    if len(sys.argv) > 1:
        _print_real(Path(sys.argv[1]), *sys.argv[2:4])
        return
    for name in NAMES:
        if name != FOUND:
            difference, paired, unpaired = scenes_needed(name)
            text = f"{name:<18} {difference:10.4g} {paired:5d} {unpaired:6d} {unpaired / paired:7.1f}"
            print(text)


def _print_real(path: Path, base: str, new: str) -> None:
    run = load_run(path)
    pairing = pair(*(arm_of(run, variant, variant) for variant in (base, new)))
    for name in NAMES:
        arms = [pairing.per_scene(v) for v in paired_values(pairing, name, margin=margin_of(name))]
        if len(arms[0]) > 2:
            gain, low, high = real_gain(*arms)
            print(f"{name:<18} {len(arms[0]):5d} scenes {gain:10.1f} ({low:.1f} to {high:.1f})")


def real_gain(base: Floats, new: Floats) -> tuple[float, float, float]:
    """How many times fewer scenes pairing needs, with its 95 % interval from resampled scenes.

    Infinite where the arms do not differ.

    Parameters
    ----------
    base, new
        (G,) one value per scene in each arm.

    """
    draws = np.random.default_rng(3).integers(0, len(base), (2000, len(base)))
    with np.errstate(divide="ignore", invalid="ignore"):
        gains = _gain(base[draws], new[draws])
        low, high = np.nanquantile(gains, [0.025, 0.975], method="nearest")
        return float(_gain(base, new)), float(low), float(high)


def _gain(base: Floats, new: Floats) -> Floats:
    apart = base.var(axis=-1, ddof=1) + new.var(axis=-1, ddof=1)
    gain: Floats = np.asarray(apart / (new - base).var(axis=-1, ddof=1))
    return gain


def scenes_needed(name: str) -> tuple[float, int, int]:
    """The difference planted, and the scenes that paired and unpaired comparison need to see it."""
    random = np.random.default_rng(1)
    base, new = _arms(name, random, 4000)
    difference = float(np.std(new - base)) * (stats.norm.ppf(0.975) + stats.norm.ppf(_POWER)) / _PAIRED**0.5
    return difference, _needed(name, difference, _paired), _needed(name, difference, _unpaired)


def _arms(name: str, random: np.random.Generator, scenes: int) -> Floats:
    """Scene means (2, scenes) of two arms that share their scenes."""
    means: Floats = unscaled(name, spreads()[name].draw(random, scenes, _SEEDS)).mean(axis=2)
    return means


def _paired(name: str, difference: float, random: np.random.Generator, scenes: int) -> float:
    base, new = _arms(name, random, scenes)
    return float(stats.ttest_rel(new + difference, base).pvalue)


def _unpaired(name: str, difference: float, random: np.random.Generator, scenes: int) -> float:
    base, new = _arms(name, random, scenes)[0], _arms(name, random, scenes)[1]
    return float(stats.ttest_ind(new + difference, base, equal_var=False).pvalue)


def _needed(name: str, difference: float, test: Callable[..., float]) -> int:
    """Fewest scenes with that power: doubled until there is enough, then halved in between."""
    low, high = 3, 6
    while _power(name, difference, test, high) < _POWER and high < _MOST:
        low, high = high, 2 * high
    while high - low > max(1, high // 20):
        middle = (low + high) // 2
        low, high = (low, middle) if _power(name, difference, test, middle) >= _POWER else (middle, high)
    return high


def _power(name: str, difference: float, test: Callable[..., float], scenes: int) -> float:
    trials = max(200, min(_TRIALS, 400_000 // scenes))
    random = np.random.default_rng((7, scenes))
    return float(np.mean([test(name, difference, random, scenes) <= 0.05 for _ in range(trials)]))


if __name__ == "__main__":
    main()
