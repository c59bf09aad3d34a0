"""Numbers and verdicts as people read them, the same in the terminal, in Markdown and in JUnit."""

from __future__ import annotations

import math
from collections.abc import Iterable

from bench.compare.result import ArmComparison, Row, Verdict, by_case

SIGNS: dict[Verdict, str] = {
    "worse": "✗",
    "better": "✓",
    "equivalent": "=",
    "inconclusive": "?",
    "not comparable": "!",
}
HEADS = (
    "metric", "baseline", "new", "difference", "interval", "margin", "probability", "these cases", "verdict",
)  # fmt: skip
"""Of the table's columns; *probability* is the p-value, corrected by Holm."""


def cells(row: Row) -> tuple[str, ...]:
    """A row as text, one cell per head in :data:`HEADS`."""
    unit = {"1": " %", "count": ""}.get(row.unit, f" {row.unit}")
    kind = "" if row.metric == "failures" else f", {row.typical}"
    points = " points" if row.unit == "1" and not math.isnan(row.difference) else ""
    return (
        f"{row.title}{kind}{unit}{'' if row.gated else ' ·'}",
        number(row.base, row.unit),
        number(row.new, row.unit),
        f"{number(row.difference, row.unit, sign=True)}{points}",
        _interval(row),
        f"±{number(row.margin, row.unit)}{points}",
        p_value(row.p_holm),
        here(row),
        f"{SIGNS[row.verdict]} {row.verdict}{f' ({words})' if (words := aside(row)) else ''}",
    )


def here(row: Row) -> str:
    """How many of these cases went which way by more than the margin."""
    if not row.pairs:
        return "–"
    counts = ((row.worse_cases, "worse"), (row.better_cases, "better"))
    told = ", ".join(f"{count} {word}" for count, word in counts if count)
    return f"{told} of {row.pairs}" if told else f"none of {row.pairs}"


def _interval(row: Row) -> str:
    if not (math.isfinite(row.low) and math.isfinite(row.high)):
        return "–" if math.isnan(row.low) else "too few scenes"
    if row.low == row.high:
        return number(row.low, row.unit, sign=True)
    ends = (number(end, row.unit, sign=True) for end in (row.low, row.high))
    return f"{' to '.join(ends)} ({100 * row.level:.3g} %)"


def aside(row: Row) -> str:
    """What is certain though it does not matter, and what is a fact though no test can say it."""
    if row.by_every_case:
        return f"{row.every} in every case"
    return f"a little {row.seen}" if row.verdict == "equivalent" and row.seen else ""


def number(value: float, unit: str, *, sign: bool = False) -> str:
    """A value in its unit, shares in per cent."""
    if math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "-∞"
    shown = 100.0 * value if unit == "1" else value
    digits = {"1": 2, "count": 2}.get(unit, 4)
    text = f"{shown:{'+' if sign else ''}.{digits}f}"
    return text.rstrip("0").rstrip(".") if unit == "count" else text


def p_value(p: float) -> str:
    """A p-value, never written as zero."""
    if math.isnan(p):
        return "–"
    return "<0.001" if p < 0.001 else f"{p:.3f}"


def remarks(arm: ArmComparison) -> list[str]:
    """What is to be said beside the table: burrs, failures, cases left out."""
    burrs = arm.burrs
    counts = f"{burrs.both} found by both, {len(burrs.lost)} lost, {len(burrs.gained)} gained"
    lines = [f"burrs: {counts}, {burrs.neither} missed by both"]
    lines += [f"lost: {case}: {names}" for case, names in by_case(burrs.lost).items()]
    lines += [f"gained: {case}: {names}" for case, names in by_case(burrs.gained).items()]
    for title, failed in (
        ("newly failed", arm.newly_failed),
        ("newly fixed", arm.newly_fixed),
        ("failing in both", arm.still_failing),
    ):
        lines += [f"{title}: {case.case}: {case.error}" for case in failed]
    for title, cases in (
        ("not comparable, the scene is another one", arm.changed),
        ("not comparable, only in the baseline", arm.only_base),
        ("only in the new run", arm.only_new),
    ):
        lines += [f"{title}: {case}" for case in cases]
    if not arm.same_noise:
        lines.append("the arms saw different noise: pairs differ by chance as well")
    return lines + notes(arm.rows)


def notes(rows: Iterable[Row]) -> list[str]:
    """What is to be known of rows, those with the same note together."""
    titles: dict[str, list[str]] = {}
    for row in rows:
        if row.note:
            titles.setdefault(row.note, []).append(row.title)
    return [f"{', '.join(names)}: {note}" for note, names in titles.items()]
