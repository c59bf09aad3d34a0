"""Numbers and verdicts as people read them, the same in the terminal, in Markdown and in JUnit."""

from __future__ import annotations

import math

from bench.compare.result import ArmComparison, Row, Verdict

SIGNS: dict[Verdict, str] = {
    "worse": "✗",
    "better": "✓",
    "equivalent": "=",
    "inconclusive": "?",
    "not comparable": "!",
}
HEADS = ("metric", "base", "new", "difference", "95 % interval", "margin", "p (Holm)", "effect", "verdict")


def cells(row: Row) -> tuple[str, ...]:
    """A row as text, one cell per head in :data:`HEADS`."""
    unit = {"1": " %", "count": ""}.get(row.unit, f" {row.unit}")
    star = "" if row.gated else " ·"
    return (
        f"{row.title}{unit}{star}",
        number(row.base, row.unit),
        number(row.new, row.unit),
        number(row.difference, row.unit, sign=True),
        f"{number(row.low, row.unit, sign=True)} … {number(row.high, row.unit, sign=True)}",
        f"±{number(row.margin, row.unit)}",
        p_value(row.p_holm),
        "–" if math.isnan(row.effect) else f"{row.effect:+.2f}",
        f"{SIGNS[row.verdict]} {row.verdict}{_aside(row)}",
    )


def _aside(row: Row) -> str:
    """What is certain though it does not matter."""
    return f" (a little {row.seen})" if row.verdict == "equivalent" and row.seen else ""


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
    """A p-value, never written as nought."""
    if math.isnan(p):
        return "–"
    return "<0.001" if p < 0.001 else f"{p:.3f}"


def remarks(arm: ArmComparison) -> list[str]:
    """What is to be said beside the table: burrs, failures, cases left out."""
    burrs = arm.burrs
    counts = f"{burrs.both} found by both, {burrs.lost} lost, {burrs.gained} gained, {burrs.neither} missed"
    lines = [f"burrs: {counts} by both; McNemar's exact p = {p_value(burrs.p)}"]
    for title, failed in (
        ("newly failed", arm.newly_failed),
        ("newly fixed", arm.newly_fixed),
        ("failing in both", arm.still_failing),
    ):
        lines += [f"{title}: {case.case}: {case.error}" for case in failed]
    for title, cases in (
        ("not comparable, the scene is another one", arm.changed),
        ("not comparable, only in the base", arm.only_base),
        ("only in the new run", arm.only_new),
    ):
        lines += [f"{title}: {case}" for case in cases]
    if not arm.same_noise:
        lines.append("the arms saw different noise: pairs differ by chance as well")
    return lines + _notes(arm)


def _notes(arm: ArmComparison) -> list[str]:
    """What is to be known of rows, those with the same note together."""
    titles: dict[str, list[str]] = {}
    for row in arm.rows:
        if row.note and row.metric != "burr_found":
            titles.setdefault(row.note, []).append(row.title)
    return [f"{', '.join(names)}: {note}" for note, names in titles.items()]
