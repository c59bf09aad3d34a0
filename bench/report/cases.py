"""One case, laid out for the page: its figures, its numbers, and how to run it alone."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bench.report import figures
from bench.report.figures import Scales
from bench.report.forest import shown
from bench.report.summary import Cell, Row, known_rows, score_row
from bench.report.worst import Chosen
from bench.run import Record, Run
from bench.score.metrics import metric_named
from bench.summary.table import summarise

_HALF = 0.5
"""A burr of which less than this share can be, or was, measured was missed for that reason."""
_DETECTABILITY = {"dprime": "Detectability d'", "side_dprime": "Detectability d' of its side"}
"""Rows of a burr's table that a suite asks for; a rim burr has no other side."""


@dataclass(frozen=True)
class BurrTable:
    """A true burr, and what each side made of it."""

    title: str
    rows: tuple[Row, ...]


def view(item: Chosen, anchor: str, metrics: Sequence[str], limits: Scales) -> dict[str, Any]:
    """Everything that the page shows of one case.

    ``sides`` are those that have it, ``scans`` those of which pictures are shown.

    Parameters
    ----------
    item
        The case, of which panel, and why it is shown.
    anchor
        Its name inside the page.
    metrics
        Names for its table.
    limits
        Colour limits.

    """
    case = item.case
    sides = [side for side in item.panel.sides if case in side.records]
    records = [side.records[case] for side in sides]
    truth = next((arrays for side in sides if (arrays := side.truth(case))), {})
    found = {side: side.found(case) for side in sides if side in item.sides}
    return {
        "name": case.replace(",", ", "),
        "anchor": anchor,
        "title": item.panel.title,
        "reason": item.reason,
        "parameters": records[0].parameters,
        "sides": sides,
        "failed": [(side.label, why.error) for side in sides if (why := side.records[case].failure)],
        "paired": item.panel.paired and len(sides) == 2,
        "rows": case_rows(records, metrics, paired=item.panel.paired),
        "burrs": burr_tables(records),
        "photos": figures.photo_figures(truth, found),
        "maps": figures.map_figures(truth, found, limits),
        "solid": figures.solid_figure(found, limits, first=item.kind[0]),
        "profiles": figures.profile_figures(truth, found, limits),
        "scans": {side: figures.scan_figures(truth, arrays, limits) for side, arrays in found.items()},
        "command": command(sides[-1].run, case),
    }


def command(run: Run, case: str) -> str:
    """What to type to run one case again."""
    seed = f" --seed {run.seed}" if run.seed else ""
    return f"burrscan run {shlex.quote(_suite_argument(run))} --case {shlex.quote(case)}{seed}"


def _suite_argument(run: Run) -> str:
    """The suite as it was named when the run was begun: a name, or a path."""
    for session in run.manifest["sessions"]:
        words = session.get("command", [])
        if words[1:2] == ["run"] and len(words) > 2 and not words[2].startswith("-"):
            return str(words[2])
    return run.suite.name


def case_rows(records: Sequence[Record], metrics: Sequence[str], *, paired: bool = False) -> tuple[Row, ...]:
    """The score of one case, per side; a failed one has none. Metrics that no side has are left out."""
    return known_rows(_case_row(records, name, paired=paired) for name in metrics)


def _case_row(records: Sequence[Record], name: str, *, paired: bool) -> Row:
    row = score_row([[record] for record in records], name)
    cells = tuple(
        Cell("failed") if record.failure else cell for record, cell in zip(records, row.cells, strict=True)
    )
    if not paired or len(records) != 2:
        return replace(row, cells=cells)
    base, new = (summarise(name, [record]) for record in records)
    lost = any(record.failure for record in records)
    metric = metric_named(name)
    change = "–" if lost else shown(new - base, metric.unit, sign=True)
    return replace(row, cells=(*cells, Cell(change)))


def burr_tables(records: Sequence[Record]) -> tuple[BurrTable, ...]:
    """A table per true burr: what it was, and what each side made of it."""
    most = max((len(record.burrs) for record in records), default=0)
    return tuple(_burr_table(records, index) for index in range(most))


def _burr_table(records: Sequence[Record], index: int) -> BurrTable:
    given = [record.burrs[index] if len(record.burrs) > index else {} for record in records]
    true = next(burr for burr in given if burr)
    return BurrTable(
        _burr_title(true),
        (
            Row("Found", "", tuple(_verdict(burr) for burr in given)),
            *(
                _burr_row(title, "", given, key, ".0f")
                for key, title in _DETECTABILITY.items()
                if key in true
            ),
            _burr_row("Angle error", "deg", given, "angle_error_deg", "+.3f"),
            _burr_row("Height error", "mm", given, "height_error_mm", "+.3f"),
            _burr_row("Measured length", "mm", given, "covered_mm", ".0f"),
        ),
    )


def _burr_title(true: Mapping[str, Any]) -> str:
    """What is known of it in words; records of a user's own may know less."""
    words = [str(true.get("kind", "burr")).replace("_", " ")]
    words += [f"({true['side']})"] if "side" in true else []
    sizes = (
        ("height_mm", "mm high", ".3g"),
        ("width_mm", "mm wide", ".3g"),
        ("visible_mm", "mm in sight", ".0f"),
    )
    told = [f"{true[key]:{form}} {what}" for key, what, form in sizes if true.get(key) is not None]
    return ", ".join([" ".join(words), *told])


def _burr_row(title: str, unit: str, burrs: Sequence[Mapping[str, Any]], key: str, form: str) -> Row:
    values = [burr.get(key) for burr in burrs]
    cells = (Cell("–" if value is None else format(value, form).replace("-", "−")) for value in values)
    return Row(title, unit, tuple(cells))


def _verdict(burr: Mapping[str, Any]) -> Cell:
    if not burr:
        return Cell("failed")
    if burr["found"]:
        return Cell(f"✓ found{_measured(burr)}")
    return Cell(f"✗ {'wrong side' if burr.get('located') else 'missed'}{_why_missed(burr)}{_measured(burr)}")


def _why_missed(burr: Mapping[str, Any]) -> str:
    """What kept a burr from being measured: out of view, in the dark, or no usable light; or nothing did."""
    visible, measurable, covered = (burr.get(f"{name}_mm") for name in ("visible", "measurable", "covered"))
    if visible is None or measurable is None or covered is None:
        return ""
    if visible == 0.0:
        return ", out of view"
    if measurable < _HALF * visible:
        return ", dark or shadowed"
    return ", mirrored light" if covered < _HALF * measurable else ""


def _measured(burr: Mapping[str, Any]) -> str:
    """How much of what is in sight was measured; nothing where nobody knows."""
    visible, covered = burr.get("visible_mm"), burr.get("covered_mm")
    return f", {100.0 * covered / visible:.0f} % measured" if visible and covered is not None else ""
