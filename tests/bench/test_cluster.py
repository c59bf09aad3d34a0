"""Runs on a cluster: the same records as on one machine, whoever is killed; strangers are refused by name."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import dask
import pytest

from bench.cli import main
from bench.cluster.engine import Dask, resources_from
from bench.cluster.sitting import Sitting
from bench.perf.cluster import ADVISED
from bench.run.directory import load_run
from bench.run.runner import Progress, run_suite
from burrscan.errors import InputError
from tests.bench.cluster_lab import FAKES, Cluster, content, small_suite, until

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def fakes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    """A module of stand-ins that workers can import."""
    folder = tmp_path_factory.mktemp("fakes")
    name = f"cluster_fakes_{os.getpid()}"
    (folder / f"{name}.py").write_text(FAKES)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield __import__(name)


@pytest.fixture(scope="module")
def alone(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The run as one machine makes it."""
    out = tmp_path_factory.mktemp("alone") / "r"
    return run_suite(small_suite(), out, workers=1, examine_case=fakes.good)


@pytest.fixture(scope="module")
def processes(fakes: ModuleType, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cluster]:
    cluster = Cluster(tmp_path_factory.mktemp("cluster"), (Path(str(fakes.__file__)).parent,))
    yield cluster
    cluster.close()


@pytest.fixture
def cluster(processes: Cluster) -> Cluster:
    """A scheduler and a worker at least."""
    processes.complete()
    return processes


def engine(cluster: Cluster, said: list[str] | None = None) -> Dask:
    return Dask(str(cluster.file), small_suite(), say=(said if said is not None else []).append)


@pytest.mark.study
@pytest.mark.timeout(120)
def test_a_worker_is_killed_and_a_late_one_goes_on(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    said: list[str] = []
    late: list[threading.Thread] = []

    def come() -> None:
        until(lambda: any("no worker is left" in line for line in said), "nobody is told to start one")
        cluster.start_worker()

    def kill(state: Progress) -> None:
        if state.done == 3 and not late:
            cluster.stop(list(cluster.workers))
            late.append(threading.Thread(target=come))
            late[0].start()

    run_suite(
        small_suite(), tmp_path / "r", engine=engine(cluster, said), progress=kill, examine_case=fakes.slow
    )
    late[0].join()
    assert sum("no worker is left" in line for line in said) == 1
    assert content(tmp_path / "r") == content(alone)


@pytest.mark.study
def test_the_scheduler_is_killed_and_another_goes_on(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    said: list[str] = []

    def kill(state: Progress) -> None:
        if state.done == 3 and not any("is gone" in line for line in said):
            assert cluster.scheduler
            cluster.stop([cluster.scheduler])
            cluster.complete()

    run_suite(
        small_suite(), tmp_path / "r", engine=engine(cluster, said), progress=kill, examine_case=fakes.slow
    )
    assert any("is gone" in line for line in said)
    assert content(tmp_path / "r") == content(alone)


@pytest.mark.study
def test_a_scheduler_that_stays_away_ends_the_run_which_is_resumed(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    def kill(state: Progress) -> None:
        if state.done == 3:
            assert cluster.scheduler
            cluster.stop([cluster.scheduler])

    impatient = Dask(str(cluster.file), small_suite(), patience_s=0.5, say=lambda _: None)
    with pytest.raises(InputError, match=r"no Dask scheduler answers.*--resume"):
        run_suite(small_suite(), tmp_path / "r", engine=impatient, progress=kill, examine_case=fakes.slow)
    assert 0 < load_run(tmp_path / "r").missing < 24
    run_suite(small_suite(), tmp_path / "r", workers=1, examine_case=fakes.good)
    assert content(tmp_path / "r") == content(alone)


DRIVER = """
import json, sys
from pathlib import Path
from bench.cluster.engine import Dask
from bench.run.runner import run_suite
from bench.suites.suite import suite_from

suite = suite_from(json.loads(sys.argv[3]), source="test")
fakes = __import__(sys.argv[4])
run_suite(suite, Path(sys.argv[1]), engine=Dask(sys.argv[2], suite), examine_case=fakes.slow)
"""


@pytest.mark.study
def test_the_driver_is_killed_and_another_resumes(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    out = tmp_path / "r"
    asked = [str(out), str(cluster.file), json.dumps(small_suite().document()), fakes.__name__]
    path = os.pathsep.join([*map(str, cluster.path), *sys.path])
    driver = subprocess.Popen(  # noqa: S603 (our own interpreter)
        [sys.executable, "-c", DRIVER, *asked], env={**os.environ, "PYTHONPATH": path}
    )
    lines = out / "records.jsonl"
    until(lambda: lines.exists() and len(lines.read_bytes()) > 500, "the run did not start")
    driver.kill()
    driver.wait()
    assert 0 < load_run(out).missing < 24
    run_suite(small_suite(), out, engine=engine(cluster), examine_case=fakes.good)
    assert content(out) == content(alone)
    assert len(load_run(out).manifest["sessions"]) == 2


@pytest.mark.study
def test_a_case_that_kills_is_named_and_the_others_are_done(fakes: ModuleType, tmp_path: Path) -> None:
    cluster = Cluster(tmp_path, (Path(str(fakes.__file__)).parent,))
    out = tmp_path / "r"
    try:
        cluster.start_scheduler(DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES="0")
        with (
            cluster.supervised(),
            pytest.raises(
                InputError, match=r"^seed=3: its workers died .*; 1 case\(s\) have no record.*--resume"
            ),
        ):
            run_suite(small_suite(6), out, engine=engine(cluster), examine_case=fakes.deadly)
    finally:
        cluster.close()
    assert load_run(out).missing == 2
    assert not any(record.failure for record in load_run(out).records)


@pytest.mark.study
def test_a_worker_with_another_mitsuba_is_refused_by_name(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    other = tmp_path / "mitsuba-0.0.1.dist-info"
    other.mkdir()
    (other / "METADATA").write_text("Metadata-Version: 2.1\nName: mitsuba\nVersion: 0.0.1\n")
    path = os.pathsep.join(map(str, (tmp_path, *cluster.path, *sys.path)))
    odd = cluster.start_worker("--name", "stranger", PYTHONPATH=path)
    said: list[str] = []
    waited: list[Progress] = []

    def wait(state: Progress) -> None:
        waited.append(state)

    try:
        until(
            lambda: b"stranger" in (cluster.folder / "scheduler.log").read_bytes(), "the stranger stayed away"
        )
        run_suite(
            small_suite(),
            tmp_path / "r",
            engine=engine(cluster, said),
            progress=wait,
            examine_case=fakes.good,
        )
    finally:
        cluster.stop([odd])
    assert content(tmp_path / "r") == content(alone)
    (line,) = (line for line in said if "refused" in line)
    assert re.search(r"worker stranger \(tcp://.*mitsuba 0\.0\.1 \(the run: \d", line)
    assert waited[-1].workers == 1


@pytest.mark.study
def test_pictures_go_to_the_store_that_is_named(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    out, store = tmp_path / "r", tmp_path / "store"
    run_suite(small_suite(), out, engine=engine(cluster), store=str(store), examine_case=fakes.good)
    assert not list(out.glob("cases/*/*"))
    assert len(list(store.rglob("truth.npz"))) == 12
    run = load_run(out)
    assert all(run.artefact(record.case, "truth.npz").exists() for record in run.records)
    assert content(out) == content(alone)


@pytest.mark.study
def test_a_worker_of_many_threads_has_one_case_at_a_time(
    cluster: Cluster, fakes: ModuleType, alone: Path, tmp_path: Path
) -> None:
    cluster.stop(list(cluster.workers))
    cluster.start_worker("--nthreads", "3")
    run_suite(small_suite(), tmp_path / "r", engine=engine(cluster), examine_case=fakes.lonely)
    assert content(tmp_path / "r") == content(alone)
    together = {line.strip() for line in Path(fakes.MARKS / "together").read_text().splitlines()}
    assert together == {"1"}


@pytest.mark.study
def test_a_full_disk_on_a_worker_is_no_result(cluster: Cluster, fakes: ModuleType, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"No space left on device.*--resume"):
        run_suite(small_suite(), tmp_path / "r", engine=engine(cluster), examine_case=fakes.full_disk)
    assert load_run(tmp_path / "r").missing == 24


def test_a_resource_that_no_worker_offers_is_asked_for_by_name(
    cluster: Cluster, fakes: ModuleType, tmp_path: Path
) -> None:
    asked = Dask(str(cluster.file), small_suite(), resources=resources_from(["GPU=1"]), say=lambda _: None)
    with pytest.raises(InputError, match=r"every worker is refused.*does not offer GPU=1"):
        run_suite(small_suite(), tmp_path / "r", engine=asked, examine_case=fakes.good)


@pytest.mark.study
@pytest.mark.timeout(60)
def test_a_late_worker_that_the_subscription_misses_is_met_all_the_same(
    cluster: Cluster, fakes: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """About one event in a hundred is not heard that comes while its topic is being subscribed to."""
    monkeypatch.setattr(Sitting, "_hear", lambda *_: None)
    asked = Dask(str(cluster.file), small_suite(), resources={"AIR": 1.0}, say=lambda _: None)
    cluster.stop(list(cluster.workers))
    cluster.start_worker()
    with pytest.raises(InputError, match=r"every worker is refused.*AIR=1"):
        run_suite(small_suite(), tmp_path / "r", engine=asked, examine_case=fakes.good)


@pytest.mark.parametrize("word", ["GPU", "GPU=", "=1", "GPU=0", "GPU=-1", "GPU=many"])
def test_what_is_no_resource_is_refused(word: str) -> None:
    with pytest.raises(InputError, match="such as GPU=1"):
        resources_from([word])


def test_nobody_at_the_address_is_one_sentence(tmp_path: Path) -> None:
    for where in ("tcp://127.0.0.1:9", str(tmp_path / "none.json"), "nonsense"):
        absent = Dask(where, small_suite(), patience_s=0.2)
        with pytest.raises(InputError, match=rf"{re.escape(where)}: no Dask scheduler answers"):
            run_suite(small_suite(), tmp_path / "r", engine=absent)
    assert not (tmp_path / "r" / "run.json").exists()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (["--scheduler", "tcp://127.0.0.1:9"], "no Dask scheduler answers there"),
        (["--scheduler", "tcp://127.0.0.1:9", "--workers", "2"], "--workers are this machine's"),
        (["--store", "memory://x"], "name its --scheduler"),
        (["--resources", "GPU=1"], "name its --scheduler"),
        (["--shard", "3/2"], "a shard is such as 3/16"),
        (["--shard", "99/99"], "make 28 shards at most"),
    ],
)
def test_what_cannot_be_asked_for_is_one_line(
    asked: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with dask.config.set({"distributed.comm.timeouts.connect": "0.2s"}):
        assert main(["run", "quick", "--out", str(tmp_path / "r"), *asked]) == 2
    (line,) = (line for line in capsys.readouterr().err.splitlines() if line.startswith("burrscan: "))
    assert said in line
    assert not (tmp_path / "r" / "run.json").exists()


MESHES = """
name = "meshes"
source = "mesh"
metrics = ["axis_deg"]
seeds = [0, 1]
[scene]
generatrix = [[-20, 40], [-5, 42], [-5, 50], [10, 50], [10, 44], [20, 40]]
around = 160
along = 80
sigma_mm = 0.05
[[variant]]
name = "default"
"""


@pytest.mark.study
def test_the_command_makes_real_records_there_and_here(
    cluster: Cluster, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "meshes.toml").write_text(MESHES)
    asked = ["run", str(tmp_path / "meshes.toml"), "--out"]
    assert main([*asked, str(tmp_path / "there"), "--scheduler", str(cluster.file)]) == 0
    told = capsys.readouterr().err
    assert "dashboard: http://" in told
    assert re.search(r"meshes: 2/2 seed=\d \[1 worker, \S+ cases/min, 0.0 min left\]", told)
    assert main([*asked, str(tmp_path / "here"), "--workers", "1"]) == 0
    assert content(tmp_path / "there") == content(tmp_path / "here")
    assert len(content(tmp_path / "there")[1]) == 4


def test_the_settings_that_the_docs_advise_are_known_to_dask_and_pass_its_nanny() -> None:
    told = dict(re.findall(r"export (\w+)=(\w+)", (ROOT / "docs/cluster.md").read_text("utf-8")))
    assert told == ADVISED
    given = dask.config.collect_env(told)
    names = [name.removeprefix("DASK_").lower() for name in told if name.startswith("DASK_")]
    assert len(names) == 4
    for name in (name.replace("__", ".").replace("_", "-") for name in names):
        assert dask.config.get(name, config=given) != dask.config.get(name)
    nannys = dask.config.get("distributed.nanny.pre-spawn-environ")
    assert set(told) & set(nannys), "Dask no longer sets malloc's threshold: nothing to undo"
