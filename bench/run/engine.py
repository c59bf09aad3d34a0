"""Who does the work of a run: processes of this machine, or a cluster (:mod:`bench.cluster`)."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Protocol

from bench.run.crew import Crew, Died
from bench.run.job import Job
from bench.run.records import Record
from bench.suites.case import Case
from scenes.renderer import choose, usable_cores

Examine = Callable[[Job, Case], list[Record]]
Outcomes = Generator[tuple[Case, list[Record] | Died], None, None]


@dataclass(frozen=True)
class Hands:
    """What a manifest says of those who did the work of a sitting.

    Parameters
    ----------
    workers
        Processes, as many as there were when it began.
    threads
        Threads each of them may use.
    renderer
        The Mitsuba variant.
    more
        Anything else worth keeping.

    """

    workers: int
    threads: int
    renderer: str
    more: dict[str, Any] = field(default_factory=dict)


class Engine(Protocol):
    """Calls a function on cases elsewhere; the caller alone writes records."""

    def hands(self, cases: int) -> Hands:
        """Who would work on that many cases."""

    @property
    def workers(self) -> int:
        """Processes that are at work now."""

    def outcomes(self, job: Job, examine: Examine, cases: Sequence[Case]) -> Outcomes:
        """Each case with its records, in the order in which they come; pictures are in place before that.

        Closing the generator stops the work. A case whose workers died again and again comes as ``Died``.

        Raises
        ------
        bench.run.crew.Obstructed
            When a machine is the reason.
        burrscan.errors.InputError
            When nobody is there to work.

        """


class Local:
    """Spawned processes of this machine.

    Parameters
    ----------
    workers
        How many; by default one per core.

    """

    def __init__(self, workers: int | None = None) -> None:
        self._wanted = workers or usable_cores()
        self._workers = 0

    @property
    def workers(self) -> int:
        """Processes at work."""
        return self._workers

    def hands(self, cases: int) -> Hands:
        """The machine's cores, shared among the processes."""
        count = max(1, min(self._wanted, cases))
        return Hands(count, max(1, usable_cores() // count), choose().variant)

    def outcomes(self, job: Job, examine: Examine, cases: Sequence[Case]) -> Outcomes:
        """As :class:`Engine` says; pictures are written by the processes themselves."""
        self._workers = max(1, min(self._wanted, len(cases)))
        threads = max(1, usable_cores() // self._workers)
        crew: Crew[Case, list[Record]] = Crew(
            partial(examine, job), cases, workers=self._workers, threads=threads
        )
        return crew.results()
