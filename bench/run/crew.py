"""A crew of spawned processes that work through tasks, and notices when one of them dies.

Python's own pools stop, hang or lose a task when a worker is killed. Here every worker has a pipe of its own;
a pipe that closes names the worker and the task it held. The task is given to a fresh process once more, and
only a second death is a result.
"""

from __future__ import annotations

import os
import signal
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from multiprocessing import get_context, resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from typing import Any, Generic, TypeVar

from bench.memory import keep_freed
from scenes.renderer import THREADS_VARIABLE

Task = TypeVar("Task")
Result = TypeVar("Result")

SINGLE_THREADED = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
"""What BLAS reads when it is loaded."""

_ATTEMPTS = 2
"""At a case whose worker died: the machine may have killed it for another's memory; twice is its doing."""
_PATIENCE_S = 5.0
"""That a worker told to end is waited for before it is killed."""


@dataclass(frozen=True)
class Died:
    """The outcome of a task whose worker died every time it was tried."""

    reason: str


class Obstructed(Exception):  # noqa: N818 (the machine's error, not the task's)
    """A worker's function raises it when the machine is the reason: the crew stops, and raises it."""


@dataclass
class _Job(Generic[Task]):
    task: Task
    attempts: int = 0


@dataclass
class _Worker(Generic[Task]):
    process: SpawnProcess
    connection: Connection
    job: _Job[Task]


class Crew(Generic[Task, Result]):
    """Calls ``function`` on every task in spawned processes.

    Parameters
    ----------
    function
        Importable; it turns the exceptions it expects into results. One that escapes ends its worker.
    tasks
        Picklable.
    workers
        Processes at work at a time.
    threads
        Threads each of them may use. BLAS gets one in any case, so that sums do not depend on the number.

    """

    def __init__(
        self, function: Callable[[Task], Result], tasks: Iterable[Task], *, workers: int, threads: int
    ) -> None:
        self._function = function
        self._pending = deque(_Job(task) for task in tasks)
        self._size = workers
        self._threads = threads
        self._workers: list[_Worker[Task]] = []

    def results(self) -> Generator[tuple[Task, Result | Died], None, None]:
        """What comes back, in the order in which it does. Leaving the loop early stops the crew.

        Raises
        ------
        Obstructed
            When a worker raised it.

        """
        try:
            while self._start_workers():
                pipes = {id(worker.connection): worker for worker in self._workers}
                for pipe in wait([worker.connection for worker in self._workers]):
                    yield from self._listen(pipes[id(pipe)])
        finally:
            for worker in self._workers:
                worker.process.terminate()
            for worker in list(self._workers):
                self._dismiss(worker)

    def _start_workers(self) -> bool:
        """Start workers up to the number wanted; False when nothing is left to do."""
        while self._pending and len(self._workers) < self._size:
            ours, theirs = get_context("spawn").Pipe()
            process = get_context("spawn").Process(target=_serve, args=(theirs, self._function), daemon=True)
            with _environment(self._threads), _no_interrupt():
                process.start()
            theirs.close()  # so that our end reports the worker's death
            worker = _Worker(process, ours, self._pending.popleft())
            self._workers.append(worker)
            _send(worker, worker.job.task)
        return bool(self._workers)

    def _listen(self, worker: _Worker[Task]) -> Iterator[tuple[Task, Result | Died]]:
        try:
            result: Result | Obstructed = worker.connection.recv()
        except (EOFError, OSError):
            yield from self._handle_death(worker)
            return
        if isinstance(result, Obstructed):
            raise result
        done = worker.job
        if self._pending:
            worker.job = self._pending.popleft()
            _send(worker, worker.job.task)
        else:
            _send(worker, None)
            self._dismiss(worker)
        yield done.task, result

    def _handle_death(self, worker: _Worker[Task]) -> Iterator[tuple[Task, Died]]:
        """Give a dead worker's task to another, or give it up."""
        self._dismiss(worker)
        job = worker.job
        job.attempts += 1
        if job.attempts < _ATTEMPTS:
            self._pending.appendleft(job)
        else:
            yield job.task, Died(_cause_of_death(worker.process.exitcode, job.attempts))

    def _dismiss(self, worker: _Worker[Task]) -> None:
        self._workers.remove(worker)
        worker.connection.close()
        worker.process.join(_PATIENCE_S)
        if worker.process.is_alive():
            worker.process.kill()
            worker.process.join()


def _serve(connection: Connection, function: Callable[[Any], Any]) -> None:
    """A worker's life: until there is no further task, or nobody at the other end."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the parent's to answer
    keep_freed()
    with suppress(EOFError, ConnectionError):
        while (task := connection.recv()) is not None:
            connection.send(_outcome(function, task))


def _outcome(function: Callable[[Any], Any], task: Any) -> Any:
    try:
        return function(task)
    except Obstructed as error:
        return error


def _send(worker: _Worker[Task], message: Task | None) -> None:
    with suppress(OSError):  # a worker that is dead already is noticed when it is listened to
        worker.connection.send(message)


def _cause_of_death(code: int | None, attempts: int) -> str:
    how = (
        f"was killed by {signal.Signals(-code).name}"
        if code is not None and code < 0
        else f"ended with {code}"
    )
    return f"the worker process {how}, {attempts} times (out of memory? a crash in a library?)"


@contextmanager
def _no_interrupt() -> Iterator[None]:
    """Processes started in the block never see Ctrl-C, not even while they import; ours comes after it."""
    resource_tracker.ensure_running()  # starting it would lift the block
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _environment(threads: int) -> Iterator[None]:
    """Set the thread limits that libraries read when they are first imported."""
    limits = dict.fromkeys(SINGLE_THREADED, "1")
    limits |= {"NUMBA_NUM_THREADS": str(threads), THREADS_VARIABLE: str(threads)}
    before = {name: os.environ.get(name) for name in limits}
    os.environ.update(limits)
    try:
        yield
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value
