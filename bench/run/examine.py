"""What a worker does with a case: simulate it once, let every variant look at it, score what they say."""

from __future__ import annotations

import traceback
from pathlib import Path

from bench.run.artefacts import save_truth, save_variant
from bench.run.directory import RunDirectory
from bench.run.job import Job
from bench.run.records import Failure, Record
from bench.score.burrs import burr_tables
from bench.score.evidence import Evidence
from bench.score.metrics import failed_metrics, measure
from bench.suites.case import Case
from bench.suites.identity import entropy
from bench.suites.suite import Variant
from bench.suites.variants import pipeline_of
from burrscan.arrays import Floats32
from burrscan.linear import linear_camera
from burrscan.pipeline import run
from scenes.bound import WatchedScanner, bound_px
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate
from scenes.transport.matrix import LightTransport
from scenes.transport.store import default_folder


def examine(job: Job, case: Case) -> list[Record]:
    """Records of one case, one per variant. Whatever a stage raises becomes a failure; nothing is dropped."""
    folder = RunDirectory(job.out_dir).case(case.id)
    try:
        simulation = simulate(
            scene_from(case.document, source=case.id),
            identity=entropy(case.identity),
            cache_dir=default_folder(),
        )
        save_truth(folder, simulation.truth)
    except Exception as error:  # noqa: BLE001 (a failure is a result)
        why = failure("scene", error)
        return [failed_record(case, variant, why, own=job.own_metrics) for variant in job.variants]
    return [
        _examine_variant(case, variant, simulation, folder, own=job.own_metrics) for variant in job.variants
    ]


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
    """An exception as a record keeps it."""
    text = "".join(traceback.format_exception(error))
    return Failure(stage, f"{type(error).__name__}: {error}", text)


def _examine_variant(
    case: Case, variant: Variant, simulation: Simulation, folder: Path, *, own: tuple[str, ...]
) -> Record:
    scanner = WatchedScanner(simulation.scanner())
    try:
        outcome = run(scanner, pipeline_of(variant))
        evidence = Evidence(simulation.truth, outcome, _bound_px(simulation, scanner))
        metrics = measure(evidence, own=own)
        burrs = burr_tables(evidence)
        save_variant(folder, variant.name, evidence, linear_camera(scanner.camera).saturation_dn)
    except Exception as error:  # noqa: BLE001 (a failure is a result)
        return failed_record(case, variant, failure("pipeline", error), own=own)
    return Record(
        case=case.id,
        variant=variant.name,
        parameters=case.parameters,
        scene_hash=case.scene_hash,
        identity=case.identity,
        metrics=metrics,
        burrs=burrs,
        timings_s={**simulation.timings_s, **outcome.inspection.timings_s},
    )


def _bound_px(simulation: Simulation, scanner: WatchedScanner) -> Floats32 | None:
    """The bound of what was shown; None in colour, and where stock Mitsuba renders, which traces nothing."""
    light = simulation.light
    if simulation.bands or not isinstance(light, LightTransport):
        return None
    return bound_px(light, simulation.scene, scanner.shots)
