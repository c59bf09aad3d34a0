"""Comparing two runs, or two variants of one run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from bench.compare.cases import case_changes, failed_cases
from bench.compare.facts import found_or_missed
from bench.compare.gates import outcomes
from bench.compare.margins import FAILURES, gates_of, margin_of
from bench.compare.pairs import Arm, Pairing, arm_of, pair
from bench.compare.result import ArmComparison, Comparison, Row
from bench.compare.rows import failure_row, metric_row, refused_row
from bench.compare.verdict import Draft, judged
from bench.run.directory import Run
from bench.score.metrics import HEADLINE, METRICS, own_metrics
from bench.suites.suite import Gate
from burrscan.errors import InputError


def compare_runs(
    base: Run,
    new: Run,
    *,
    variants: tuple[str, str] | None = None,
    margins: Mapping[str, float] | None = None,
) -> Comparison:
    """Compare two runs; with the same run twice and ``variants``, two variants of one.

    Parameters
    ----------
    base, new
        The runs. Gates and metrics are those of the new run's suite.
    variants
        A variant of ``base`` and one of ``new``; without it, every variant that both have
        against itself.
    margins
        Metric to equivalence margin, over those of the suite.

    Raises
    ------
    burrscan.errors.InputError
        When there is nothing to compare: no variant or case in common.

    """
    overrides = dict(margins or {})
    gates = gates_of(new.suite, overrides)
    names = _metric_names(new, gates)
    widths = {
        name: margin_of(name, own=gates[name].margin if name in gates else None, override=overrides.get(name))
        for name in names
    }
    chosen = [variants] if variants else [(name, name) for name in _common_variants(base, new)]
    paired = [_Paired(*_arms(base, new, pair_of_names)) for pair_of_names in chosen]
    drafts = [[_draft(name, one, widths[name], gates.get(name)) for name in names] for one in paired]
    rows = iter(judged([draft for some in drafts for draft in some]))  # one family: all arms
    arms = tuple(
        _arm(one, tuple(next(rows) for _ in some), gates, widths)
        for one, some in zip(paired, drafts, strict=True)
    )
    return Comparison(*_labels(base, new, variants), arms, _provenance(base, new))


@dataclass(frozen=True)
class _Paired:
    """Two arms and their pairs."""

    base: Arm
    new: Arm

    @cached_property
    def pairing(self) -> Pairing:
        return pair(self.base, self.new)


def _metric_names(run: Run, gates: Mapping[str, Gate]) -> tuple[str, ...]:
    """Rows: failures, then gated metrics and those the suite shows, in the order of the metric table."""
    wanted = {*gates, *(run.suite.metrics or HEADLINE)}
    return (FAILURES, *(name for name in (*METRICS, *own_metrics(run.suite.metrics)) if name in wanted))


def _common_variants(base: Run, new: Run) -> list[str]:
    theirs = {variant.name for variant in new.suite.variant}
    common = [variant.name for variant in base.suite.variant if variant.name in theirs]
    if not common:
        raise InputError(
            f"{base.directory.path} and {new.directory.path} have no variant in common; "
            "name one of each: --variants A B"
        )
    return common


def _labels(base: Run, new: Run, variants: tuple[str, str] | None) -> tuple[str, str]:
    if variants and base.directory.path == new.directory.path:
        return variants
    return base.directory.path.name, new.directory.path.name


def _arms(base: Run, new: Run, names: tuple[str, str]) -> tuple[Arm, Arm]:
    one_run = base.directory.path == new.directory.path
    labels = names if one_run else (f"{names[0]} (baseline)", f"{names[1]} (new)")
    return arm_of(base, names[0], labels[0]), arm_of(new, names[1], labels[1])


def _draft(name: str, paired: _Paired, margin: float, gate: Gate | None) -> Draft:
    pairing, gated = paired.pairing, gate is not None
    tested = gate is not None and gate.infers
    if name == FAILURES:
        return failure_row(pairing, margin=margin, gated=gated, tested=tested)
    why = _not_comparable(name, paired.base, paired.new) or ("" if pairing.base else "every scene differs")
    if why:
        return refused_row(name, why, margin=margin, gated=gated)
    return metric_row(pairing, name, margin=margin, gated=gated, tested=tested)


def _arm(
    paired: _Paired, rows: tuple[Row, ...], gates: Mapping[str, Gate], widths: Mapping[str, float]
) -> ArmComparison:
    base, new, pairing = paired.base, paired.new, paired.pairing
    burrs = found_or_missed(pairing)
    return ArmComparison(
        base=base.label,
        new=new.label,
        base_variant=base.variant,
        new_variant=new.variant,
        rows=rows,
        gates=tuple(
            outcome
            for row in rows
            if row.metric in gates
            for outcome in outcomes(
                gates[row.metric], row, new=new, burrs=burrs, same_noise=pairing.same_noise
            )
        ),
        burrs=burrs,
        newly_failed=failed_cases(pairing, base_failed=False, new_failed=True),
        newly_fixed=failed_cases(pairing, base_failed=True, new_failed=False),
        still_failing=failed_cases(pairing, base_failed=True, new_failed=True),
        changed=pairing.changed,
        only_base=pairing.only_base,
        only_new=pairing.only_new,
        cases=case_changes(
            pairing, {name: margin for name, margin in widths.items() if name in gates and name != FAILURES}
        ),
        same_noise=pairing.same_noise,
    )


def _not_comparable(name: str, base: Arm, new: Arm) -> str:
    """Why two runs' numbers of a metric cannot be compared, or nothing."""
    ours, theirs = base.metrics.get(name), new.metrics.get(name)
    if ours is None or theirs is None:
        return "one run lacks it"
    for key in ("version", "unit", "better"):
        if ours[key] != theirs[key]:
            return f"{key} {ours[key]} against {theirs[key]}"
    return ""


def _provenance(base: Run, new: Run) -> dict[str, tuple[Any, Any]]:
    """What differs between the runs' last sittings, by dotted name; times, commands and places left out."""
    ours, theirs = (_facts(run) for run in (base, new))
    return {
        key: (ours.get(key), theirs.get(key))
        for key in sorted({*ours, *theirs})
        if ours.get(key) != theirs.get(key)
    }


def _facts(run: Run) -> dict[str, Any]:
    sitting = run.manifest["sessions"][-1] if run.manifest["sessions"] else {}
    facts = {"suite": run.manifest["suite_hash"][:12], "seed": run.seed}
    for name in ("renderer", "python"):
        facts[name] = sitting.get(name)
    for group in ("versions", "git", "machine"):
        facts |= {f"{group}.{key}": value for key, value in (sitting.get(group) or {}).items()}
    return facts
