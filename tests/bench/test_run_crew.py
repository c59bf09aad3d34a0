"""Workers that die are noticed, their tasks tried again, and no result is lost."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from types import ModuleType

import pytest

from bench.run.crew import Crew, Died
from scenes.renderer import THREADS_VARIABLE

HELPERS = '''
import os, signal, pathlib

def square(number):
    return number * number

def threads(_):
    return os.environ["{variable}"], os.environ["OPENBLAS_NUM_THREADS"], os.environ["NUMBA_NUM_THREADS"]

def dies_on_three(number):
    if number == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return -number

class DiesOnce:
    """Is killed the first time it meets its number."""
    def __init__(self, marker):
        self.marker = pathlib.Path(marker)
    def __call__(self, number):
        if number == 2 and not self.marker.exists():
            self.marker.touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return -number
'''


@pytest.fixture
def helpers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> ModuleType:
    """A module that spawned processes can import."""
    name = f"crew_helpers_{os.getpid()}"
    (tmp_path / f"{name}.py").write_text(HELPERS.replace("{variable}", THREADS_VARIABLE))
    monkeypatch.syspath_prepend(tmp_path)
    return __import__(name)


def test_workers_are_told_their_share_of_threads_and_the_parent_keeps_its_environment(
    helpers: ModuleType,
) -> None:
    before = dict(os.environ)
    ((_, told),) = Crew(helpers.threads, [0], workers=1, threads=3).results()
    assert told == ("3", "1", "3")
    assert dict(os.environ) == before


def test_a_task_that_kills_every_worker_is_reported_and_the_others_are_done_once(helpers: ModuleType) -> None:
    came = list(Crew(helpers.dies_on_three, range(7), workers=2, threads=1).results())
    assert sorted(task for task, _ in came) == list(range(7))
    results = dict(came)
    died = results.pop(3)
    assert isinstance(died, Died)
    assert signal.SIGKILL.name in died.reason
    assert results == {n: -n for n in range(7) if n != 3}


def test_a_task_whose_worker_was_killed_is_tried_again(helpers: ModuleType, tmp_path: Path) -> None:
    crew = Crew(helpers.DiesOnce(tmp_path / "marker"), range(4), workers=1, threads=1)
    assert dict(crew.results()) == {0: 0, 1: -1, 2: -2, 3: -3}


def test_leaving_the_loop_ends_the_workers(helpers: ModuleType) -> None:
    crew = Crew(helpers.square, range(100), workers=2, threads=1)
    results = crew.results()
    next(results)
    processes = [worker.process for worker in crew._workers]
    results.close()
    assert processes
    assert not any(process.is_alive() for process in processes)
