"""``burrscan history``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from bench.cli.grammar import add_baselines, add_json, add_trust
from bench.cli.output import told, write_json

if TYPE_CHECKING:
    from bench.baselines import Point

SUMMARY = "show a metric over accepted runs"
DETAILS = """\
Any metric. px, mm and deg: median over cases, failures ranking last; shares and counts: mean.
In brackets the middle half of the cases. A line of its own names every commit that moved the
metric: where the paired test of `burrscan compare` sees a difference to the run before at 95 %."""

_BLOCKS = "▁▂▃▄▅▆▇█"

EXAMPLES = "  burrscan history coverage\n  burrscan history axis_deg --suite standard"


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument("metric", metavar="METRIC", help="a metric's name, such as coverage")
    parser.add_argument("--suite", metavar="SUITE", default="quick", help="a suite's name (default: quick)")
    add_baselines(parser)
    add_json(parser, "the values of every run")
    add_trust(parser, "a run", of=["baselines"])


def main(given: argparse.Namespace) -> int:
    """Print one line per accepted run, and the course of each variant."""
    from bench.baselines import history
    from bench.score.metrics import metric_named

    points = history(given.metric, given.suite, baselines=given.baselines)
    metric = metric_named(given.metric)
    with told(given.json):
        _print(given.suite, metric, points)
    if given.json:
        head = {"metric": metric.name, "unit": metric.unit, "better": metric.better, "suite": given.suite}
        write_json(given.json, {**head, "runs": [asdict(point) for point in points]})
    return 0


def _print(suite: str, metric: Any, points: Sequence[Point]) -> None:
    from bench.cli.tables import plain_table, print_table
    from bench.compare.text import number

    variants = list(dict.fromkeys(name for point in points for name in point.values))
    unit = {"1": "%", "count": "count"}.get(metric.unit, metric.unit)
    heads = ("accepted", "run", "version", *variants, "failed", "note")
    title = f"{metric.title}, {unit}; {metric.better} is better; suite {suite}"
    table = plain_table(heads, title, right=variants)
    for point in points:
        values = [_value(point, name, metric.unit) for name in variants]
        version = "–" if point.version is None else str(point.version)
        table.add_row(point.at[:10], point.name, version, *values, str(point.failed or ""), point.note)
    print_table(table)
    for name in variants:
        print(f"{name:<16}{_course([point.values.get(name, math.nan) for point in points])}")
    for point in points:
        for name, (way, difference) in point.moved.items():
            by = number(difference, metric.unit, sign=True)
            commit = point.commit or "an unknown commit"
            print(f"{point.name}: {name} {way} by {by} since the run before; moved by {commit}")
    if len({point.version for point in points}) > 1:
        print("versions of the metric differ: values of two versions are not comparable")


def _value(point: Point, name: str, unit: str) -> str:
    """The value, and the middle half of its cases."""
    from bench.compare.text import number

    low, high = point.halves.get(name, (math.nan, math.nan))
    value = number(point.values.get(name, math.nan), unit)
    return f"{value} ({number(low, unit)} to {number(high, unit)})" if math.isfinite(low) else value


def _course(values: Sequence[float]) -> str:
    """Values as a row of blocks, low to high; a gap where there is none."""
    known = [value for value in values if math.isfinite(value)]
    low, high = (min(known), max(known)) if known else (0.0, 0.0)
    steps = [0 if high == low else round((value - low) / (high - low) * 7) for value in known]
    blocks = iter(steps)
    return "".join(_BLOCKS[next(blocks)] if math.isfinite(value) else " " for value in values)
