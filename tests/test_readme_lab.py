"""The README's own laboratory: its files are copied out of the page, and its commands are run."""

from __future__ import annotations

import json
import re
import shlex
import shutil
from pathlib import Path

import pytest

from bench.cli import main
from bench.run import load_run
from bench.suites.catalogue import load_suite

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")
FILES = dict(re.findall(r"```(?:toml|python)\n# ([\w/]+\.(?:toml|py))[:\n](.*?)```", README, re.DOTALL))
SECTION = README.partition("## Make it yours")[2].partition("\n## ")[0]
COMMANDS = re.findall(r"^    burrscan (.*)$", SECTION, re.MULTILINE)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A user's folder, outside the repository."""
    here = tmp_path_factory.mktemp("mine")
    for name, text in FILES.items():
        path = here / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(f"# {text}", "utf-8")
    return here


def test_the_page_has_a_wheel_a_suite_and_one_method_of_every_kind() -> None:
    lab = {"lab/codes.py", "lab/axis.py", "lab/finder.py", "lab/metrics.py"}
    assert set(FILES) == {"pulley.toml", "pulleys.toml"} | lab
    assert [command.split()[0] for command in COMMANDS] == ["show", "run", "compare", "report"]


def test_its_commands_run_in_order(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    codes = [main(shlex.split(command)) for command in COMMANDS]
    assert codes == [0, 0, 0, 0]
    run = load_run(folder / "runs" / "first")
    assert not [record.failure for record in run.records if record.failure]
    mine = [record.metrics for record in run.records if record.variant == "mine"]
    assert all(metrics["wrong_rate"] < 0.05 for metrics in mine)
    # a column is 3.5 mm deep on this rig; light that bounces in the groove moves cosines by most of it
    assert all(0.0 < metrics["lab.metrics:DEPTH_P99"] < 3.0 for metrics in mine)
    assert all(metrics["burr_found"] == 1.0 for metrics in mine)
    assert all(metrics["burr_angle_deg"] < 2.0 for metrics in mine)
    assert "Depth 99 %" in (folder / "runs" / "first" / "report.html").read_text("utf-8")
    assert (folder / "change.md").stat().st_size > 0
    assert (folder / "gate.xml").stat().st_size > 0


def test_a_gate_that_breaks_ends_with_one(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other way round: without the finer light the depth is worse, and now it is gated.

    A run of the gated suite has the records of the first run: gates are looked at when runs are compared.
    """
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    assert main(["compare", "runs/first", "--variants", "mine", "shipped"]) == 0
    suite = (folder / "pulleys.toml").read_text("utf-8")
    gate = '\n[[gate]]\nmetric = "lab.metrics:DEPTH_P99"\nmargin = 0.1\n'
    (folder / "gated.toml").write_text(suite + gate, "utf-8")
    shutil.copytree("runs/first", "runs/gated")
    manifest = json.loads(Path("runs/gated/run.json").read_text("utf-8"))
    manifest["suite"] = load_suite("gated.toml").document()
    Path("runs/gated/run.json").write_text(json.dumps(manifest), "utf-8")
    assert main(["compare", "runs/gated", "--variants", "mine", "shipped"]) == 1
