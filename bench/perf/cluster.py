"""What running on a Dask cluster costs: ``python -m bench.perf.cluster``.

Everything on the loopback address of this machine, which should have nothing else to do:

- *empty*: wall time per case of cases that cost nothing, and the driver's processor time in it;
- *driver*: the driver's processor time per case with many simulated workers, which only wait;
- *scaling*: cases per minute with one worker process and with more, one thread each, up to the cores;
- *limit*: the same without an engine, by processes that know nothing of each other: what the machine gives.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType

from distributed import Worker

from bench.cluster.engine import Dask
from bench.perf.standins import WAIT_S, empty, waiting
from bench.run.crew import SINGLE_THREADED
from bench.run.engine import Examine
from bench.run.examine import examine
from bench.run.runner import Progress, run_suite
from bench.suites.suite import Suite, suite_from
from scenes.renderer import usable_cores

_MESH = {
    "name": "mesh",
    "source": "mesh",
    "metrics": ["axis_deg"],
    "scene": {
        "generatrix": [[-20, 40], [-5, 42], [-5, 50], [10, 50], [10, 44], [20, 40]],
        "around": 480,
        "along": 240,
        "sigma_mm": 0.05,
    },
    "variant": [{"name": "default"}],
}
_AS_IT_COMES: Mapping[str, str] = MappingProxyType({})
ADVISED: Mapping[str, str] = MappingProxyType(
    {
        "DASK_DISTRIBUTED__ADMIN__TICK__INTERVAL": "1s",
        "DASK_DISTRIBUTED__ADMIN__SYSTEM_MONITOR__INTERVAL": "2s",
        "DASK_DISTRIBUTED__WORKER__PROFILE__ENABLED": "False",
        "DASK_DISTRIBUTED__WORKER__MEMORY__MONITOR_INTERVAL": "1s",
        "MALLOC_TRIM_THRESHOLD_": "268435456",
        "MALLOC_MMAP_THRESHOLD_": "268435456",
    }
)
"""What docs/cluster.md advises where all cores work: Dask's watching of itself takes a tenth of a core, and
its nanny has the memory of large arrays handed back to the system, to be had anew page by page."""
_JOINED_WITHIN_S = 120.0
"""For 200 simulated workers to start; a machine that needs longer is not measured."""


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--cases", type=int, default=1000, help="empty cases")
    parser.add_argument("--simulated", type=int, default=200, help="simulated workers")
    parser.add_argument("--real", type=int, default=60, help="real cases per number of workers")
    parser.add_argument("--host", nargs=2, metavar=("FILE", "N"), help=argparse.SUPPRESS)
    parser.add_argument("--free", nargs=2, metavar=("FIRST", "N"), help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.host:
        asyncio.run(_host(given.host[0], int(given.host[1])))
        return
    if given.free:
        _free(int(given.free[0]), int(given.free[1]))
        return
    print(f"load before: {os.getloadavg()[0]:.1f} on {usable_cores()} cores")
    _empty(given.cases)
    _driver(given.simulated)
    _scaling(given.real, "as Dask comes", _AS_IT_COMES)
    _scaling(given.real, "as advised", ADVISED)
    _limit(given.real)


def _empty(cases: int) -> None:
    with _cluster("--nworkers", str(usable_cores()), settings=_AS_IT_COMES) as file:
        wall_s, own_s, _ = _timed(file, _suite(cases), empty, workers=usable_cores())
    print(f"empty: {1e3 * wall_s / cases:.2f} ms per case, of them the driver's {1e3 * own_s / cases:.2f} ms")


def _driver(workers: int) -> None:
    cases = 10 * workers
    hosts = ["-m", "bench.perf.cluster", "--host"]
    with (
        _scheduler(_AS_IT_COMES) as file,
        _started([*hosts, str(file), str(workers)], _AS_IT_COMES),
    ):
        wall_s, own_s, _ = _timed(file, _suite(cases), waiting, workers=workers)
    print(
        f"driver: {workers} simulated workers, {cases / wall_s:.0f} of {workers / WAIT_S:.0f} cases/s, "
        f"{1e3 * own_s / cases:.2f} ms of processor per case, {100.0 * own_s / wall_s:.0f} % of a core"
    )


def _scaling(cases: int, title: str, settings: Mapping[str, str]) -> None:
    alone = 0.0
    for workers in range(1, usable_cores() + 1):
        with _cluster("--nworkers", str(workers), settings=settings) as file:
            _timed(
                file,
                suite_from({**_MESH, "seeds": list(range(9000, 9000 + 4 * workers))}, source="perf"),
                examine,
                workers=workers,
            )  # fmt: skip (compiled kernels are loaded)
            suite = suite_from({**_MESH, "seeds": list(range(cases))}, source="perf")
            *_, pace = _timed(file, suite, examine, workers=workers)
        alone = alone or pace
        print(
            f"scaling, {title}: {workers} workers, {pace:.1f} cases/min, "
            f"{100.0 * pace / alone / workers:.0f} % of linear"
        )


def _limit(cases: int) -> None:
    environment = {**os.environ, **dict.fromkeys(SINGLE_THREADED, "1")}
    alone = 0.0
    for processes in range(1, usable_cores() + 1):
        each = str(cases // processes)
        running = [
            subprocess.Popen(  # noqa: S603 (our own interpreter)
                [sys.executable, "-m", "bench.perf.cluster", "--free", str(1000 * number), each],
                env=environment,
                stdout=subprocess.PIPE,
                text=True,
            )
            for number in range(processes)
        ]
        pace = sum(float(one.communicate()[0]) for one in running)
        alone = alone or pace
        print(
            f"limit: {processes} free processes, {pace:.1f} cases/min, "
            f"{100.0 * pace / alone / processes:.0f} % of linear"
        )


def _free(first: int, cases: int) -> None:
    """One of several processes that start together: print its cases per minute after the first."""
    suite = suite_from({**_MESH, "seeds": list(range(first, first + cases))}, source="perf")
    pace = _Pace()
    with tempfile.TemporaryDirectory() as folder:
        run_suite(suite, Path(folder) / "r", workers=1, progress=pace, examine_case=examine)
    print(pace.per_minute)


def _suite(cases: int) -> Suite:
    return suite_from({**_MESH, "seeds": list(range(cases))}, source="perf")


class _Pace:
    """Cases per minute from the first case's end, before which workers are vetted, to the last's."""

    def __init__(self) -> None:
        self.began_s = self.ended_s = (0.0, 0.0)
        self.first = self.done = 0

    def __call__(self, state: Progress) -> None:
        if state.done > self.done:
            self.ended_s, self.done = (time.perf_counter(), time.process_time()), state.done
            if not self.first:
                self.began_s, self.first = self.ended_s, self.done

    @property
    def per_minute(self) -> float:
        return 60.0 * (self.done - self.first) / (self.ended_s[0] - self.began_s[0])


def _timed(file: Path, suite: Suite, what: Examine, *, workers: int) -> tuple[float, float, float]:
    """Of a run with its tables, from its first case's end: wall time, this process's own, and the pace."""
    _await_workers(file, workers)
    pace = _Pace()
    with tempfile.TemporaryDirectory() as folder:
        run_suite(suite, Path(folder) / "r", engine=Dask(str(file), suite, say=lambda _: None), progress=pace,
                  examine_case=what)  # fmt: skip
        wall_s, own_s = (
            now - began
            for now, began in zip((time.perf_counter(), time.process_time()), pace.began_s, strict=True)
        )
    return wall_s, own_s, pace.per_minute


def _await_workers(file: Path, count: int) -> None:
    from bench.cluster.link import connect  # noqa: PLC0415

    with connect(str(file)) as client:
        client.wait_for_workers(count, timeout=_JOINED_WITHIN_S)


async def _host(file: str, count: int) -> None:
    """Many workers in one process."""
    workers = [
        Worker(scheduler_file=file, nthreads=1, host="127.0.0.1", dashboard=False) for _ in range(count)
    ]
    await asyncio.gather(*workers)
    await asyncio.gather(*(worker.finished() for worker in workers))


@contextmanager
def _cluster(*options: str, settings: Mapping[str, str]) -> Iterator[Path]:
    asked = ["-m", "distributed.cli.dask_worker", "--host", "127.0.0.1", "--nthreads", "1", "--no-dashboard"]
    with (
        _scheduler(settings) as file,
        _started([*asked, "--scheduler-file", str(file), *options], settings),
    ):
        yield file


@contextmanager
def _scheduler(settings: Mapping[str, str]) -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scheduler.json"
        asked = [
            "-m",
            "distributed.cli.dask_scheduler",
            "--host",
            "127.0.0.1",
            "--port",
            "0",
            "--no-dashboard",
        ]
        with _started([*asked, "--scheduler-file", str(file)], settings):
            while not file.exists():
                time.sleep(0.05)
            yield file


@contextmanager
def _started(arguments: list[str], settings: Mapping[str, str]) -> Iterator[None]:
    environment = {**os.environ, **dict.fromkeys(SINGLE_THREADED, "1"), **settings}
    process = subprocess.Popen(  # noqa: S603 (our own interpreter)
        [sys.executable, *arguments], env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    )
    try:
        yield
    finally:
        process.terminate()
        process.wait()


if __name__ == "__main__":
    main()
