"""The leaderboard: who leads, what it says of those who have nothing, and where the table goes."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from bench.leaderboard import leaderboard
from bench.run.directory import Run, RunDirectory, describe_run, load_run, write_manifest
from bench.run.records import Failure, Record, append
from bench.suites.suite import suite_from

SUITE = suite_from(
    {
        "name": "s",
        "scene": {},
        "variant": [{"name": "poor"}, {"name": "good"}],
        "metrics": ["coverage", "axis_deg", "false_calls"],
    },
    source="test",
)


def run_in(folder: Path, *, burrs: int = 60) -> Run:
    """Burrs of growing height; 'good' finds them from some 0.5 mm, 'poor' from 1 mm; 'poor' fails once."""
    random = np.random.default_rng(5)
    records = []
    for number, height in enumerate(np.geomspace(0.1, 2.5, burrs)):
        for variant, half, axis_deg in (("poor", 1.0, 0.2), ("good", 0.5, 0.01)):
            found = bool(random.random() < 1.0 / (1.0 + (half / height) ** 6))
            metrics = {
                "coverage": 0.9,
                "axis_deg": axis_deg,
                "false_calls": 0.0 if variant == "poor" else 1.0,
            }
            failed = variant == "poor" and number == 0
            records.append(
                Record(
                    case=f"case={number}",
                    variant=variant,
                    parameters={"case": number, "seed": 0},
                    scene_hash="",
                    identity="",
                    metrics={} if failed else metrics,
                    burrs=({"height_mm": float(height), "found": found},),
                    failure=Failure("scan", "no light", "") if failed else None,
                )
            )
    cases = [
        {"id": f"case={number}", "parameters": {"case": number, "seed": 0}, "scene_hash": "", "identity": ""}
        for number in range(burrs)
    ]
    folder.mkdir(exist_ok=True)
    asked = describe_run(SUITE, [], seed=0, metrics={})
    write_manifest(RunDirectory(folder), {**asked, "cases": cases, "sessions": []})
    append(folder / "records.jsonl", records)
    return load_run(folder)


def cells(table: str) -> dict[str, dict[str, str]]:
    """Variant to column to cell."""
    head, _, *rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines()]
    return {row[0]: dict(zip(head, row, strict=True)) for row in rows}


def test_the_better_one_leads_and_the_best_of_each_column_is_bold(tmp_path: Path) -> None:
    found = cells(leaderboard(run_in(tmp_path / "run")))
    assert list(found) == ["good", "poor"]
    assert found["good"]["Axis angle, median deg"] == "**0.01**"
    assert found["poor"]["Axis angle, median deg"] == "0.2"
    assert found["poor"]["False calls, mean"] == "**0**"
    assert found["good"]["Coverage, mean %"] == "**90.0**"
    assert found["poor"]["Coverage, mean %"] == "88.5"  # the case without a result covers nothing
    assert (found["poor"]["failed"], found["good"]["failed"]) == ("1", "0")
    a50, a90, bound = (float(found["good"][f"{name}, mm"].strip("*")) for name in ("a50", "a90", "a90/95"))
    assert math.isclose(a50, 0.5, rel_tol=0.25)
    assert a50 < a90 < bound < 3.0 * a50


def test_without_burrs_there_are_no_sizes(tmp_path: Path) -> None:
    assert "a50" not in leaderboard(run_in(tmp_path / "run", burrs=1))


def test_the_table_goes_between_its_lines_again_and_again(tmp_path: Path) -> None:
    run_in(tmp_path / "run")
    page = tmp_path / "README.md"
    page.write_text("# Before\n<!-- leaderboard -->\nold\n<!-- end of the leaderboard -->\nafter\n")
    for _ in range(2):
        assert main(["leaderboard", str(tmp_path / "run"), "--into", str(page)]) == 0
    text = page.read_text()
    assert text.startswith("# Before\n<!-- leaderboard -->\n\n| variant | failed |")
    assert text.endswith("|\n\n<!-- end of the leaderboard -->\nafter\n")
    assert "old" not in text


def test_a_file_without_the_lines_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run_in(tmp_path / "run")
    (tmp_path / "page.md").write_text("nothing")
    assert main(["leaderboard", str(tmp_path / "run"), "--into", str(tmp_path / "page.md")]) == 2
    assert "has no lines" in capsys.readouterr().err
