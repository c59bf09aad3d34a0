"""The cases of a run on a Dask cluster."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import metadata

from distributed import Client

from bench.cluster.fingerprint import fingerprint, modules_of
from bench.cluster.link import connect
from bench.cluster.sitting import Lost, Sitting, Todo
from bench.run.crew import Obstructed
from bench.run.engine import Examine, Hands, Outcomes
from bench.run.job import Job
from bench.suites.case import Case
from bench.suites.suite import Suite
from burrscan.errors import InputError
from scenes.renderer import choose

_LOG = logging.getLogger("burrscan.cluster")
_CUDA = "cuda_ad_mono"


@dataclass
class Dask:
    """An engine (:class:`bench.run.engine.Engine`) on somebody's scheduler.

    A scheduler that goes away is asked for again for ``patience_s``; then the run ends, to be resumed. What a
    worker held when it died is done by another.

    Parameters
    ----------
    scheduler
        Its address, or a scheduler file.
    suite
        What is run.
    resources
        What a case takes of its worker, such as ``{"GPU": 1}``: only workers that offer it get cases.
    patience_s
        How long a scheduler that does not answer is asked again; by default as Dask is configured.
    say
        What becomes of a line for people, such as that a worker was refused.

    """

    scheduler: str
    suite: Suite
    resources: Mapping[str, float] = field(default_factory=dict)
    patience_s: float | None = None
    say: Callable[[str], None] = _LOG.warning
    _workers: int = 0
    _hands: Hands | None = None

    @property
    def workers(self) -> int:
        """Workers that cases may go to now."""
        return self._workers

    def hands(self, cases: int) -> Hands:  # noqa: ARG002 (a cluster's size is its own business)
        """The cluster as it is when first asked after."""
        if self._hands is None:
            with self._client() as client:
                self.say(f"dashboard: {client.dashboard_link}")
                threads = list(client.nthreads().values())
            engine = {"engine": f"dask {metadata.version('distributed')}"}
            self._hands = Hands(len(threads), max(threads, default=1), self._renderer, engine)
        return self._hands

    def outcomes(self, job: Job, examine: Examine, cases: Sequence[Case]) -> Outcomes:
        """As :class:`bench.run.engine.Engine` says.

        Raises
        ------
        bench.run.crew.Obstructed
            When a machine is the reason, on two workers; when the scheduler is gone for good, or every worker
            is refused.

        """
        expected, modules = self._expected()
        todo = Todo(cases)
        while todo:
            with self._answering() as client:
                sitting = Sitting(
                    client, job, examine, todo,
                    expected=expected, modules=modules, renders=self._renders, resources=self.resources,
                    say=self.say,
                )  # fmt: skip
                yield from self._sit(sitting)

    def _sit(self, sitting: Sitting) -> Outcomes:
        """What one sitting brings, until its scheduler is gone."""
        try:
            for outcome in sitting.outcomes():
                self._workers = sitting.workers
                yield outcome
        except Lost:
            self.say(f"note: the scheduler at {self.scheduler} is gone; waiting for one to answer there")
        finally:
            sitting.leave()

    def _expected(self) -> tuple[dict[str, str], tuple[str, ...]]:
        modules = modules_of(self.suite)
        expected = fingerprint(modules, renders=False)
        return expected | ({"renderer": self._renderer} if self._renders else {}), modules

    @property
    def _renders(self) -> bool:
        return self.suite.source == "scene"

    @property
    def _renderer(self) -> str:
        """With GPUs asked for, CUDA, whatever the driver's machine has; else what the driver's has."""
        return _CUDA if "GPU" in self.resources else choose().variant

    @contextlib.contextmanager
    def _answering(self) -> Iterator[Client]:
        """A client; that nobody answers once a run has begun is no mistake of the user's."""
        with contextlib.ExitStack() as stack:
            try:
                client = stack.enter_context(self._client())
            except InputError as error:
                raise Obstructed(str(error)) from error
            yield client

    @contextlib.contextmanager
    def _client(self) -> Iterator[Client]:
        client = connect(self.scheduler, patience_s=self.patience_s)
        try:
            yield client
        finally:
            with contextlib.suppress(Exception):  # a scheduler that is gone cannot be taken leave of
                client.close(timeout=2)


def resources_from(words: Sequence[str]) -> dict[str, float]:
    """Read ``GPU=1``, as Dask's own commands do.

    Raises
    ------
    InputError
        When a word is no such thing.

    """
    found = {}
    for word in words:
        name, _, amount = word.partition("=")
        try:
            found[name] = float(amount)
        except ValueError:
            found[name] = 0.0
        if not name or not found[name] > 0.0:
            raise InputError(f"'{word}': a resource is such as GPU=1")
    return found
