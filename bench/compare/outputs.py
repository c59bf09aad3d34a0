"""A comparison as Markdown for a pull request, JUnit XML for a build server, and JSON for programs."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any
from xml.etree import ElementTree as ET

from bench.compare.result import ArmComparison, Comparison, Row
from bench.compare.text import HEADS, cells, remarks

LEGEND = (
    "Means over scenes; difference = new − base with its 95 % interval, scenes resampled. Equivalent: the "
    "interval lies within the margin. Worse, better: else, if p, corrected by Holm for all gated metrics, is "
    "at most 0.05. Metrics marked · are not gated."
)


def markdown(comparison: Comparison) -> str:
    """The verdict, one table per variant, and what is to be said beside it."""
    mark = {0: "✅", 1: "❌", 2: "⚠️"}[comparison.exit_code]
    lines = [f"## {mark} burrscan: {comparison.new} against {comparison.base}", "", comparison.sentence(), ""]
    for arm in comparison.arms:
        lines += [f"### {arm.base} → {arm.new}", "", *_table(arm), ""]
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


def junit(comparison: Comparison) -> str:
    """One test case per gated metric and variant: worse is a failure, not comparable an error."""
    suites = ET.Element("testsuites", name="burrscan compare")
    for arm in comparison.arms:
        rows = [row for row in arm.rows if row.gated]
        suite = ET.SubElement(
            suites,
            "testsuite",
            name=f"{arm.base} → {arm.new}",
            tests=str(len(rows) + 1),
            failures=str(sum(row.verdict == "worse" for row in rows)),
            errors=str(sum(row.verdict == "not comparable" for row in rows) + bool(_left_out(arm))),
        )
        for row in rows:
            _test_case(suite, arm, row)
        _cases_test(suite, arm)
    ET.indent(suites)
    return ET.tostring(suites, encoding="unicode", xml_declaration=True) + "\n"


def _test_case(suite: ET.Element, arm: ArmComparison, row: Row) -> None:
    case = ET.SubElement(suite, "testcase", classname=f"burrscan.{arm.new_variant}", name=row.metric)
    line = ", ".join(f"{head} {text}" for head, text in zip(HEADS[1:], cells(row)[1:], strict=True))
    kind = {"worse": "failure", "not comparable": "error"}.get(row.verdict)
    if kind:
        ET.SubElement(case, kind, message=f"{row.title} is {row.verdict}", type=row.verdict).text = line
    ET.SubElement(case, "system-out").text = f"{line}. {row.note}" if row.note else line


def _cases_test(suite: ET.Element, arm: ArmComparison) -> None:
    """Whether every case of the base could be compared."""
    case = ET.SubElement(suite, "testcase", classname=f"burrscan.{arm.new_variant}", name="cases")
    if left_out := _left_out(arm):
        error = ET.SubElement(case, "error", message=f"{len(left_out)} case(s) not comparable")
        error.set("type", "not comparable")
        error.text = "\n".join(left_out)


def _left_out(arm: ArmComparison) -> tuple[str, ...]:
    return (*arm.changed, *arm.only_base)


def to_json(comparison: Comparison) -> str:
    """Everything, units as in the records; what is not finite is null."""
    head = {"format": 1, "exit_code": comparison.exit_code, "sentence": comparison.sentence()}
    return json.dumps(_plain({**head, **asdict(comparison)}), indent=1, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
