"""One row of a comparison: one metric's paired differences and their test; the verdict comes after Holm."""

from __future__ import annotations

import math

import numpy as np

from bench.compare.facts import burrs_per_case, every, went
from bench.compare.gates import FOUND
from bench.compare.margins import FAILURES
from bench.compare.pairs import Pairing
from bench.compare.result import Row, Verdict
from bench.compare.values import paired_values
from bench.compare.verdict import Draft
from bench.score.metrics import metric_named
from bench.statistics.flips import FlipTest, mean_test, rank_test
from bench.summary.table import typical
from burrscan.arrays import Bools, Floats


def metric_row(pairing: Pairing, name: str, *, margin: float, gated: bool, tested: bool) -> Draft:
    """A metric's paired difference: cases averaged in each scene, signs of scenes flipped.

    Errors, where one case can carry the mean, are judged by ranks; shares and counts by their means.
    """
    metric = metric_named(name)
    base, new = _values(pairing, name, margin)
    scenes = pairing.per_scene(new - base)
    test = (rank_test if typical(name) == "median" else mean_test)(scenes)
    higher = metric.better == "higher"
    worse, better = went(new - base, margin=margin, higher=higher)
    pairs = int((~np.isnan(base)).sum())
    row = Row(
        metric=name,
        title=metric.title,
        unit=metric.unit,
        better=metric.better,
        typical=typical(name),
        gated=gated,
        tested=tested,
        margin=margin,
        base=_typical(name, pairing.per_scene(base)),
        new=_typical(name, pairing.per_scene(new)),
        difference=test.value,
        low=-math.inf,
        high=math.inf,
        mean_difference=float(np.mean(scenes)) if len(scenes) else math.nan,
        effect=_effect(scenes),
        drawn=test.drawn,
        pairs=pairs,
        cases=len(pairing.base),
        scenes=test.scenes,
        worse_cases=worse,
        better_cases=better,
        applies=_applies(pairing, name),
        every=every(pairing, new - base, margin=margin, higher=higher),
        note=_note(pairs, len(pairing.base), scenes, test, margin) or _unmoved(pairing, name, scenes),
    )
    return Draft(row, test)


def failure_row(pairing: Pairing, *, margin: float, gated: bool, tested: bool) -> Draft:
    """Cases without a result.

    With the same scene and the same noise a new failure is a fact, not a sample: more new failures than the
    margin are worse. With other noise it may be chance, and the sign-flip test over scenes decides.
    """
    base, new = (_failures(pairing, arm) for arm in ("base", "new"))
    broken, fixed = int((new & ~base).sum()), int((base & ~new).sum())
    scenes = pairing.per_scene(new.astype(float) - base)
    row = Row(
        metric=FAILURES,
        title="Failures",
        unit="count",
        better="lower",
        gated=gated,
        tested=tested,
        margin=margin,
        base=float(base.sum()),
        new=float(new.sum()),
        difference=float(broken - fixed),
        low=float(broken - fixed),
        high=float(broken - fixed),
        mean_difference=float(broken - fixed),
        pairs=len(base),
        cases=len(base),
        scenes=pairing.scenes,
        worse_cases=broken,
        better_cases=fixed,
        verdict=_failure_verdict(broken, fixed, margin),
        note=f"{broken} newly failed, {fixed} newly fixed" if broken or fixed else "",
    )
    if pairing.same_noise or not len(base):
        return Draft(row)
    return Draft(row, mean_test(scenes), scale=float(len(base)))


def refused_row(name: str, why: str, *, margin: float, gated: bool) -> Draft:
    """A metric that cannot be compared."""
    metric = metric_named(name)
    return Draft(
        Row(
            metric=name,
            title=metric.title,
            unit=metric.unit,
            better=metric.better,
            typical=typical(name),
            gated=gated,
            margin=margin,
            verdict="not comparable",
            note=why,
        )
    )


def _unmoved(pairing: Pairing, name: str, scenes: Floats) -> str:
    """What few burrs cannot tell: none of n leaves up to 3/n (Hanley and Lippman-Hand, JAMA 249, 1983)."""
    count = sum(len(record.burrs) for record in pairing.base)
    if name != FOUND or not count or np.any(scenes):
        return ""
    return f"none of {count} burrs changed sides; of other burrs up to {min(300.0 / count, 100.0):.2g} % may"


def _applies(pairing: Pairing, name: str) -> bool:
    records = (*pairing.base, *pairing.new)
    return any(record.failure or not math.isnan(record.metrics.get(name, math.nan)) for record in records)


def _values(pairing: Pairing, name: str, margin: float) -> tuple[Floats, Floats]:
    """In both arms; burrs are counted where the records tell of each."""
    if name == FOUND:
        base, new = burrs_per_case(pairing)
        if not np.isnan(base).all():
            return base, new
    return paired_values(pairing, name, margin=margin)


def _typical(name: str, scenes: Floats) -> float:
    if not len(scenes):
        return math.nan
    return float(np.median(scenes) if typical(name) == "median" else np.mean(scenes))


def _effect(scenes: Floats) -> float:
    spread = float(np.std(scenes, ddof=1)) if len(scenes) > 1 else 0.0
    return float(np.mean(scenes)) / spread if spread > 0.0 else math.nan


def _failure_verdict(broken: int, fixed: int, margin: float) -> Verdict:
    if broken > margin:
        return "worse"
    return "better" if fixed > margin else "equivalent"


def _failures(pairing: Pairing, arm: str) -> Bools:
    return np.array([record.failure is not None for record in getattr(pairing, arm)], dtype=bool)


def _note(pairs: int, cases: int, scenes: Floats, test: FlipTest, margin: float) -> str:
    if not pairs:
        return "no case has a value in both arms"
    if len(scenes) < 2:
        return "one case says nothing of others"
    told = [f"{pairs} of {cases} cases have it in both arms"] if pairs < cases else []
    if abs(float(np.mean(scenes)) - test.value) > max(margin, abs(test.value)):
        share = float(np.abs(scenes).max() / np.abs(scenes).sum())
        told.append(f"the mean differs by {np.mean(scenes):+.3g}; one scene makes {100 * share:.0f} % of it")
    return "; ".join(told)
