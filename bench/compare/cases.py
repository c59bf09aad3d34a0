"""Which cases changed, and which failed."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from bench.compare.pairs import Pairing
from bench.compare.result import CaseChange, FailedCase
from bench.compare.values import paired_values
from bench.score.metrics import metric_named
from burrscan.arrays import Floats

_SMALLEST_MARGIN = 1e-9  # a margin of zero would make every change infinite


def case_changes(pairing: Pairing, margins: Mapping[str, float]) -> tuple[CaseChange, ...]:
    """Every pair's worst and best change over some metrics, in margins; the worst case first.

    Parameters
    ----------
    pairing
        The pairs.
    margins
        Metric to margin.

    """
    if not margins or not pairing.base:
        return ()
    names = list(margins)
    changes = np.stack([_for_the_worse(pairing, name, margins[name]) for name in names])
    listed = [_change(pairing, names, changes[:, index], index) for index in range(len(pairing.base))]
    return tuple(sorted(listed, key=lambda change: -change.worst))


def failed_cases(pairing: Pairing, *, base_failed: bool, new_failed: bool) -> tuple[FailedCase, ...]:
    """Cases that failed in the arms named, with the error of the new arm, or else of the base."""
    found = []
    for base, new in zip(pairing.base, pairing.new, strict=True):
        if (base.failure is not None) == base_failed and (new.failure is not None) == new_failed:
            why = new.failure or base.failure
            found.append(FailedCase(base.case, why.error.splitlines()[0] if why and why.error else ""))
    return tuple(found)


def _for_the_worse(pairing: Pairing, name: str, margin: float) -> Floats:
    """(N,) differences in margins, positive for the worse, 0 where there is no value."""
    base, new = paired_values(pairing, name, margin=margin)
    sign = 1.0 if metric_named(name).better == "lower" else -1.0
    return np.nan_to_num(sign * (new - base) / max(margin, _SMALLEST_MARGIN), nan=0.0)


def _change(pairing: Pairing, names: list[str], changes: Floats, index: int) -> CaseChange:
    base, new = pairing.base[index], pairing.new[index]
    worst, best = int(changes.argmax()), int(changes.argmin())
    newly_failed = new.failure is not None and base.failure is None
    return CaseChange(
        case=base.case,
        worst=math.inf if newly_failed else max(float(changes[worst]), 0.0),
        worst_metric="failures" if newly_failed else names[worst],
        best=max(-float(changes[best]), 0.0),
        best_metric=names[best],
    )
