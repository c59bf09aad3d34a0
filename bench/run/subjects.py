"""What a case is made into: something that any pipeline can look at, and the evidence that comes of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bench.budget.budget import Budget, mesh_budget, scan_budget
from bench.cell.spec import cell_from
from bench.cell.story import keep, told
from bench.run.artefacts import save_mesh_truth, save_mesh_variant, save_truth, save_variant
from bench.run.job import Job
from bench.score.evidence import Evidence, PartEvidence
from bench.score.part import MeshEvidence, MeshTruth
from bench.suites.case import Case
from bench.suites.identity import entropy
from bench.suites.sources import Source
from bench.synthetic.axis_bound import cramer_rao_covariance
from bench.synthetic.revolution import RidgeBurr
from bench.synthetic.spec import MeshSpec, mesh_from, scanned
from burrscan.arrays import Bools, Floats
from burrscan.linear import linear_camera
from burrscan.pipeline import Pipeline, inspect_surface, run
from burrscan.sideways import by_columns
from scenes.bound import Bounds, bounds_of
from scenes.detectability import burr_dprimes, dprime_squared, other_side
from scenes.light import Light
from scenes.scene import SceneSpec, scene_from
from scenes.shots import WatchedScanner
from scenes.simulate import Simulation, simulate
from scenes.stores import Store
from scenes.transport.matrix import LightTransport
from scenes.transport.store import NOWHERE, default_folder
from scenes.wheel import TrueBurr
from scenes.wheel.spec import BurrSpec


@dataclass(frozen=True)
class Look:
    """What one pipeline made of a case.

    Parameters
    ----------
    evidence
        For the metrics.
    timings_s
        Wall time per stage.
    keep
        Writes its pictures and maps to a case's folder, under a variant's name.
    budget
        Re-runs its stages with the truth of those before.

    """

    evidence: PartEvidence
    timings_s: Mapping[str, float]
    keep: Callable[[Path, str], None]
    budget: Callable[[], Budget]


Subject = Callable[[Pipeline], Look]


def scene_subject(job: Job, case: Case, folder: Path) -> Subject:
    """Simulate a scene once; its truth goes to the case's folder, its light to the job's ``transports``."""
    scene, identity, store = scene_from(case.document, source=case.id), entropy(case.identity), _place(job)
    simulation = simulate(scene, identity=identity, cache_dir=store)
    save_truth(folder, simulation.truth)
    others = _others(scene, identity, store) if job.detectability and scene.burrs else None
    return lambda pipeline: _scan(simulation, pipeline, others)


def mesh_subject(_job: Job, case: Case, folder: Path) -> Subject:
    """Make a synthetic mesh once; its truth goes to the case's folder. It needs no light."""
    start = time.perf_counter()
    spec = mesh_from(case.document, source=case.id)
    scan = scanned(spec, identity=entropy(case.identity))
    truth = MeshTruth(
        T_part_mesh=np.linalg.inv(scan.T_mesh_part).astype(float),
        generatrix_zr_mm=spec.profile_zr_mm,
        burrs=tuple(_true_burr(burr, spec) for burr in spec.burrs),
        axis_bound=_bound(spec),
    )
    save_mesh_truth(folder, truth, scan.vertices_mm)
    made_s = time.perf_counter() - start

    def look(pipeline: Pipeline) -> Look:
        inspection = inspect_surface(scan.vertices_mm, scan.faces, pipeline)
        evidence = MeshEvidence(truth, inspection)
        return Look(
            evidence,
            {"mesh": made_s, **inspection.timings_s},
            lambda where, variant: save_mesh_variant(where, variant, evidence, scan.vertices_mm, scan.faces),
            lambda: mesh_budget(evidence, pipeline, vertices_mm=scan.vertices_mm, faces=scan.faces),
        )

    return look


def cell_subject(job: Job, case: Case, folder: Path) -> Subject:
    """A scene in a cell; every pipeline begins anew, for the part is not the same when it is done."""
    start = time.perf_counter()
    cell, identity = cell_from(case.document, source=case.id), entropy(case.identity)

    def look(pipeline: Pipeline) -> Look:
        story = told(cell, pipeline, identity=identity, cache_dir=_place(job))
        evidence = story.evidence

        def kept(where: Path, variant: str) -> None:
            save_mesh_truth(folder, evidence.truth, story.vertices_mm)
            save_mesh_variant(where, variant, evidence, story.vertices_mm, story.faces)
            keep(story, where, variant)

        return Look(evidence, {"cell": time.perf_counter() - start}, kept, dict)

    return look


SUBJECTS: dict[Source, Callable[[Job, Case, Path], Subject]] = {
    "scene": scene_subject,
    "mesh": mesh_subject,
    "cell": cell_subject,
}
"""By a suite's source, how a case is made."""


def _place(job: Job) -> Path | Store | None:
    if job.transports == NOWHERE:
        return None
    return Store(job.transports) if job.transports else default_folder()


class _Others(NamedTuple):
    """Light of a scene without its burrs, and of one with them on the other side of the surface.

    ``turned`` says of each burr whether it has another side.
    """

    bare: Light
    reversed: Light | None
    turned: Bools


def _others(scene: SceneSpec, identity: tuple[int, ...], store: Path | Store | None) -> _Others:
    other = [other_side(burr) for burr in scene.burrs]
    turned = np.array([burr is not None for burr in other])
    swapped = tuple(new or old for new, old in zip(other, scene.burrs, strict=True))

    def light(burrs: tuple[BurrSpec, ...]) -> Light:
        return simulate(replace(scene, burr=burrs), identity=identity, cache_dir=store).light

    return _Others(light(()), light(swapped) if turned.any() else None, turned)


def _scan(simulation: Simulation, pipeline: Pipeline, others: _Others | None) -> Look:
    scanner = WatchedScanner(by_columns(simulation.scanner()))
    outcome = run(scanner, pipeline)
    dprimes = _dprimes(simulation, scanner, others.bare if others else None)
    side = np.array(_dprimes(simulation, scanner, others.reversed if others else None))
    if others and len(side):
        side[~others.turned] = np.nan
    bounds = _scan_bounds(simulation, scanner)
    evidence = Evidence(simulation.truth, outcome, bounds, dprimes, tuple(side.tolist()))
    white_dn = linear_camera(scanner.camera).saturation_dn
    return Look(
        evidence,
        {**simulation.timings_s, **outcome.inspection.timings_s},
        lambda where, variant: save_variant(where, variant, evidence, white_dn),
        lambda: scan_budget(evidence, pipeline, rig=scanner.rig),
    )


def _scan_bounds(simulation: Simulation, scanner: WatchedScanner) -> Bounds | None:
    """The bounds of what was shown; None in colour, and where stock Mitsuba renders, which traces nothing."""
    light = simulation.light
    if simulation.bands or not isinstance(light, LightTransport):
        return None
    return bounds_of(light, simulation.scene, scanner.shots)


def _dprimes(simulation: Simulation, scanner: WatchedScanner, other: Light | None) -> tuple[float, ...]:
    """Detectability of each burr by what was shown; empty where it was not asked for or cannot be known."""
    light = simulation.light
    if simulation.bands or not isinstance(light, LightTransport) or not isinstance(other, LightTransport):
        return ()
    return burr_dprimes(simulation.truth, dprime_squared(light, other, simulation.scene, scanner.shots))


def _bound(spec: MeshSpec) -> Floats | None:
    """The axis's bound; none where there is no noise, and for independent noise only."""
    if spec.sigma_mm == 0.0 or spec.correlated_over > 1:
        return None
    return cramer_rao_covariance(
        spec.profile_zr_mm,
        arc_deg=spec.arc_deg,
        shape=(spec.around, spec.along),
        sigma_mm=spec.scale * spec.sigma_mm,
    )


def _true_burr(burr: RidgeBurr, spec: MeshSpec) -> TrueBurr:
    """A ridge as it is: its extent ends where the part does, its base is an arc of the radius there."""
    z, r = spec.profile_zr_mm.T
    start, end = (
        float(np.clip(spec.scale * end_mm, z.min(), z.max())) for end_mm in (burr.z_start_mm, burr.z_end_mm)
    )
    width = float(np.radians(burr.width_deg) * np.mean(r))
    height, length = spec.scale * burr.height_mm, end - start
    ridge = np.zeros((0, 3))
    return TrueBurr(
        kind="axial_ridge", side="protrusion", angle_deg=burr.angle_deg, z_start_mm=start, z_end_mm=end,
        height_mm=height, width_mm=width, length_mm=length, area_mm2=0.5 * width * height,
        volume_mm3=0.5 * width * height * length, ridge_mm=ridge, deviation_mm=np.zeros(0),
        arc_deg=burr.width_deg,
    )  # fmt: skip
