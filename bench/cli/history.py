"""``burrscan history``."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path

from bench.cli.grammar import Commands, command

_BLOCKS = "▁▂▃▄▅▆▇█"


def add(commands: Commands) -> None:
    """Declare the subcommand."""
    parser = command(
        commands,
        "history",
        main,
        summary="show a metric over accepted runs",
        details="mm and deg: median over cases, failures ranking last; shares and counts: mean.",
        examples="  burrscan history coverage\n  burrscan history axis_deg --suite standard",
    )
    parser.add_argument("metric", metavar="METRIC", help="a metric's name, such as coverage")
    parser.add_argument("--suite", metavar="SUITE", default="quick", help="a suite's name (default: quick)")
    parser.add_argument(
        "--baselines",
        metavar="DIR",
        type=Path,
        help="folder of accepted runs (default: reports/baselines)",
    )


def main(given: argparse.Namespace) -> int:
    """Print one line per accepted run, and the course of each variant."""
    from bench.baselines import BASELINES, history
    from bench.cli.tables import plain_table, print_table
    from bench.compare.text import number
    from bench.score.metrics import metric_named

    points = history(given.metric, given.suite, baselines=given.baselines or BASELINES)
    variants = list(dict.fromkeys(name for point in points for name in point.values))
    metric = metric_named(given.metric)
    unit = {"1": "%", "count": "count"}.get(metric.unit, metric.unit)
    table = plain_table(f"{metric.title}, {unit}; {metric.better} is better; suite {given.suite}")
    for head in ("accepted", "run", "version", *variants, "failed", "note"):
        table.add_column(head, justify="right" if head in variants else "left", no_wrap=True)
    for point in points:
        values = [number(point.values.get(name, math.nan), metric.unit) for name in variants]
        version = "–" if point.version is None else str(point.version)
        table.add_row(point.at[:10], point.name, version, *values, str(point.failed or ""), point.note)
    print_table(table)
    for name in variants:
        print(f"{name:<16}{_course([point.values.get(name, math.nan) for point in points])}")
    if len({point.version for point in points}) > 1:
        print("versions of the metric differ: values of two versions are not comparable")
    return 0


def _course(values: Sequence[float]) -> str:
    """Values as a row of blocks, low to high; a gap where there is none."""
    known = [value for value in values if math.isfinite(value)]
    low, high = (min(known), max(known)) if known else (0.0, 0.0)
    steps = [0 if high == low else round((value - low) / (high - low) * 7) for value in known]
    blocks = iter(steps)
    return "".join(_BLOCKS[next(blocks)] if math.isfinite(value) else " " for value in values)
