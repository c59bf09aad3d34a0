"""A metric's values in both arms, pair by pair, with failures counted."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bench.compare.pairs import Pairing
from bench.run.records import Record
from bench.score.metrics import metric_named
from burrscan.arrays import Bools, Floats


def paired_values(pairing: Pairing, name: str, *, margin: float) -> tuple[Floats, Floats]:
    """A metric in both arms, (N,) each, NaN in both where one of them has no value.

    A case without a result is worse than any value. For a share it counts as the metric says (coverage 0,
    wrong pixels 1). Errors and counts have no worst value, and an infinite one would make every mean
    infinite; there it counts as the worst value of all pairs in either arm, made worse by one margin. Cases
    that failed in both arms therefore do not differ.

    Parameters
    ----------
    pairing
        The pairs.
    name
        A metric's name.
    margin
        Its margin.

    """
    failed = [np.array([r.failure is not None for r in arm]) for arm in (pairing.base, pairing.new)]
    values = [_values(arm, name) for arm in (pairing.base, pairing.new)]
    worst = _failed_value(np.concatenate(values), name, margin)
    base, new = (np.where(f, worst, v) for f, v in zip(failed, values, strict=True))
    missing: Bools = np.isnan(base) | np.isnan(new)
    return np.where(missing, np.nan, base), np.where(missing, np.nan, new)


def _values(records: Sequence[Record], name: str) -> Floats:
    return np.array([math.nan if r.failure else r.metrics.get(name, math.nan) for r in records], dtype=float)


def _failed_value(values: Floats, name: str, margin: float) -> float:
    """What a case without a result counts as."""
    metric = metric_named(name)
    if metric.unit == "1" or math.isnan(metric.on_failure):
        return metric.on_failure
    known = values[np.isfinite(values)]
    if not known.size:  # nothing to be worse than
        return math.nan
    if metric.better == "higher":
        return float(known.min()) - margin
    return float(known.max()) + margin
