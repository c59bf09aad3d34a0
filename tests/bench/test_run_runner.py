"""Runs survive failing cases, dead workers, torn records and interruptions, with the same records."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from bench.run.directory import RunDirectory, load_run, unfinished
from bench.run.records import Record
from bench.run.runner import Progress, run_suite
from bench.suites.cases import expand
from bench.suites.suite import Suite, suite_from
from burrscan.errors import InputError
from tests.bench.at_hand import AtHand

EXAMINE = """
import os, random, signal, time
from bench.run.records import Record

def record(case, variant, **more):
    value = int(case.identity[:6], 16) / 2**24 + len(variant.name)
    metrics = {"coverage": value, "depth_rms_mm": float("nan")}
    return Record(case.id, variant.name, case.parameters, case.scene_hash, case.identity, metrics,
                  timings_s={"scan": random.random()}, **more)

def good(job, case):
    return [record(case, variant) for variant in job.variants]

def slow(job, case):
    time.sleep(0.2)
    return good(job, case)

def fails_on_seed_one(job, case):
    from bench.run.examine import failed_record, failure
    if case.seed == 1:
        return [failed_record(case, v, failure("scan", ValueError("no light"))) for v in job.variants]
    return good(job, case)

def full_disk_on_seed_one(job, case):
    from bench.run.examine import failed_record, failure
    if case.seed == 1:
        error = ValueError("while pictures were saved")
        error.__cause__ = OSError(28, "No space left on device")
        return [failed_record(case, v, failure("score", error)) for v in job.variants]
    return good(job, case)

def dies_on_seed_one(job, case):
    if case.seed == 1:
        os.kill(os.getpid(), signal.SIGKILL)
    return good(job, case)
"""


@pytest.fixture(scope="module")
def fakes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """A module of stand-ins for the simulation that spawned processes can import."""
    folder = tmp_path_factory.mktemp("fakes")
    name = f"runner_fakes_{os.getpid()}"
    (folder / f"{name}.py").write_text(EXAMINE)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield __import__(name)


RIDGE = {"kind": "axial_ridge", "angle_deg": 0, "width_mm": 1, "z_start_mm": 5, "z_end_mm": 20}


def small_suite(**changes: object) -> Suite:
    document = {
        "name": "small",
        "scene": {"wheel": "paper", "finish": "matte", "burr": [RIDGE]},
        "sweep": {"burr.height_mm": [1.0, 2.0]},
        "jitter": {"burr.angle_deg": [-5.0, 5.0]},
        "seeds": [0, 1],
        "variant": [{"name": "b"}, {"name": "a"}],
    }
    return suite_from({**document, **changes}, source="test")


def without_timings(records: tuple[Record, ...]) -> list[str]:
    tables = [json.loads(record.line()) for record in records]
    return [json.dumps({k: v for k, v in table.items() if k != "timings_s"}) for table in tables]


@pytest.fixture(scope="module")
def whole(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An undisturbed run with two workers."""
    return run_suite(
        small_suite(), tmp_path_factory.mktemp("whole") / "r", workers=2, examine_case=fakes.good
    )


@pytest.fixture(scope="module")
def one_failed(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run of two cases, of which the second failed."""
    out = tmp_path_factory.mktemp("failed") / "r"
    return run_suite(small_suite(seeds=[0, 1]), out, engine=AtHand(), examine_case=fakes.fails_on_seed_one)


def test_records_do_not_depend_on_the_number_of_workers(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    alone = run_suite(small_suite(), tmp_path / "alone", workers=1, examine_case=fakes.good)
    one, two = load_run(alone), load_run(whole)
    assert without_timings(one.records) == without_timings(two.records)
    assert [r.variant for r in one.records] == ["b", "a"] * 4
    tables = [(path / "records.csv").read_bytes() for path in (alone, whole)]
    assert tables[0] == tables[1]
    assert len(tables[0].splitlines()) == 9


def test_another_seed_is_another_realisation() -> None:
    one, two = (expand(small_suite(), seed=seed) for seed in (0, 1))
    assert not {case.identity for case in one} & {case.identity for case in two}
    assert not {case.scene_hash for case in one} & {case.scene_hash for case in two}


def test_a_run_torn_apart_is_finished_with_the_same_records(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "torn"
    shutil.copytree(whole, out)
    first = [record.line() for record in load_run(whole).records]
    # two whole cases, half of the third, and a torn line
    (out / "records.jsonl").write_text("".join(first[:5]) + first[5][:40])
    assert load_run(out).missing == 3
    assert unfinished(tmp_path, "small") == out
    seen: list[Progress] = []
    run_suite(small_suite(), out, engine=AtHand(), examine_case=fakes.good, progress=seen.append)
    again = load_run(out)
    assert without_timings(again.records) == without_timings(load_run(whole).records)
    assert [(p.done, p.before, p.total) for p in seen] == [(2, 2, 4), (3, 2, 4), (4, 2, 4)]
    assert len(again.manifest["sessions"]) == 2
    with pytest.raises(InputError, match="no unfinished run"):
        unfinished(tmp_path, None)


def test_one_case_alone_gives_the_record_it_gives_among_others(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    run = load_run(
        run_suite(small_suite(), tmp_path / "r", only="*=2,seed=1", engine=AtHand(), examine_case=fakes.good)
    )
    assert run.missing == 0
    assert without_timings(run.records) == without_timings(load_run(whole).records[-2:])
    with pytest.raises(InputError, match="no case matches"):
        run_suite(small_suite(), tmp_path / "none", only="x", workers=1, examine_case=fakes.good)


def test_a_failing_case_is_recorded_with_its_traceback(fakes: ModuleType, tmp_path: Path) -> None:
    suite = small_suite(sweep={"burr.height_mm": [1.0]})
    run = load_run(run_suite(suite, tmp_path / "r", engine=AtHand(), examine_case=fakes.fails_on_seed_one))
    failed = [record for record in run.records if record.failure]
    assert len(run.records) == 4
    assert {r.parameters["seed"] for r in failed} == {1}
    assert len(failed) == 2
    assert all(r.failure and "no light" in r.failure.traceback for r in failed)
    assert all(r.metrics["coverage"] == 0.0 and r.metrics["burr_found"] == 0.0 for r in failed)


@pytest.mark.study
def test_a_case_that_kills_its_workers_has_no_record_and_is_tried_again(
    fakes: ModuleType, tmp_path: Path
) -> None:
    suite, out = small_suite(sweep={"burr.height_mm": [1.0]}), tmp_path / "r"
    with pytest.raises(InputError, match=r"SIGKILL.*--resume"):
        run_suite(suite, out, workers=1, examine_case=fakes.dies_on_seed_one)
    assert load_run(out).missing == 2
    assert not any(record.failure for record in load_run(out).records)
    run_suite(suite, out, engine=AtHand(), examine_case=fakes.good)
    assert load_run(out).missing == 0


def test_a_full_disk_is_no_result_and_the_run_goes_on_when_there_is_space(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    out = tmp_path / "r"
    with pytest.raises(InputError, match=r"No space left on device.*--resume"):
        run_suite(small_suite(), out, workers=1, examine_case=fakes.full_disk_on_seed_one)
    stopped = load_run(out)
    assert stopped.missing > 0
    assert not any(record.failure for record in stopped.records)
    run_suite(small_suite(), out, engine=AtHand(), examine_case=fakes.good)
    assert without_timings(load_run(out).records) == without_timings(load_run(whole).records)


def test_a_directory_that_holds_something_else_is_refused(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    (tmp_path / "thesis.txt").touch()
    with pytest.raises(InputError, match="not empty"):
        run_suite(small_suite(), tmp_path, workers=1, examine_case=fakes.good)
    assert [item.name for item in tmp_path.iterdir()] == ["thesis.txt"]
    with pytest.raises(InputError, match="not a directory"):
        run_suite(small_suite(), tmp_path / "thesis.txt", workers=1, examine_case=fakes.good)
    with pytest.raises(InputError, match=r"suite_hash.*another directory"):
        run_suite(small_suite(seeds=[0]), whole, workers=1, examine_case=fakes.good)
    with pytest.raises(InputError, match="differs in seed"):
        run_suite(small_suite(), whole, seed=3, workers=1, examine_case=fakes.good)


def test_two_processes_do_not_share_a_run(fakes: ModuleType, tmp_path: Path) -> None:
    with (
        RunDirectory(tmp_path / "r").locked(),
        pytest.raises(InputError, match="another process"),
    ):
        run_suite(small_suite(), tmp_path / "r", workers=1, examine_case=fakes.good)


def test_a_folder_without_a_run_says_what_makes_one(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="burrscan run"):
        load_run(tmp_path)


SCRIPT = """
import sys
from pathlib import Path
from bench.run.runner import run_suite
from bench.suites.cases import expand
from bench.suites.suite import suite_from
import json

if __name__ == "__main__":
    sys.path.insert(0, sys.argv[2])
    fakes = __import__(sys.argv[3])
    suite = suite_from(json.loads(sys.argv[4]), source="test")
    run_suite(suite, Path(sys.argv[1]), workers=2, examine_case=fakes.slow)
"""


def test_a_run_whose_parent_was_killed_is_finished_with_the_same_records(
    fakes: ModuleType, whole: Path, tmp_path: Path
) -> None:
    suite = small_suite()
    (tmp_path / "script.py").write_text(SCRIPT)
    out, home = tmp_path / "killed", str(Path(str(fakes.__file__)).parent)
    asked = [str(tmp_path / "script.py"), str(out), home, fakes.__name__, json.dumps(suite.document())]
    parent = subprocess.Popen([sys.executable, *asked])  # noqa: S603
    deadline = time.monotonic() + 60.0
    while not (out / "records.jsonl").exists() or len((out / "records.jsonl").read_bytes()) < 500:
        assert time.monotonic() < deadline, "the run did not start"
        assert parent.poll() is None, "the run ended before it could be killed"
        time.sleep(0.02)
    parent.kill()
    parent.wait()
    assert 0 < load_run(out).missing < 8
    run_suite(suite, out, engine=AtHand(), examine_case=fakes.good)
    assert without_timings(load_run(out).records) == without_timings(load_run(whole).records)


def test_a_time_that_is_no_number_is_refused(one_failed: Path, tmp_path: Path) -> None:
    """A metric may be unknown, a time never is."""
    shutil.copytree(one_failed, tmp_path / "r")
    records = tmp_path / "r" / "records.jsonl"
    line = json.loads(records.read_text().splitlines()[0])
    line["timings_s"] = {"scan": None}
    records.write_text(json.dumps(line) + "\n")
    with pytest.raises(InputError, match=r"timings_s\.scan"):
        load_run(tmp_path / "r")


@pytest.mark.parametrize(
    ("error", "traceback", "again"),
    [
        ("OSError: [Errno 28] No space left on device: 'x.npz'", "", True),
        ("PermissionError: [Errno 13] Permission denied: 'x.npz'", "", True),
        ("OSError: [Errno 5] Input/output error", "", True),
        ("numpy._core._exceptions._ArrayMemoryError: Unable", "MemoryError: no room\n", True),
        (
            "ValueError: while saving",
            "OSError: [Errno 28] No space left\n\nDuring ...\nValueError: x\n",
            True,
        ),
        ("FileNotFoundError: [Errno 2] No such file or directory: 'x'", "", False),
        ("ValueError: no light at [Errno 28]", "", False),
    ],
)
def test_what_old_versions_recorded_of_a_full_disk_is_tried_again(
    fakes: ModuleType, one_failed: Path, tmp_path: Path, error: str, traceback: str, *, again: bool
) -> None:
    suite = small_suite(seeds=[0, 1])
    shutil.copytree(one_failed, tmp_path / "r")
    records = tmp_path / "r" / "records.jsonl"
    lines = [json.loads(line) for line in records.read_text().splitlines()]
    for line in lines:
        if line["failure"]:
            line["failure"] |= {"error": error, "traceback": traceback}
    records.write_text("".join(json.dumps(line) + "\n" for line in lines))
    failed = {line["case"] for line in lines if line["failure"]}
    assert set(load_run(tmp_path / "r").obstructed) == (failed if again else set())
    if again:
        assert unfinished(tmp_path, None) == tmp_path / "r"
    run_suite(suite, tmp_path / "r", engine=AtHand(), examine_case=fakes.good)
    left = {record.case for record in load_run(tmp_path / "r").records if record.failure}
    assert left == (set() if again else failed)
    assert len(load_run(tmp_path / "r").records) == len(lines)
