"""How often a comparison is wrong, and how small a regression it sees: the power table.

    python -m bench.experiments.ab_error_rates [COMPARISONS [SCENES]]

A/A: two looks of the same algorithm at the same scenes; any gated metric called worse or better is a false
verdict. Power: the same with something planted in one arm; *seen* means that a gate broke on that metric.
Records are drawn from real ones (:mod:`bench.experiments.synthetic`). Five minutes for 200 comparisons.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from bench.compare import Comparison, compare_runs
from bench.compare.margins import MARGINS
from bench.experiments.synthetic import CALLS, FOUND, NAMES, alike, blinded, planted
from bench.run.directory import Run

LOST = (1.0, 0.5, 0.25)
"""Shares of the burrs found that are taken out."""

SIZES = (1.0, 0.5)
"""Planted changes, in margins."""

_BY_LOT = (FOUND, CALLS)
"""What is planted by lot, so that it is worth a look without other noise as well: any other change is then
one number in every scene, and seen for certain."""

Plant = Callable[[Run, np.random.Generator], Run]


def main() -> None:
    """Print the table."""
    comparisons = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    scenes = int(sys.argv[2]) if len(sys.argv) > 2 else 28
    print(f"{scenes} scenes, {comparisons} comparisons each; other noise in the second arm, the same noise")
    for name, count in (
        ("A/A, any false verdict", false_verdicts),
        ("A/A, any 'a little' as well", false_seen),
    ):
        false = [count(comparisons, scenes=scenes, same_noise=same) for same in (False, True)]
        print(f"{name:<34}", *(f"{number / comparisons:7.3f}" for number in false), flush=True)
    for name, metric, plant in plants():
        shares = [
            seen(comparisons, metric, plant, scenes=scenes, same_noise=same) / comparisons
            for same in ((False, True) if metric in _BY_LOT else (False,))
        ]
        print(f"{name:<34}", *(f"{share:7.3f}" for share in shares), flush=True)


def plants() -> Iterator[tuple[str, str, Plant]]:
    """What is planted, and in which metric it must be seen."""
    for share in LOST:
        yield f"{100 * share:g} % of the burrs lost", FOUND, _blinding(share)
    for name in NAMES:
        for size in SIZES:
            yield f"{name}, {size:g} margins", name, _planting(name, size * MARGINS[name])


def _blinding(share: float) -> Plant:
    return lambda run, random: replace(
        run, records=tuple(blinded(record, share, random) for record in run.records)
    )


def _planting(name: str, amount: float) -> Plant:
    return lambda run, random: planted(run, name, amount, random)


def false_verdicts(comparisons: int, *, scenes: int, same_noise: bool = False) -> int:
    """A/A comparisons in which any gated metric is called worse or better, or any gate broke."""
    told = _alike(comparisons, scenes=scenes, same_noise=same_noise)
    return sum(
        one.worse or any(row.verdict in {"worse", "better"} for row in one.arms[0].rows if row.gated)
        for one in told
    )


def false_seen(comparisons: int, *, scenes: int, same_noise: bool = False) -> int:
    """A/A comparisons in which the interval of any gated metric leaves out zero, within its margin or not."""
    told = _alike(comparisons, scenes=scenes, same_noise=same_noise)
    return sum(any(row.seen for row in one.arms[0].rows if row.gated) for one in told)


def _alike(comparisons: int, *, scenes: int, same_noise: bool) -> Iterator[Comparison]:
    for number in range(comparisons):
        random = np.random.default_rng((number, scenes))
        yield compare_runs(*alike(random, scenes=scenes, same_noise=same_noise))


def seen(comparisons: int, metric: str, plant: Plant, *, scenes: int, same_noise: bool = False) -> int:
    """Comparisons in which a gate broke on the metric that was made worse."""
    states = Counter[bool]()
    for number in range(comparisons):
        random = np.random.default_rng((number, scenes))
        base, new = alike(random, scenes=scenes, same_noise=same_noise)
        told = compare_runs(base, plant(new, random))
        states[any(gate.state == "broken" and gate.metric == metric for gate in told.gates)] += 1
    return states[True]


if __name__ == "__main__":
    main()
