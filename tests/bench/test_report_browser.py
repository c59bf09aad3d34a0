"""A browser opens the page: everything is there, nothing fails to load, nothing sticks out."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench.compare import compare_runs
from bench.report import build_comparison, build_report
from bench.run import load_run
from tests.bench.browser import Seen, look
from tests.bench.report_run import made_up_run

PROBE = Path(__file__).with_name("report_probe.js").read_text("utf-8")
PAGES = [f"{kind}-{width}" for kind in ("run", "comparison") for width in (1400, 390)]
EIGHT = {  # of each part: how many pictures it has at least
    "verdict": 0, "difference": 8, "detection": 1, "where": 0, "cases": 20, "budget": 6, "speed": 0,
    "provenance": 0,
}  # fmt: skip


LOOKS = [
    {
        "turn_deg": 180.0 * k,
        "elevation_deg": 32.0,
        "roll_deg": 90.0,
        "found": 0.5 * k,
        "coverage": 0.4 + 0.3 * k,
    }
    for k in range(2)
]
CELL = {"planner": "expected", "most": 8, "looks": LOOKS, "removals": [], "chart": {"left": [[0.1, 0.9]]}}


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> Seen:
    folder = tmp_path_factory.mktemp("browser")
    run = load_run(made_up_run(folder / "run", fail=True, budget=True, many=True))
    case = run.directory.case(run.records[0].case)
    (case / f"{run.records[0].variant}.cell.json").write_text(json.dumps(CELL), "utf-8")
    comparison = compare_runs(run, run, variants=("adaptive", "fixed"))
    files = {
        "run": build_report(run.directory.path),
        "comparison": build_comparison(run, [(run, comparison)], folder / "ab.html"),
    }
    pages = {name: (files[kind], int(width)) for name in PAGES for kind, width in [name.split("-")]}
    return look(pages, PROBE, folder)


@pytest.mark.parametrize("name", PAGES)
def test_all_eight_parts_are_there(seen: Seen, name: str) -> None:
    found = seen.told[name]
    assert "probe" not in found
    verdict, *others = EIGHT
    parts = [part for part in found["parts"] if part != "cell"]
    assert parts == [verdict, "goals", *others[:-1], "failures", "provenance", "read"]
    for part, pictures in EIGHT.items():
        shown = found["parts"][part]
        assert shown["height"] > 40
        assert shown["words"] > 60
        assert shown["pictures"] >= pictures
    assert found["cases"] >= 2
    assert len(found["commands"]) == found["cases"]
    assert all(command.startswith("burrscan run made-up --case ") for command in found["commands"])


@pytest.mark.parametrize("name", ["run-1400", "run-390"])
def test_a_heat_map_of_another_variant_is_unpacked_when_chosen(seen: Seen, name: str) -> None:
    first, second, third = seen.told[name]["heats"]
    assert [heat["hidden"] for heat in (first, second, third)] == [True, True, False]
    assert second["words"] == ""
    assert "Coverage" in third["words"]
    assert "39.5" in third["words"]  # per cent of the polished cases: 40 of seed 0, 39 of seed 1


@pytest.mark.parametrize("name", PAGES)
def test_nothing_fails_and_nothing_is_loaded(seen: Seen, name: str) -> None:
    found = seen.told[name]
    assert found["errors"] == []
    assert found["broken"] == []
    assert found["loaded"] == []


def test_the_browser_has_nothing_to_say_and_asks_for_the_pages_only(seen: Seen) -> None:
    assert seen.console == ()
    assert sorted(seen.asked) == sorted(["/", *(f"/{name}" for name in PAGES)])


@pytest.mark.parametrize("name", PAGES)
def test_every_colour_of_a_legend_is_seen(seen: Seen, name: str) -> None:
    """That of the cell was not: its lines have a colour, its swatches had none."""
    assert "cell" in seen.told[name]["parts"]
    assert seen.told[name]["blank"] == []


@pytest.mark.parametrize("name", PAGES)
def test_nothing_sticks_out(seen: Seen, name: str) -> None:
    found = seen.told[name]
    assert found["width"] == int(name.rpartition("-")[2])
    assert found["overflow"] <= 0
    assert found["out"] == []
    assert found["figures"] > 30
    assert found["empty"] == []


@pytest.mark.parametrize("name", PAGES)
def test_the_3d_view_is_drawn_and_turns(seen: Seen, name: str) -> None:
    found = seen.told[name]
    if not found["webgl"]:
        pytest.skip("this browser has no WebGL: the page keeps the still picture, which was looked at above")
    assert "error" not in found["turned"]
    assert 0.05 < found["turned"]["drawn"] < 0.95
    assert found["turned"]["changed"] > 100
