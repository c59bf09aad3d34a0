"""How many times fewer scenes pairing needs: the variance of unpaired differences over that of paired ones.

    python -m bench.experiments.ab_pairing
    python -m bench.experiments.ab_pairing RUN BASE NEW

Scenes needed for any power go with the variance of what is averaged, so pairing needs
``(var(base) + var(new)) / var(new - base)`` times fewer; the interval is from resampled scenes. The first
form takes two real looks of one algorithm at each scene of ``repeats.csv``, with other noise each. The second
takes two variants of a real run, which share the noise as well, as two runs of one seed do;
``burrscan run bench/experiments/pairing.toml`` makes a run for it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

from bench.compare.margins import margin_of
from bench.compare.pairs import arm_of, pair
from bench.compare.values import paired_values
from bench.experiments.synthetic import NAMES, real_looks
from bench.run.directory import load_run
from burrscan.arrays import Floats


def main() -> None:
    """Print the table."""
    if len(sys.argv) > 1:
        _print_real(Path(sys.argv[1]), *sys.argv[2:4])
        return
    for name in NAMES:
        looks = np.array([[look.metrics[name] for look in scene[:2]] for scene in real_looks()])
        _print(name, looks[:, 0], looks[:, 1])


def _print(name: str, base: Floats, new: Floats) -> None:
    if np.ptp(np.concatenate([base, new])) == 0.0:
        print(f"{name:<18} {len(base):5d} scenes   all alike")
        return
    gain, low, high = real_gain(base, new)
    print(f"{name:<18} {len(base):5d} scenes {gain:10.1f} ({low:.1f} to {high:.1f})")


def _print_real(path: Path, base: str, new: str) -> None:
    run = load_run(path)
    pairing = pair(*(arm_of(run, variant, variant) for variant in (base, new)))
    for name in NAMES:
        arms = [pairing.per_scene(v) for v in paired_values(pairing, name, margin=margin_of(name))]
        if len(arms[0]) > 2:
            _print(name, *arms)


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


if __name__ == "__main__":
    main()
