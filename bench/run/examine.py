"""What a worker does with a case: make it once, let every variant look at it, score what they say."""

from __future__ import annotations

import os
import sys
import traceback
from pathlib import Path

from bench.run.crew import Obstructed
from bench.run.directory import RunDirectory
from bench.run.draws import seeded
from bench.run.job import Job
from bench.run.machine import of_the_machine
from bench.run.records import Failure, Record
from bench.run.subjects import SUBJECTS, Subject
from bench.score.burrs import burr_tables
from bench.score.metrics import failed_metrics, measure
from bench.suites.case import Case
from bench.suites.suite import Variant
from bench.suites.variants import pipeline_of
from burrscan.documents import printable
from burrscan.pipeline import stage_of


def examine(job: Job, case: Case) -> list[Record]:
    """Records of one case, one per variant. Whatever a stage raises becomes a failure; nothing is dropped.

    Raises
    ------
    bench.run.crew.Obstructed
        When the machine is the reason (:mod:`bench.run.machine`), which is no result of any variant.

    """
    folder = RunDirectory(job.out_dir).case(case.id)
    try:
        subject = SUBJECTS[job.source](job, case, folder)
    except Exception as error:  # noqa: BLE001 (a failure is a result)
        why = failure(job.source, error)
        return [failed_record(case, variant, why, own=job.own_metrics) for variant in job.variants]
    return [_examine_variant(job, case, variant, subject, folder) for variant in job.variants]


def failed_record(case: Case, variant: Variant, why: Failure, *, own: tuple[str, ...] = ()) -> Record:
    """A record without a result, counted in every metric."""
    return Record(
        case=case.id,
        variant=variant.name,
        parameters=case.parameters,
        scene_hash=case.scene_hash,
        identity=case.identity,
        metrics=failed_metrics(own=own),
        failure=why,
    )


def failure(stage: str, error: Exception) -> Failure:
    """An exception as a record keeps it; raises Obstructed where the machine is its reason."""
    if reason := of_the_machine(error):
        raise Obstructed(reason) from error
    text = "".join(traceback.format_exception(error))
    said = f"{type(error).__name__}: {error}"
    return Failure(stage, printable(said), printable(without_roots(text)))


def without_roots(text: str) -> str:
    """A traceback whose files are named from where they are imported: records leave the machine."""
    roots = {str(Path(path).absolute()) for path in sys.path} - {os.sep}
    for root in sorted(roots, key=len, reverse=True):
        text = text.replace(f'"{root}{os.sep}', '"')
    return text


def _examine_variant(job: Job, case: Case, variant: Variant, subject: Subject, folder: Path) -> Record:
    stage = "pipeline"
    try:
        look = subject(seeded(pipeline_of(variant), case.identity))
        stage = "score"
        metrics = measure(look.evidence, own=job.own_metrics)
        burrs = burr_tables(look.evidence)
        look.keep(folder, variant.name)
        budget = look.budget() if variant.name in job.budgeted else {}
    except Exception as error:  # noqa: BLE001 (a failure is a result)
        return failed_record(case, variant, failure(stage_of(error) or stage, error), own=job.own_metrics)
    return Record(
        case=case.id,
        variant=variant.name,
        parameters=case.parameters,
        scene_hash=case.scene_hash,
        identity=case.identity,
        metrics=metrics,
        burrs=burrs,
        timings_s=look.timings_s,
        budget=budget,
    )
