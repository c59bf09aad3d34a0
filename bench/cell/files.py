"""What a cell's story is written to, for people and for robots."""

from __future__ import annotations

import csv
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bench.cell.story import Story, keep
from burrscan.cell.toolpath import ToolPath
from burrscan.files import write_text, written_whole
from burrscan.meshio import write_deviation_ply, write_inspection_json

_COLUMNS = (
    "burr", "pass", "station", "kind", "x_mm", "y_mm", "z_mm", "tool_x", "tool_y", "tool_z", "feed_x",
    "feed_y", "feed_z", "feed_mm_s",
)  # fmt: skip
"""Of ``paths.csv``: place of the mill's end, unit vectors along the mill (out of the part) and the feed."""


def write_story(story: Story, folder: Path) -> None:
    """Write ``cell.json``, ``burrs.json``, ``part.ply``, ``paths.json``, ``paths.csv`` and the pictures.

    Raises
    ------
    OSError
        When the folder cannot be written.

    """
    folder.mkdir(parents=True, exist_ok=True)
    keep(story, folder)
    inspection = story.evidence.inspection
    write_deviation_ply(folder / "part.ply", story.vertices_mm, story.faces, inspection.deviation_mm)
    write_inspection_json(folder / "burrs.json", inspection)
    write_text(
        folder / "paths.json", json.dumps({"frame": "base", "paths": [_table(p) for p in story.paths]})
    )
    with (
        written_whole(folder / "paths.csv") as beside,
        beside.open("w", newline="", encoding="utf-8") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for number, path in enumerate(story.paths, 1):
            writer.writerows(_rows(number, path))


def _table(path: ToolPath) -> dict[str, Any]:
    """A path for ``paths.json``: poses are 4 × 4, row by row, mm."""
    return {
        "approach": np.round(path.above(0), 4).tolist(),
        "stations": np.round(path.stations, 4).tolist(),
        "lane": path.lane.tolist(),
        "passes_mm": list(path.passes_mm),
        "retreat": np.round(path.above(path.last), 4).tolist(),
        "feed_mm_s": path.feed_mm_s,
        "covered": path.covered,
    }


def _rows(number: int, path: ToolPath) -> Sequence[Sequence[Any]]:
    """Every pose in the order of travel."""
    rows: list[list[Any]] = [_row(number, 0, 0, "approach", path.above(0), path.feed_mm_s)]
    for index, (pass_, pose) in enumerate(path.travel()):
        rows.append(_row(number, pass_ + 1, index + 1, "cut", pose, path.feed_mm_s))
    end = path.above(path.last)
    return [*rows, _row(number, len(path.passes_mm), len(rows), "retreat", end, path.feed_mm_s)]


def _row(burr: int, pass_: int, station: int, kind: str, pose: Any, feed: float) -> list[Any]:
    place = [*pose[:3, 3], *pose[:3, 2], *pose[:3, 0]]
    return [burr, pass_, station, kind, *(f"{value:.5f}" for value in place), feed]
