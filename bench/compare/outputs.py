"""A comparison as Markdown for a pull request, JUnit XML for a build server, JSON, CSV and LaTeX."""

from __future__ import annotations

import csv
import io
import math
import platform
from collections import Counter
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any
from xml.etree import ElementTree as ET

from bench.compare.result import ArmComparison, Comparison, GateOutcome
from bench.compare.text import HEADS, cells, remarks

LEGEND = (
    "These cases: how many went which way by more than the margin; with the same noise in both arms each is "
    "a fact. Difference = new − baseline: the mean one for shares and counts, the typical one (Hodges and "
    "Lehmann) for errors. Its interval is the sign-flip or signed-rank test over scenes turned round, at the "
    "level in brackets, Holm's step for all gated metrics included. Equivalent: the interval lies within the "
    "margin. Worse, better: else, if zero is outside it. Metrics marked · are not gated."
)


def markdown(comparison: Comparison) -> str:
    """The verdict, one table per variant, and what is to be said beside it."""
    mark = {0: "✅", 1: "❌", 2: "⚠️"}[comparison.exit_code]
    lines = [f"## {mark} burrscan: {comparison.new} against {comparison.base}", "", comparison.sentence(), ""]
    for arm in comparison.arms:
        lines += [f"### {arm.base} → {arm.new}", "", *_table(arm), ""]
        lines += [f"- {GATE_SIGNS[gate.state]} gate: {_escaped(gate.said)}" for gate in arm.gates]
        lines += [f"- {_escaped(line)}" for line in remarks(arm)] + [""]
    if comparison.provenance:
        lines += ["<details><summary>What differs beside the results</summary>", ""]
        lines += [f"- {key}: {a} → {b}" for key, (a, b) in comparison.provenance.items()]
        lines += ["", "</details>", ""]
    return "\n".join([*lines, f"<sub>{LEGEND}</sub>", ""])


def _table(arm: ArmComparison) -> Iterator[str]:
    yield "| " + " | ".join(HEADS) + " |"
    yield "|---|" + "---:|" * (len(HEADS) - 2) + "---|"
    for row in arm.rows:
        texts = [_escaped(text) for text in cells(row)]
        if row.verdict in {"worse", "better"}:
            texts[-1] = f"**{texts[-1]}**"
        yield "| " + " | ".join(texts) + " |"


def _escaped(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;")


GATE_SIGNS = {"passed": "✓", "broken": "✗", "inconclusive": "?", "not comparable": "!"}


@dataclass(frozen=True)
class Sitting:
    """When a comparison was made, in UTC, how long it took in s, and on which host."""

    began: datetime
    took_s: float
    host: str

    @classmethod
    def ended(cls, took_s: float) -> Sitting:
        """One on this machine that has just ended."""
        now = datetime.now(UTC)
        return cls(datetime.fromtimestamp(now.timestamp() - took_s, UTC), took_s, platform.node())


def junit(comparison: Comparison, sitting: Sitting) -> str:
    """One test case per gate and variant.

    Broken is a failure, not comparable an error, inconclusive is skipped; each with its reason. All gates are
    judged together, so each test case has an equal share of the time.
    """
    share_s = sitting.took_s / max(1, sum(len(arm.gates) + 1 for arm in comparison.arms))
    suites = ET.Element("testsuites", name="burrscan compare", time=f"{sitting.took_s:.6f}")
    for arm in comparison.arms:
        counts = Counter(gate.state for gate in arm.gates)
        suite = ET.SubElement(
            suites,
            "testsuite",
            name=f"{arm.base} → {arm.new}",
            tests=str(len(arm.gates) + 1),
            failures=str(counts["broken"]),
            errors=str(counts["not comparable"] + bool(_left_out(arm))),
            skipped=str(counts["inconclusive"]),
            time=f"{share_s * (len(arm.gates) + 1):.6f}",
            timestamp=sitting.began.strftime("%Y-%m-%dT%H:%M:%S"),
            hostname=sitting.host,
        )
        for gate in arm.gates:
            _test_case(suite, arm, gate)
        _cases_test(suite, arm)
        for case in suite:
            case.set("time", f"{share_s:.6f}")
    ET.indent(suites)
    return ET.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


_JUNIT = {"broken": "failure", "not comparable": "error", "inconclusive": "skipped"}


def _test_case(suite: ET.Element, arm: ArmComparison, gate: GateOutcome) -> None:
    name = gate.metric if gate.kind == "margin" else f"{gate.metric} {gate.kind}"
    case = ET.SubElement(suite, "testcase", classname=_class_name(arm), name=name)
    row = next(row for row in arm.rows if row.metric == gate.metric)
    line = ", ".join(f"{head} {text}" for head, text in zip(HEADS[1:], cells(row)[1:], strict=True))
    if kind := _JUNIT.get(gate.state):
        ET.SubElement(case, kind, message=gate.said, type=gate.state).text = line
    ET.SubElement(case, "system-out").text = f"{line}. {row.note}" if row.note else line


def _cases_test(suite: ET.Element, arm: ArmComparison) -> None:
    """Whether every case of the base could be compared."""
    case = ET.SubElement(suite, "testcase", classname=_class_name(arm), name="cases")
    if left_out := _left_out(arm):
        error = ET.SubElement(case, "error", message=f"{len(left_out)} case(s) not comparable")
        error.set("type", "not comparable")
        error.text = "\n".join(left_out)


def _class_name(arm: ArmComparison) -> str:
    """Which variant, and of which run where there are several: build servers keep a history per name."""
    return ".".join(["burrscan", *([arm.run] if arm.run else []), arm.new_variant])


def _left_out(arm: ArmComparison) -> tuple[str, ...]:
    return (*arm.changed, *arm.only_base)


_COLUMNS = (
    "metric", "unit", "better", "typical", "gated", "margin", "base", "new", "difference", "low", "high",
    "level", "mean_difference", "p", "p_holm", "effect", "pairs", "cases", "scenes", "worse_cases",
    "better_cases", "verdict", "note",
)  # fmt: skip


def to_csv(comparison: Comparison) -> str:
    """One line per metric and arm, numbers in full, units as in the records; not finite is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["base_arm", "new_arm", *_COLUMNS])
    for arm in comparison.arms:
        for row in arm.rows:
            writer.writerow([arm.base, arm.new, *(_cell(getattr(row, name)) for name in _COLUMNS)])
    return text.getvalue()


def _cell(value: Any) -> Any:
    return "" if isinstance(value, float) and not math.isfinite(value) else value


def latex(comparison: Comparison) -> str:
    r"""One ``tabular`` per variant, for ``\input``; it needs the package booktabs and no other."""
    return "\n".join(line for arm in comparison.arms for line in _tabular(arm))


def _tabular(arm: ArmComparison) -> Iterator[str]:
    yield f"% {arm.base} -> {arm.new}".replace("\n", " ")
    yield "\\begin{tabular}{l" + "r" * (len(HEADS) - 3) + "ll}"
    yield "\\toprule"
    yield " & ".join(HEADS) + r" \\"
    yield "\\midrule"
    for row in arm.rows:
        texts = cells(row)
        yield " & ".join([*map(_tex, texts[:-1]), _tex(texts[-1][2:])]) + r" \\"  # without its sign
    yield "\\bottomrule"
    yield "\\end{tabular}\n"


_TEX = str.maketrans(
    {
        "\\": r"\textbackslash{}", "&": r"\&", "%": r"\%", "$": r"\$", "#": r"\#", "_": r"\_", "{": r"\{",
        "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "±": r"$\pm$", "–": "--",
        "·": r"$\cdot$", "<": "$<$", ">": "$>$", "°": r"$^\circ$",
    }
)  # fmt: skip


def _tex(text: str) -> str:
    return text.translate(_TEX)


def to_document(comparison: Comparison) -> dict[str, Any]:
    """Everything, as a JSON document but for numbers that are not finite; units as in the records."""
    head = {"format": 2, "exit_code": comparison.exit_code, "sentence": comparison.sentence()}
    return {**head, **asdict(comparison)}
