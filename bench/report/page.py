"""Building the page: one self-contained HTML file beside the records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from markupsafe import Markup

from bench.report import charts, pictures, summary
from bench.report.cases import CaseView, view
from bench.report.figures import PIXEL_COLOURS, scales
from bench.run import Record, Run, load_run
from bench.score.metrics import metric_named
from bench.score.summary import summarise, value_of
from burrscan.files import written_whole

MOST_DETAILED = 24
"""Cases shown with pictures; a bigger run shows its hardest ones, and all of them in the table."""


def build_report(run_dir: Path) -> Path:
    """Write ``report.html`` into a run directory, finished or not.

    The page loads nothing from anywhere: styles and pictures are inside.

    Parameters
    ----------
    run_dir
        As :func:`bench.run.load_run` reads it.

    Returns
    -------
    pathlib.Path
        The page.

    Raises
    ------
    burrscan.errors.InputError
        When there is no run.

    """
    run = load_run(run_dir)
    page = run_dir / "report.html"
    with written_whole(page) as beside:
        beside.write_text(_template().render(_content(run)), "utf-8")
    return page


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("bench.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("report.html.jinja")


def _content(run: Run) -> dict[str, Any]:
    variants = [variant.name for variant in run.suite.variant]
    styles = {name: f"v{number % 6}" for number, name in enumerate(variants)}
    names = summary.metric_names(run)
    by_case = {case: list(records) for case, records in groupby(run.records, lambda record: record.case)}
    anchors = {case: f"case-{number}" for number, case in enumerate(by_case, 1)}
    pictured = hardest(by_case, MOST_DETAILED)
    limits = scales(run.directory, [record for case in pictured for record in by_case[case]])
    detailed = [
        view(run.directory, by_case[case], anchor=anchors[case], styles=styles, metrics=names, scales=limits)
        for case in pictured
    ]
    return {
        "run": run,
        "variants": variants,
        "styles": styles,
        "verdict": summary.verdict(run.records, variants) if run.records else (),
        "score": summary.score_rows(run.records, variants, names),
        "times": summary.time_rows(run.records, variants),
        "sections": _sections(run.records, variants, styles),
        "index": _index(by_case, variants, anchors, detailed),
        "cases": detailed,
        "failures": summary.failures(run.records),
        "metrics": [metric_named(name) for name in names],
        "shown_unit": summary.shown_unit,
        "limits": limits,
        "gradient": Markup(pictures.gradient()),  # noqa: S704 (our own constant)
        "pixel_colours": PIXEL_COLOURS,
    }


def hardest(by_case: Mapping[str, Sequence[Record]], most: int) -> list[str]:
    """At most so many cases, those with the least coverage by any variant, in the run's order."""
    least = {case: _least_coverage(records) for case, records in by_case.items()}
    chosen = set(sorted(by_case, key=least.__getitem__)[:most])
    return [case for case in by_case if case in chosen]


def _least_coverage(records: Sequence[Record]) -> float:
    return float(np.nan_to_num([value_of(record, "coverage") for record in records]).min())


def _sections(
    records: Sequence[Record], variants: Sequence[str], styles: Mapping[str, str]
) -> list[dict[str, Any]]:
    """One table and one chart per swept parameter."""
    sections = []
    for parameter in summary.swept(records):
        found = summary.groups(records, variants, parameter)
        rows = [(group.name, {styles[name]: group.coverage[name] for name in variants}) for group in found]
        chart = charts.shares(rows, "coverage of measurable pixels, %")
        sections.append({"parameter": parameter, "groups": found, "chart": chart})
    return sections


def _index(
    by_case: Mapping[str, Sequence[Record]],
    variants: Sequence[str],
    anchors: Mapping[str, str],
    detailed: Sequence[CaseView],
) -> list[dict[str, Any]]:
    """A line per case: its parameters, each variant's coverage and burrs, a link where there are pictures."""
    shown = {case.anchor for case in detailed}
    there = {
        case: count for records in by_case.values() for case, count in summary.true_burrs(records).items()
    }
    return [
        {
            "anchor": anchors[case] if anchors[case] in shown else "",
            "case": case,
            "parameters": records[0].parameters,
            "cells": [_index_cells(summary.of_variant(records, name), there) for name in variants],
        }
        for case, records in by_case.items()
    ]


def _index_cells(records: Sequence[Record], burrs: Mapping[str, int]) -> dict[str, str]:
    if not records:
        return {"coverage": "–", "burrs": "–", "false_calls": "–"}
    if records[0].failure:
        return {"coverage": "failed", "burrs": "failed", "false_calls": "failed"}
    found, there = summary.burrs_found(records, burrs)
    return {
        "coverage": summary.number(summarise("coverage", records), "1"),
        "burrs": f"{'✓' if found == there else '✗'} {found} of {there}" if there else "–",
        "false_calls": summary.number(summarise("false_calls", records), "count"),
    }
