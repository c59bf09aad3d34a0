"""One connection to a scheduler, for as long as it lasts: cases go out, parcels come in."""

from __future__ import annotations

import asyncio
import concurrent.futures
import contextlib
import hashlib
import json
import queue
import time
from collections import Counter, deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import Any

import cloudpickle
from distributed import Client, Future, KilledWorker
from distributed.comm.core import CommClosedError

from bench.cluster import vetting
from bench.cluster.fingerprint import Fingerprint
from bench.cluster.parcel import Parcel, key_of, work
from bench.run.crew import Died, Obstructed
from bench.run.directory import RunDirectory
from bench.run.engine import Examine
from bench.run.job import Job
from bench.run.records import Record
from bench.suites.case import Case

_FEWEST_AHEAD, _AHEAD_PER_WORKER = 64, 4
"""Cases handed out before they are wanted: no worker waits, and a million do not fill the scheduler."""
_LISTEN_S = 0.5
"""Longest wait for an outcome before workers are looked at again."""
_COUNT_EVERY_S = 2.0
"""Between two counts of the workers: people read the number."""
_HEARD_WITHIN_S = 5.0
"""In which a worker that is there answers; later ones are met as late joiners."""
_RETRIES = 1  # of a case whose worker found its machine wanting: another's may not be
_TRIES = 2  # of a case whose workers die; each of them, more deaths than the scheduler's allowed-failures
_BATCH = 64
"""Outcomes written between two looks at the workers."""

Outcome = tuple[Case, list[Record] | Died]


class Lost(Exception):  # noqa: N818 (what happened, not what is wrong)
    """The scheduler is gone, or let go of everything."""


class Todo:
    """Cases that are still to do; it outlives a scheduler.

    When a worker dies, the scheduler suspects every case that waited there, and gives a case up that was
    suspected too often. Such cases are tried again last, one at a time: then the one that kills is alone.
    """

    def __init__(self, cases: Sequence[Case]) -> None:
        self.waiting = deque(cases)
        self.suspects: deque[Case] = deque()
        self.killed: Counter[str] = Counter()
        self.issued: Counter[str] = Counter()

    def __bool__(self) -> bool:
        """Whether any is left."""
        return bool(self.waiting or self.suspects)


class Sitting:
    """Works through ``todo`` with one client; what is not done when it ends is in ``todo`` again.

    Parameters
    ----------
    client
        Connected.
    job, examine, todo
        What is done, and with which cases.
    expected, modules, renders, resources
        Which workers may do it (:class:`bench.cluster.vetting.Vetting`).
    say
        What becomes of a line for people.

    """

    def __init__(
        self,
        client: Client,
        job: Job,
        examine: Examine,
        todo: Todo,
        *,
        expected: Fingerprint,
        modules: Sequence[str],
        renders: bool,
        resources: Mapping[str, float],
        say: Callable[[str], None],
    ) -> None:
        self._client = client
        self._job, self._examine, self._todo = job, examine, todo
        self._expected = expected
        self._say = say
        self._name = _name(expected, resources)
        self._takes = {self._name: 1, **resources}
        self._events: queue.SimpleQueue[tuple[str, Any]] = queue.SimpleQueue()
        self._out: dict[str, tuple[Case, Future[Any]]] = {}
        self._accepted: dict[str, str] = {}  # address to the process's own id: ports are used again
        self._refused: dict[str, str] = {}
        self._counted = -_COUNT_EVERY_S
        self._deserted = False  # which was said
        self.workers = 0
        self._vetting = vetting.Vetting(
            name=self._name, expected=expected, modules=modules, renders=renders, resources=resources
        )

    def outcomes(self) -> Iterator[Outcome]:
        """Cases as they end.

        Raises
        ------
        Lost
            When the scheduler is gone.
        Obstructed
            When a machine or the store is the reason, or when there are workers and every one is refused.

        """
        try:
            self._meet_workers()
            while self._todo or self._out:
                self._hand_out()
                yield from self._listen()
        except (OSError, CommClosedError) as error:
            raise Lost from error

    def leave(self) -> None:
        """Take back what is out, and tell the scheduler so where it still listens."""
        futures = [future for _, future in self._out.values()]
        for case, _ in reversed(self._out.values()):
            self._todo.waiting.appendleft(case)
        self._out.clear()
        with contextlib.suppress(Exception):  # it may be gone
            if self._client.status == "running":
                self._client.cancel(futures, force=True)

    def _meet_workers(self) -> None:
        """Have every worker looked at, late ones too; the plugin stays there and does no harm."""
        self._client.subscribe_topic(self._name, self._hear)
        cloudpickle.register_pickle_by_value(vetting)
        try:
            self._client.register_plugin(self._vetting, name=self._name)
        finally:
            cloudpickle.unregister_pickle_by_value(vetting)
        here = self._client.nthreads().keys()
        self._deserted = not here
        if self._deserted:
            self._say("note: no worker yet; cases wait for one (dask worker ADDRESS)")
        self._meet_all(here)
        with contextlib.suppress(queue.Empty):  # the others' words are under way
            while here - self._accepted.keys() - self._refused.keys():
                self._meet(self._events.get(timeout=_HEARD_WITHIN_S)[1])

    def _meet_all(self, here: AbstractSet[str]) -> None:
        """Read what was said: one that speaks while the subscription is under way is not always heard."""
        last = {words["worker"]: words for _, words in self._client.get_events(self._name)}
        for address in here & last.keys():
            self._meet(last[address])

    def _hear(self, event: tuple[float, Mapping[str, str]]) -> None:
        """On the client's own thread: a worker said whether it fits."""
        self._events.put(("worker", event[1]))

    def _hand_out(self) -> None:
        """Keep enough cases with the scheduler that it can use, and ask for, more workers than there are."""
        ahead = max(_FEWEST_AHEAD, _AHEAD_PER_WORKER * self.workers)
        while self._todo.waiting and len(self._out) < ahead:
            self._submit(self._todo.waiting.popleft())
        if not self._out and self._todo.suspects:
            self._submit(self._todo.suspects.popleft())

    def _submit(self, case: Case) -> None:
        key = key_of(self._job, self._expected, case)
        if again := self._todo.issued[case.id]:  # a key that the scheduler still knows would mean the old try
            key = f"{key}-{again}"
        self._todo.issued[case.id] += 1
        future = self._client.submit(
            work, self._job, self._examine, case,
            key=key, resources=self._takes, retries=_RETRIES, pure=False,
        )  # fmt: skip
        self._out[key] = (case, future)
        future.add_done_callback(lambda done: self._events.put(("done", done.key)))

    def _listen(self) -> Iterator[Outcome]:
        """Wait for what happens, and answer all that has."""
        if self._client.status != "running":
            raise Lost
        self._count()
        done: list[str] = []
        for what, subject in self._heard():
            if what == "worker":
                self._meet(subject)
            elif what == "done":
                done.append(subject)
            else:
                yield from self._receive(*subject)
        self._fetch([key for key in done if key in self._out])

    def _heard(self) -> Iterator[tuple[str, Any]]:
        """What happened meanwhile, or soon does; no more than one batch at a time."""
        with contextlib.suppress(queue.Empty):
            yield self._events.get(timeout=_LISTEN_S)
            for _ in range(_BATCH - 1):
                yield self._events.get_nowait()

    def _fetch(self, keys: Sequence[str]) -> None:
        """Ask for what came of cases, without waiting: a worker may die with it, and others must be heard."""
        if not keys:
            return
        wanted = {key: self._out[key][1] for key in keys}
        loop: Any = self._client.loop
        asked = self._client.gather(wanted, errors="skip", asynchronous=True)
        coming = asyncio.run_coroutine_threadsafe(asked, loop.asyncio_loop)
        coming.add_done_callback(lambda found: self._events.put(("parcels", (wanted, found))))

    def _count(self) -> None:
        if time.monotonic() - self._counted < _COUNT_EVERY_S:
            return
        here = self._client.nthreads().keys()
        if not here <= self._accepted.keys():
            self._meet_all(here)
        if not here and not self._deserted:
            self._say("note: no worker is left; cases wait for one (dask worker ADDRESS)")
        self._deserted = not here
        self.workers = len(self._accepted.keys() & here)
        self._counted = time.monotonic()
        if here and here <= self._refused.keys():
            raise Obstructed(f"every worker is refused: {next(iter(self._refused.values()))}")

    def _meet(self, said: Mapping[str, str]) -> None:
        """A worker that fits, or why it does not."""
        address = said["worker"]
        if said["refused"]:
            if address not in self._refused:
                self._refused[address] = f"worker {said['name']} ({address}): {said['refused']}"
                self._say(f"note: refused: {self._refused[address]}")
            return
        self._refused.pop(address, None)
        if self._accepted.get(address) == said["id"]:  # vetted again, for another run
            return
        others = self._accepted.keys() - {address}
        self._accepted[address] = said["id"]
        if self._out and not others & self._client.nthreads().keys():
            self._resubmit()

    def _resubmit(self) -> None:
        """The first worker that fits: what nobody could take was set aside, and is looked at no more."""
        cases = [case for case, _ in self._out.values()]
        futures = [future for _, future in self._out.values()]
        self._out.clear()
        self._client.cancel(futures, force=True)
        for case in cases:
            self._submit(case)

    def _receive(
        self, wanted: Mapping[str, Future[Any]], coming: concurrent.futures.Future[dict[str, Parcel | None]]
    ) -> Iterator[Outcome]:
        """What was fetched; what was not is looked into."""
        fetched = {} if coming.cancelled() or coming.exception() else coming.result()
        if not fetched and self._client.status != "running":
            raise Lost
        for key, future in wanted.items():
            case, current = self._out.get(key, (None, None))
            if case is None or current is not future:  # it went out anew meanwhile
                continue
            del self._out[key]
            if parcel := fetched.get(key):
                self._deserted = False  # also where the worker came and went between two counts
                self._unpack(parcel, case)
                yield case, list(parcel.records)
            elif future.status == "error":
                yield from self._failed(case, future.exception())
            else:  # its worker died with it, or somebody restarted the cluster
                self._submit(case)

    def _unpack(self, parcel: Parcel, case: Case) -> None:
        try:
            parcel.unpack(RunDirectory(self._job.out_dir).case(case.id))
        except OSError as error:  # this machine's disk, not the connection
            raise Obstructed(f"{error.filename or self._job.out_dir}: {error.strerror}") from error

    def _failed(self, case: Case, error: BaseException | None) -> Iterator[Outcome]:
        """What became of a case that has no records."""
        if isinstance(error, Obstructed):
            raise error
        if isinstance(error, KilledWorker):
            self._todo.killed[case.id] += 1
            if self._todo.killed[case.id] < _TRIES:
                self._todo.suspects.append(case)
                return
            last = getattr(error.last_worker, "address", error.last_worker)
            reason = f"its workers died whenever it was tried, the last at {last} (out of memory? a crash?)"
            yield case, Died(reason)
            return
        yield case, Died(f"no worker can do it: {type(error).__name__}: {error}")


def _name(expected: Fingerprint, resources: Mapping[str, float]) -> str:
    """The resource that workers which fit a run offer."""
    text = json.dumps([dict(expected), dict(resources)], sort_keys=True)
    return f"burrscan-{hashlib.sha256(text.encode()).hexdigest()[:12]}"
