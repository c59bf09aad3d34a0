"""How often a comparison is wrong, and how often it is right: A/A runs and planted regressions.

    python -m bench.experiments.ab_error_rates [COMPARISONS]

Each comparison draws two made-up runs that vary like real ones (:mod:`bench.experiments.synthetic`), compares
them, and then again with one metric of the new run made worse by 1, 0.5 and 0.25 of its margin. A minute or
two per 100 comparisons.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bench.compare import Row, compare_runs
from bench.compare.margins import MARGINS
from bench.compare.pairs import arm_of, pair
from bench.compare.rows import FOUND, burr_row, metric_row
from bench.compare.verdict import judged
from bench.experiments.synthetic import NAMES, alike, planted
from bench.run.directory import Run

SIZES = (1.0, 0.5, 0.25)
SUITES = ((8, 2), (40, 3), (120, 3))
"""Scenes and seeds: like ``quick``, like ``standard``, three times as many."""


@dataclass(frozen=True)
class Rates:
    """Counts over comparisons.

    Parameters
    ----------
    false_verdicts, false_seen
        A/A comparisons in which any gated metric is called worse or better; is seen to be.
    caught
        For each metric and size: verdicts on that metric, and how often it was ``"seen"`` to be worse.

    """

    false_verdicts: int
    false_seen: int
    caught: Mapping[tuple[str, float], Counter[str]]


def main() -> None:
    """Print rates for suites of several sizes."""
    comparisons = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    for scenes, seeds in SUITES:
        rates = error_rates(comparisons, scenes=scenes, seeds=seeds)
        print(f"{scenes} scenes x {seeds} seeds, {comparisons} A/A comparisons:", end=" ")
        print(f"{rates.false_verdicts} with a false verdict, {rates.false_seen} seen falsely")
        print("seen to be worse / gate broken, at", *SIZES, "of the margin")
        for name in NAMES:
            told = (_told(rates.caught[name, size], comparisons) for size in SIZES)
            print(f"  {name:<18}", "   ".join(told), flush=True)


def _told(counts: Counter[str], comparisons: int) -> str:
    return f"{counts['seen'] / comparisons:.2f} / {counts['worse'] / comparisons:.2f}"


def error_rates(
    comparisons: int, *, scenes: int, seeds: int, sizes: Sequence[float] = SIZES, names: Iterable[str] = NAMES
) -> Rates:
    """Count false verdicts on runs that are alike, and verdicts on planted regressions."""
    false = Counter[str]()
    caught = {(name, size): Counter[str]() for name in names for size in sizes}
    for number in range(comparisons):
        random = np.random.default_rng((number, scenes, seeds))
        base, new = alike(random, scenes=scenes, seeds=seeds)
        rows = [row for row in compare_runs(base, new).arms[0].rows if row.gated]
        false["verdict"] += any(row.verdict in {"worse", "better"} for row in rows)
        false["seen"] += any(row.seen for row in rows)
        for (name, size), counts in caught.items():
            row = _judged(base, planted(new, name, size * MARGINS[name], random), name, rows)
            counts.update([row.verdict, *(["seen"] if row.seen == "worse" else [])])
    return Rates(false["verdict"], false["seen"], caught)


def _judged(base: Run, new: Run, name: str, rows: Sequence[Row]) -> Row:
    """The row of one metric that was made worse, judged among the others as they were."""
    pairing = pair(*(arm_of(run, "algorithm", "") for run in (base, new)))
    make = burr_row if name == FOUND else metric_row
    row = make(pairing, name, margin=MARGINS[name], gated=True)
    others = [row if old.metric == name else old for old in rows]
    return next(r for r in judged(others) if r.metric == name)


if __name__ == "__main__":
    main()
