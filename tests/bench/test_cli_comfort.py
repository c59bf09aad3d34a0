"""The command line's comforts: exit codes, JSON, suggestions, completion, verbosity, width."""

from __future__ import annotations

import json
import re
from collections import Counter
from pathlib import Path

import pytest
import trimesh
from rich.console import Console

from bench.cli import main, tables
from tests.bench.rod import rod_view
from tests.tiers import some_of


@pytest.fixture(scope="module")
def rod(tmp_path_factory: pytest.TempPathFactory) -> str:
    path = tmp_path_factory.mktemp("rod") / "rod.stl"
    rod_view().export(path)
    return str(path)


@pytest.mark.parametrize(("limit", "code"), [("0.5", 1), ("2.0", 0)])
def test_a_burr_over_the_limit_has_an_exit_code(rod: str, limit: str, code: int) -> None:
    assert main(["detect", rod, "--limit", limit]) == code


def test_json_on_standard_output_is_alone_there(rod: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["detect", rod, "--json", "-"]) == 0
    told = capsys.readouterr()
    (burr,) = json.loads(told.out)["burrs"]
    assert burr["angle_deg"]["value"] == pytest.approx(8.0, abs=0.1)
    assert "generatrix" in told.err


@some_of("asked", [["show", "quick"], ["doctor"], ["suites"]], first=2)
def test_json_instead_of_text(asked: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    documents = []
    for where in ([], ["-"]):
        assert main([*asked, "--json", *where]) == 0
        documents.append(json.loads(capsys.readouterr().out))
    assert main([*asked, "--json", str(tmp_path / "x.json")]) == 0
    assert capsys.readouterr().out == ""
    assert documents[0] == documents[1] == json.loads((tmp_path / "x.json").read_text("utf-8"))


def test_a_datum_counts_from_a_mark(rod: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["detect", rod, "--zero", "0", "80", "0", "--up", "0", "0", "-1", "--json", "-"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["burrs"][0]["angle_deg"]["value"] == pytest.approx(90.0 - 8.0, abs=0.1)
    assert found["axis"]["direction"][2] == pytest.approx(-1.0)
    assert main(["detect", rod, "--zero", "0", "0", "0"]) == 2
    assert "lies on the axis found" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("asked", "message"),
    [
        (["rnu", "quick"], "did you mean 'run'"),
        (["detct", "x.stl"], "did you mean 'detect'"),
        (["detect", "x.stl", "--limt", "1"], "did you mean '--limit'"),
        (["run", "quick", "--variants", "adaptive"], "--variants is an option of 'compare'"),
        (["run", "quick", "-V"], "-V is an option of 'burrscan' itself"),
        (["completion", "bsh"], "did you mean 'bash'"),
        (["qqq"], "known: doctor"),
    ],
)
def test_mistyped_words_are_suggested(
    asked: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        main(asked)
    assert end.value.code == 2
    assert message in capsys.readouterr().err


def test_version_and_verbosity(rod: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    with pytest.raises(SystemExit):
        main(["-V"])
    assert capsys.readouterr().out.startswith("burrscan ")
    small = tmp_path / "small.stl"
    mesh = trimesh.load(rod)
    mesh.apply_scale(1e-3)
    mesh.export(small)
    assert main(["detect", str(small)]) == 0
    assert "--unit" in capsys.readouterr().err
    for quiet in (["-q", "detect", str(small)], ["detect", str(small), "-q"]):
        assert main(quiet) == 0
        assert capsys.readouterr().err == ""
    assert main(["detect", rod, "-v"]) == 0
    assert "times " in capsys.readouterr().out
    assert main(["-vv", "detect", "nowhere.stl"]) == 2
    assert "Traceback" in capsys.readouterr().err


@pytest.mark.parametrize("width", [30, 60, 200])
def test_tables_follow_the_width_and_cut_nothing(
    width: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    heads = ["side", "angle deg", "height mm", "significance", "verdict"]
    cells = ["protrusion", "123.45 ± 0.01", "1.2345 ± 0.0123", "1234.5", "above"]
    table = tables.plain_table(heads)
    table.add_row(*cells)
    monkeypatch.setattr(
        tables, "Console", lambda: Console(width=width, force_terminal=True, color_system=None)
    )
    tables.print_table(table)
    told = capsys.readouterr().out
    assert "…" not in told
    assert max(map(len, told.splitlines())) <= width
    assert Counter("".join(cells).replace(" ", "")) <= Counter(told)


def test_the_help_states_the_time_that_the_docs_state(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["paper", "--help"])
    (told,) = re.findall(r"about (\d+)\s+minutes", capsys.readouterr().out)
    page = (Path(__file__).parents[2] / "reports" / "README.md").read_text("utf-8")
    (measured,) = re.findall(r"([\d.]+) minutes of processor time", page)
    # the page has grown since it was measured in one go, which reports/README.md says
    assert round(float(measured)) <= int(told) <= 1.4 * float(measured)
