"""Lists of all that there is: every case with its key figures, every failure with its error."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from bench.report import summary
from bench.report.sides import Panel
from bench.run import Record
from bench.summary.table import summarise


def failures(panels: Sequence[Panel]) -> list[dict[str, Any]]:
    """Every result that is missing, and why: those of one side with the same error together."""
    found: dict[tuple[str, str], dict[str, Any]] = {}
    for side in (side for panel in panels for side in panel.sides):
        for record in side.records.values():
            if record.failure:
                error = (record.failure.error.splitlines() or ["no message"])[0]
                item = {"side": side, "error": error, "failure": record.failure, "cases": []}
                found.setdefault((side.label, error), item)["cases"].append(record.case)
    return list(found.values())


def index(panel: Panel, anchors: Mapping[tuple[int, str], str]) -> dict[str, Any]:
    """A line per case: what it is, each side's key figures, a link where there are pictures."""
    there = summary.true_burrs(panel.records)
    known = {record.case: record for record in panel.records}
    drawn = tuple(dict.fromkeys(name for record in known.values() for name in _drawn(record)))
    heads = ("coverage, %",) * summary.scanned(panel.records) + ("axis, deg", "burrs", "false calls")
    lines = [
        {
            "anchor": anchors.get((id(panel), case), ""),
            "name": case.replace(",", ", "),
            "drawn": [known[case].parameters.get(name, "–") for name in drawn],
            "cells": [
                _index_cells(side.records.get(case), there[case])[-len(heads) :] for side in panel.sides
            ],
        }
        for case in known
    ]
    return {"heads": heads, "drawn": [name.rpartition(".")[2] for name in drawn], "lines": lines}


def _drawn(record: Record) -> tuple[str, ...]:
    """Parameters that a case's name does not tell: those of a random design, for which a point stands."""
    told = {part.partition("=")[0] for part in record.case.split(",")}
    return tuple(name for name in record.parameters if name not in told)


def _index_cells(record: Record | None, burrs: int) -> tuple[str, ...]:
    """Coverage, axis, burrs found, false calls."""
    if record is None:
        return ("–",) * 4
    if record.failure:
        return ("failed",) * 4
    found = sum(bool(burr["found"]) for burr in record.burrs)
    return (
        summary.number(summarise("coverage", [record]), "1"),
        summary.number(summarise("axis_deg", [record]), "deg"),
        f"{'✓' if found == burrs else '✗'} {found} of {burrs}" if burrs else "–",
        summary.number(summarise("false_calls", [record]), "count"),
    )
