"""One row of a comparison: difference, interval and p-value of one metric; the verdict comes after Holm."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bench.compare.interval import scene_estimate
from bench.compare.margins import FAILURES
from bench.compare.mcnemar import mcnemar_exact, tango_interval
from bench.compare.pairs import Pairing
from bench.compare.result import Row, Seen, Verdict
from bench.compare.values import burr_outcomes, paired_values
from bench.run.records import Record
from bench.score.metrics import metric_named
from burrscan.arrays import Bools, Floats

_FEWEST_SCENES = 6
FOUND = "burr_found"
"""The metric that is a yes or no per burr."""


def metric_row(pairing: Pairing, name: str, *, margin: float, gated: bool) -> Row:
    """A metric's paired difference: cases averaged in each scene, scenes resampled."""
    metric = metric_named(name)
    base, new = paired_values(pairing, name, margin=margin)
    estimate = scene_estimate(pairing.per_scene(new - base))
    pairs = int((~np.isnan(base)).sum())
    every = _every(pairing, new - base, margin=margin, higher=metric.better == "higher")
    return Row(
        metric=name,
        title=metric.title,
        unit=metric.unit,
        better=metric.better,
        gated=gated,
        margin=margin,
        base=_mean(pairing.per_scene(base)),
        new=_mean(pairing.per_scene(new)),
        difference=estimate.value,
        low=estimate.low,
        high=estimate.high,
        p=estimate.p,
        p_holm=estimate.p,
        effect=estimate.effect,
        pairs=pairs,
        cases=len(pairing.base),
        scenes=estimate.scenes,
        verdict="inconclusive",
        every=every,
        note=_note(pairs, len(pairing.base), estimate.scenes) if not every else _told(pairs),
    )


def burr_row(pairing: Pairing, name: str, *, margin: float, gated: bool) -> Row:
    """Found or missed, burr by burr: McNemar's exact test.

    The interval is the wider of Tango's, which knows what few burrs cannot tell, and that of resampled
    scenes, which knows that burrs of one scene go together. Two arms whose records are the same in every
    metric do not differ, and have no interval.
    """
    row = metric_row(pairing, name, margin=margin, gated=gated)
    base, new = burr_outcomes(pairing)
    if not len(base):
        return row
    lost, gained = int((base & ~new).sum()), int((~base & new).sum())
    p = mcnemar_exact(lost, gained)
    difference = (gained - lost) / len(base)
    low, high = (0.0, 0.0) if _identical(pairing) else tango_interval(lost, gained, len(base))
    if lost + gained and row.scenes > 1:
        low, high = min(low, row.low), max(high, row.high)
    return Row(
        **{
            **vars(row),
            "base": float(base.mean()),
            "new": float(new.mean()),
            "difference": difference,
            "low": max(low, -1.0),
            "high": min(high, 1.0),
            "p": p,
            "p_holm": p,
            "note": f"{lost} lost, {gained} gained of {len(base)} burrs",
        }
    )


def failure_row(pairing: Pairing, *, margin: float, gated: bool) -> Row:
    """Cases without a result.

    With the same scene and the same noise a new failure is a fact, not a sample: more new failures than the
    margin are worse. With other noise it may be chance, and McNemar's exact test on cases decides.
    """
    base, new = (_failures(arm) for arm in (pairing.base, pairing.new))
    broken, fixed = int((new & ~base).sum()), int((base & ~new).sum())
    p = math.nan if pairing.same_noise else mcnemar_exact(fixed, broken)
    low, high = _failure_interval(pairing, broken, fixed)
    return Row(
        metric=FAILURES,
        title="Failures",
        unit="count",
        better="lower",
        gated=gated,
        margin=margin,
        base=float(base.sum()),
        new=float(new.sum()),
        difference=float(broken - fixed),
        low=low,
        high=high,
        p=p,
        p_holm=p,
        effect=math.nan,
        pairs=len(base),
        cases=len(base),
        scenes=pairing.scenes,
        verdict=_failure_verdict(broken, fixed, margin),
        note=f"{broken} newly failed, {fixed} newly fixed" if broken or fixed else "",
    )


def refused_row(name: str, why: str, *, margin: float, gated: bool) -> Row:
    """A metric that cannot be compared."""
    metric = metric_named(name)
    return Row(
        metric=name,
        title=metric.title,
        unit=metric.unit,
        better=metric.better,
        gated=gated,
        margin=margin,
        base=math.nan,
        new=math.nan,
        difference=math.nan,
        low=math.nan,
        high=math.nan,
        p=math.nan,
        p_holm=math.nan,
        effect=math.nan,
        pairs=0,
        cases=0,
        scenes=0,
        verdict="not comparable",
        note=why,
    )


def _failure_verdict(broken: int, fixed: int, margin: float) -> Verdict:
    if broken > margin:
        return "worse"
    return "better" if fixed > margin else "equivalent"


def _failure_interval(pairing: Pairing, broken: int, fixed: int) -> tuple[float, float]:
    """In cases; a fact has no width."""
    if pairing.same_noise or not pairing.base:
        return float(broken - fixed), float(broken - fixed)
    low, high = tango_interval(fixed, broken, len(pairing.base))
    return low * len(pairing.base), high * len(pairing.base)


def _failures(records: Sequence[Record]) -> Bools:
    return np.array([record.failure is not None for record in records], dtype=bool)


def _every(pairing: Pairing, differences: Floats, *, margin: float, higher: bool) -> Seen:
    """Which way all pairs go by more than the margin, where there are too few scenes for a test.

    With five scenes no test of ten metrics at 0.05 has any power worth the name. With the same scene and the
    same noise each difference is a fact about its case; one that all cases share is a fact about the suite,
    whatever may hold for other scenes.
    """
    known = differences[~np.isnan(differences)]
    if not (pairing.same_noise and 0 < pairing.scenes < _FEWEST_SCENES and len(known)):
        return ""
    if (known > margin).all():
        return "better" if higher else "worse"
    if (known < -margin).all():
        return "worse" if higher else "better"
    return ""


def _told(pairs: int) -> str:
    return f"beyond the margin in every one of {pairs} case(s); too few scenes to say more"


def _identical(pairing: Pairing) -> bool:
    """Whether every case gave the same numbers in both arms."""
    return all(
        (a.failure is None) == (b.failure is None)
        and {k: v for k, v in a.metrics.items() if v == v} == {k: v for k, v in b.metrics.items() if v == v}  # noqa: PLR0124
        for a, b in zip(pairing.base, pairing.new, strict=True)
    )


def _mean(values: np.ndarray) -> float:
    return float(values.mean()) if len(values) else math.nan


def _note(pairs: int, cases: int, scenes: int) -> str:
    if not pairs:
        return "no case has a value in both arms"
    if scenes < 2:
        return "one case says nothing of others"
    return f"{pairs} of {cases} cases have it in both arms" if pairs < cases else ""
