"""Cases that cost nothing, or only time: what is left is the engine's own."""

from __future__ import annotations

import time

from bench.run.job import Job
from bench.run.records import Record
from bench.score.metrics import failed_metrics
from bench.suites.case import Case

WAIT_S = 2.0
"""What a simulated case takes: long beside the engine's own milliseconds."""


def empty(job: Job, case: Case) -> list[Record]:
    """A full record per variant, at once."""
    return [
        Record(case.id, variant.name, case.parameters, case.scene_hash, case.identity, failed_metrics())
        for variant in job.variants
    ]


def waiting(job: Job, case: Case) -> list[Record]:
    """The same after :data:`WAIT_S` of doing nothing, so that hundreds of workers fit on a machine."""
    time.sleep(WAIT_S)
    return empty(job, case)
