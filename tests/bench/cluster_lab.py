"""A scheduler and workers as processes on the loopback address, and stand-ins for the simulation."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from bench.run.directory import load_run
from bench.suites.suite import Suite, suite_from

FAKES = '''
"""Stand-ins for the simulation: quick, and each leaves a picture."""
import os, pathlib, random, signal, time
from bench.run.directory import RunDirectory
from bench.run.records import Record

MARKS = pathlib.Path(__file__).parent

def good(job, case):
    folder = RunDirectory(job.out_dir).case(case.id)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "truth.npz").write_bytes(case.identity.encode())
    value = int(case.identity[:6], 16) / 2**24
    return [
        Record(case.id, v.name, case.parameters, case.scene_hash, case.identity,
               {"coverage": value, "depth_rms_mm": float("nan")}, timings_s={"scan": random.random()})
        for v in job.variants
    ]

def slow(job, case):
    time.sleep(0.08)
    return good(job, case)

HERE = []

def lonely(job, case):
    HERE.append(case.id)
    with (MARKS / "together").open("a") as file:
        file.write(f"{len(HERE)}\\n")
    time.sleep(0.03)
    HERE.remove(case.id)
    return good(job, case)

def deadly(job, case):
    if case.seed == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return good(job, case)

def full_disk(job, case):
    from bench.run.examine import failed_record, failure
    error = OSError(28, "No space left on device")
    return [failed_record(case, v, failure("score", error)) for v in job.variants]
'''

HELD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""What Dask's nanny sets for its workers."""

_RIDGE = {
    "kind": "axial_ridge",
    "angle_deg": 0,
    "height_mm": 1,
    "width_mm": 1,
    "z_start_mm": 5,
    "z_end_mm": 20,
}


def small_suite(cases: int = 12) -> Suite:
    """A suite that is never rendered."""
    document = {
        "name": "small",
        "scene": {"wheel": "paper", "finish": "matte", "burr": [_RIDGE]},
        "jitter": {"burr.angle_deg": [-5.0, 5.0]},
        "seeds": list(range(cases)),
        "variant": [{"name": "b"}, {"name": "a"}],
    }
    return suite_from(document, source="test")


def content(run_dir: Path) -> tuple[list[str], dict[str, bytes]]:
    """A run's records without their times, and its pictures."""
    tables = [json.loads(record.line()) for record in load_run(run_dir).records]
    lines = [json.dumps({k: v for k, v in table.items() if k != "timings_s"}) for table in tables]
    pictures = {
        str(path.relative_to(run_dir)): path.read_bytes() for path in sorted(run_dir.glob("cases/*/*"))
    }
    return lines, pictures


@dataclass
class Cluster:
    """Processes that are started as Dask's users start them, and killed as the world kills them.

    Parameters
    ----------
    folder
        Where the scheduler's file and everybody's output go.
    path
        Folders that workers import from, besides the checkout.

    """

    folder: Path
    path: tuple[Path, ...] = ()
    scheduler: subprocess.Popen[bytes] | None = None
    workers: list[subprocess.Popen[bytes]] = field(default_factory=list)

    @property
    def file(self) -> Path:
        """The scheduler file."""
        return self.folder / "scheduler.json"

    def start_scheduler(self, **environment: str) -> None:
        """Start one, and wait for its file."""
        self.file.unlink(missing_ok=True)
        asked = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
        self.scheduler = self._start(*asked, "--scheduler-file", str(self.file), **environment)
        until(self.file.exists, "no scheduler")

    def start_worker(self, *options: str, **environment: str) -> subprocess.Popen[bytes]:
        """Start one without a nanny; it joins when it is ready."""
        asked = ["worker", "--scheduler-file", str(self.file), "--host", "127.0.0.1", "--nthreads", "1"]
        asked += [
            "--no-dashboard",
            "--no-nanny",
            "--local-directory",
            str(self.folder),
            "--death-timeout",
            "60",
        ]
        worker = self._start(*asked, *options, **HELD | environment)
        self.workers.append(worker)
        return worker

    @contextmanager
    def supervised(self) -> Iterator[None]:
        """A worker that is started anew whenever it dies, as a batch system does.

        Dask's nanny gives up a worker that dies before it has told the nanny that it runs, and a case that
        kills at once is that quick on a slow machine.
        """
        ended = threading.Event()

        def keep() -> None:
            while not ended.is_set():
                self.start_worker().wait()

        keeper = threading.Thread(target=keep)
        keeper.start()
        try:
            yield
        finally:
            ended.set()
            while keeper.is_alive():  # one may be under way
                self.stop(list(self.workers))
                keeper.join(0.1)

    def complete(self) -> None:
        """A scheduler and a worker, started where there is none."""
        if self.scheduler is None or self.scheduler.poll() is not None:
            self.start_scheduler()
            self.stop(self.workers)
        if all(worker.poll() is not None for worker in self.workers):
            self.start_worker()

    def stop(self, processes: list[subprocess.Popen[bytes]]) -> None:
        """Kill them all, as `kill -9` does."""
        for process in processes:
            process.kill()
            process.wait()
        self.workers = [worker for worker in self.workers if worker not in processes]

    def close(self) -> None:
        """Leave nothing behind."""
        self.stop([*self.workers, *([self.scheduler] if self.scheduler else [])])

    def _start(self, what: str, *asked: str, **environment: str) -> subprocess.Popen[bytes]:
        with (self.folder / f"{what}.log").open("ab") as log:
            return subprocess.Popen(  # noqa: S603 (our own interpreter)
                [sys.executable, "-m", f"distributed.cli.dask_{what}", *asked],
                env={
                    **os.environ,
                    "PYTHONPATH": os.pathsep.join(map(str, (*self.path, *sys.path))),
                    **environment,
                },
                stdout=log,
                stderr=log,
            )


def until(holds: Callable[[], object], otherwise: str, *, within_s: float = 60.0) -> None:
    """Wait for something, or fail."""
    deadline = time.monotonic() + within_s
    while not holds():
        assert time.monotonic() < deadline, otherwise
        time.sleep(0.02)
