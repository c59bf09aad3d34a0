"""What a worker does when it meets a run: it says whether it may work on it.

Sent to workers by value, for they may have no burrscan, or one that knows nothing of this. A worker that fits
offers one piece of a resource named after the run's fingerprint; cases ask for one piece. So cases go to such
workers only, to late ones too, one at a time each, and no worker of anyone else's is disturbed.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Mapping, Sequence
from typing import Any

from distributed import WorkerPlugin


class Vetting(WorkerPlugin):
    """Compares a worker with a run.

    Parameters
    ----------
    name
        Of the resource that it offers when it fits, and of the topic under which it says so or why not.
    expected, modules, renders
        The run's fingerprint, and how it was taken.
    resources
        What the worker must have been started with, such as ``{"GPU": 1}``.

    """

    def __init__(
        self,
        *,
        name: str,
        expected: Mapping[str, str],
        modules: Sequence[str],
        renders: bool,
        resources: Mapping[str, float],
    ) -> None:
        self.name = name
        self.expected = expected
        self.modules = modules
        self.renders = renders
        self.resources = resources

    async def setup(self, worker: Any) -> None:
        """Look at the worker in a thread of its own, for that reads files; then offer, and say so."""
        reason = self._lacks(worker.state.total_resources)
        reason = reason or await asyncio.to_thread(self._differs, worker.state.nthreads)
        if not reason:
            await worker.set_resources(**{self.name: 1})
        said = {"worker": worker.address, "id": worker.id, "name": str(worker.name), "refused": reason}
        worker.log_event(self.name, said)

    def _lacks(self, offered: Mapping[str, float]) -> str:
        missing = [f"{name}={n:g}" for name, n in self.resources.items() if offered.get(name, 0) < n]
        return f"it does not offer {' '.join(missing)} (dask worker --resources)" if missing else ""

    def _differs(self, threads: int) -> str:
        try:
            from bench.cluster.threads import limit_threads  # noqa: PLC0415

            if held := limit_threads(threads):
                return held
            from bench.cluster.fingerprint import difference, fingerprint  # noqa: PLC0415

            here = fingerprint(self.modules, renders=self.renders)
        except ImportError as error:
            return f"it has no burrscan that fits ({error}; {sys.executable})"
        except Exception as error:  # noqa: BLE001 (whatever stops it, it cannot work)
            return f"it cannot say what it has ({error!r})"
        return difference(self.expected, here)
