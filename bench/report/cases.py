"""One case of a run, laid out for the page: its figures and its numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bench.report.figures import Figure, Scales, load, scene_figures, variant_figures
from bench.report.summary import Cell, Row, score_rows
from bench.run import Record, RunDirectory


@dataclass(frozen=True)
class VariantFigures:
    """What one variant saw and measured."""

    name: str
    css: str
    failure: str
    figures: tuple[Figure, ...]


@dataclass(frozen=True)
class BurrTable:
    """A true burr, and what each variant made of it."""

    title: str
    rows: tuple[Row, ...]


@dataclass(frozen=True)
class CaseView:
    """Everything that the page shows of one case."""

    anchor: str
    parameters: tuple[tuple[str, str], ...]
    rows: tuple[Row, ...]
    burrs: tuple[BurrTable, ...]
    shared: tuple[Figure, ...]
    variants: tuple[VariantFigures, ...]


def view(
    directory: RunDirectory,
    records: Sequence[Record],
    *,
    anchor: str,
    styles: Mapping[str, str],
    metrics: Sequence[str],
    scales: Scales,
) -> CaseView:
    """Lay out one case.

    Parameters
    ----------
    directory
        The run.
    records
        The case's records, one per variant.
    anchor
        The case's name inside the page.
    styles
        Variant to style class, for colours.
    metrics
        Names for its table.
    scales
        Colour limits.

    """
    folder = directory.case(records[0].case)
    truth = load(folder / "truth.npz")
    found = {record.variant: load(folder / f"{record.variant}.npz") for record in records}
    return CaseView(
        anchor,
        tuple((name, str(value)) for name, value in records[0].parameters.items()),
        case_rows(records, metrics),
        burr_tables(records),
        scene_figures(truth, {styles[name]: arrays for name, arrays in found.items() if arrays}, scales),
        tuple(
            VariantFigures(
                record.variant,
                styles[record.variant],
                record.failure.error if record.failure else "",
                variant_figures(truth, found[record.variant], scales),
            )
            for record in records
        ),
    )


def case_rows(records: Sequence[Record], metrics: Sequence[str]) -> tuple[Row, ...]:
    """The score of one case; a failed variant has none."""
    rows = score_rows(records, [record.variant for record in records], metrics)
    failed = [record.failure is not None for record in records]
    return tuple(
        replace(
            row,
            cells=tuple(
                Cell("failed") if lost else cell for cell, lost in zip(row.cells, failed, strict=True)
            ),
        )
        for row in rows
    )


def burr_tables(records: Sequence[Record]) -> tuple[BurrTable, ...]:
    """A table per true burr: what it was, and what each variant made of it."""
    most = max((len(record.burrs) for record in records), default=0)
    return tuple(_burr_table(records, index) for index in range(most))


def _burr_table(records: Sequence[Record], index: int) -> BurrTable:
    given = [record.burrs[index] if len(record.burrs) > index else {} for record in records]
    true = next(burr for burr in given if burr)
    kind = f"{str(true['kind']).replace('_', ' ')} ({true['side']})"
    size = f"{true['height_mm']:.3g} mm high, {true['width_mm']:.3g} mm wide"
    return BurrTable(
        f"{kind}, {size}, {true['visible_mm']:.0f} mm in sight",
        (
            Row("Found", "", tuple(_verdict(burr) for burr in given)),
            _burr_row("Angle error", "deg", given, "angle_error_deg", "+.3f"),
            _burr_row("Height error", "mm", given, "height_error_mm", "+.3f"),
            _burr_row("Measured length", "mm", given, "covered_mm", ".0f"),
        ),
    )


def _burr_row(title: str, unit: str, burrs: Sequence[Mapping[str, Any]], key: str, form: str) -> Row:
    values = [burr.get(key) for burr in burrs]
    cells = (Cell("–" if value is None else format(value, form).replace("-", "−")) for value in values)
    return Row(title, unit, tuple(cells))


def _verdict(burr: Mapping[str, Any]) -> Cell:
    if not burr:
        return Cell("failed")
    return Cell("✓ found") if burr["found"] else Cell("✗ missed")
