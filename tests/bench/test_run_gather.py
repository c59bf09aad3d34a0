"""Shards put together are the run that one machine makes; what does not belong together is refused."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from bench.cli import main
from bench.run.directory import load_run
from bench.run.gather import gather
from bench.run.runner import run_suite
from bench.run.shard import Shard
from burrscan.errors import InputError
from tests.bench.at_hand import AtHand
from tests.bench.cluster_lab import FAKES, content, small_suite

SHARDS = 3


@pytest.fixture(scope="module")
def fakes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("fakes")
    name = f"gather_fakes_{os.getpid()}"
    (folder / f"{name}.py").write_text(FAKES)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield __import__(name)


@pytest.fixture(scope="module")
def parts(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> list[Path]:
    folder = tmp_path_factory.mktemp("parts")
    return [
        run_suite(
            small_suite(7), folder / str(n), engine=AtHand(), shard=Shard(n, SHARDS), examine_case=fakes.good
        )
        for n in range(1, SHARDS + 1)
    ]


def test_shards_are_every_case_once() -> None:
    cases = list(range(7))
    shards = [Shard.parse(f"{n}/{SHARDS}").part(cases) for n in range(1, SHARDS + 1)]
    assert sorted(case for shard in shards for case in shard) == cases
    assert {len(shard) for shard in shards} == {2, 3}


@pytest.mark.parametrize("text", ["", "3", "0/3", "4/3", "1/0", "a/b", "-1/3", "1/3/5", "1.0/3"])
def test_what_is_no_shard_is_refused(text: str) -> None:
    with pytest.raises(InputError, match="such as 3/16"):
        Shard.parse(text)


def test_more_shards_than_cases_are_refused() -> None:
    with pytest.raises(InputError, match="shard 9/9 of 7 cases is empty; make 7"):
        Shard(9, 9).part(range(7))


def test_gathered_shards_are_the_run_of_one_machine(
    fakes: ModuleType, parts: list[Path], tmp_path: Path
) -> None:
    alone = run_suite(small_suite(7), tmp_path / "alone", workers=1, examine_case=fakes.good)
    assert gather(parts[::-1], tmp_path / "whole").missing == 0
    assert content(tmp_path / "whole") == content(alone)
    tables = [(path / "records.csv").read_bytes() for path in (tmp_path / "whole", alone)]
    assert tables[0] == tables[1]
    one, other = (load_run(path).manifest for path in (tmp_path / "whole", alone))
    assert {k: v for k, v in one.items() if k != "sessions"} == {
        k: v for k, v in other.items() if k != "sessions"
    }
    assert len(one["sessions"]) == SHARDS


def test_what_no_part_has_is_missing_and_is_made_by_resuming(
    fakes: ModuleType, parts: list[Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["gather", str(parts[0]), str(parts[2]), "--out", str(tmp_path / "r")]) == 0
    assert "4 records are missing" in capsys.readouterr().err
    run_suite(small_suite(7), tmp_path / "r", engine=AtHand(), examine_case=fakes.good)
    assert load_run(tmp_path / "r").missing == 0


def test_parts_of_another_run_are_refused(fakes: ModuleType, parts: list[Path], tmp_path: Path) -> None:
    other = run_suite(
        small_suite(7),
        tmp_path / "o",
        engine=AtHand(),
        seed=1,
        shard=Shard(1, SHARDS),
        examine_case=fakes.good,
    )
    with pytest.raises(InputError, match=r"differs from .* in seed"):
        gather([*parts, other], tmp_path / "r")
    with pytest.raises(InputError, match="is there already"):
        gather(parts, other)


def test_parts_by_another_mitsuba_are_refused(fakes: ModuleType, parts: list[Path], tmp_path: Path) -> None:
    again = run_suite(
        small_suite(7), tmp_path / "o", engine=AtHand(), shard=Shard(1, SHARDS), examine_case=fakes.good
    )
    manifest = json.loads((again / "run.json").read_text())
    manifest["sessions"][0]["versions"]["mitsuba"] = "0.0.1"
    (again / "run.json").write_text(json.dumps(manifest))
    with pytest.raises(InputError, match="versions of mitsuba"):
        gather([*parts, again], tmp_path / "r")


def test_parts_that_contradict_each_other_are_refused(
    fakes: ModuleType, parts: list[Path], tmp_path: Path
) -> None:
    again = run_suite(
        small_suite(7), tmp_path / "o", engine=AtHand(), shard=Shard(1, SHARDS), examine_case=fakes.good
    )
    lines = (again / "records.jsonl").read_text().splitlines(keepends=True)
    table = json.loads(lines[0])
    table["metrics"]["coverage"] += 1e-12
    (again / "records.jsonl").write_text("".join([json.dumps(table) + "\n", *lines[1:]]))
    with pytest.raises(InputError, match="says something else of seed=0, b"):
        gather([*parts, again], tmp_path / "r")
