"""Many variants at once: variants down, metrics across, each cell with its verdict against the first one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from bench.report.sides import Panel
from bench.report.summary import Row, score_row


@dataclass(frozen=True)
class MatrixCell:
    """A number, its verdict against the first variant (empty where none was made), and whether it is best."""

    text: str
    verdict: str
    best: bool


@dataclass(frozen=True)
class MatrixLine:
    """A variant: its name, its colour, how many of its cases failed, and a cell per metric."""

    label: str
    css: str
    failed: int
    cells: tuple[MatrixCell, ...]


@dataclass(frozen=True)
class Matrix:
    """The score of many variants."""

    metrics: tuple[Row, ...]
    lines: tuple[MatrixLine, ...]


def matrix(panel: Panel, names: Sequence[str]) -> Matrix:
    """Lay out a panel's sides. O(sides × metrics × cases)."""
    parts = [list(side.records.values()) for side in panel.sides]
    rows = {name: score_row(parts, name) for name in names}
    rows = {name: row for name, row in rows.items() if any(cell.text != "–" for cell in row.cells)}
    verdicts = {arm.new: {row.metric: row.verdict for row in arm.rows} for arm in panel.arms}
    lines = [
        MatrixLine(
            side.label,
            side.css,
            sum(record.failure is not None for record in parts[number]),
            _cells(rows, number, verdicts.get(side.label, {})),
        )
        for number, side in enumerate(panel.sides)
    ]
    return Matrix(tuple(rows.values()), tuple(lines))


def _cells(rows: Mapping[str, Row], number: int, verdicts: Mapping[str, str]) -> tuple[MatrixCell, ...]:
    told = {"better", "worse"}
    return tuple(
        MatrixCell(
            row.cells[number].text,
            verdicts.get(name, "") if verdicts.get(name) in told else "",
            row.cells[number].best,
        )
        for name, row in rows.items()
    )
