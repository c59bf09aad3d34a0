"""An engine for tests of what a run does with its records: no process is spawned, which takes two seconds."""

from __future__ import annotations

from collections.abc import Sequence

from bench.run.engine import Examine, Local, Outcomes
from bench.run.job import Job
from bench.suites.case import Case


class AtHand(Local):
    """One worker, which is the test's own process."""

    def __init__(self) -> None:
        super().__init__(1)

    def outcomes(self, job: Job, examine: Examine, cases: Sequence[Case]) -> Outcomes:
        """Each case with its records, one after the other."""
        for case in cases:
            yield case, examine(job, case)
