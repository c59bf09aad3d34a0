"""One case's error budget: the metrics after each stage's result was replaced by the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from bench.budget.oracle import (
    knowing,
    true_axis,
    true_burrs,
    true_generatrix,
)
from bench.score.evidence import Evidence, PartEvidence
from bench.score.metrics import failed_metrics, measure_some
from bench.score.part import MeshEvidence
from burrscan.arrays import Bools, Floats, Floats32, Ints32
from burrscan.correspondence import Correspondence
from burrscan.inspection import Inspection
from burrscan.meshing import surface
from burrscan.pipeline import Mesh, Outcome, Pipeline, inspect_surface
from burrscan.rig import Rig
from burrscan.sight import Sight, sight_of
from burrscan.surface import Surface

SUBSTITUTIONS = ("none", "decoding", "triangulation", "coverage", "axis", "generatrix", "burrs")
"""In the order of the stages: each takes the truth of that stage and of all before it.

``none``: the pipeline as it is. ``decoding``: the true columns of the pixels that the scan accepted and that
are lit. ``triangulation``: their true points (the true rig instead of the one that was told). ``coverage``:
all measurable pixels. ``axis``, ``generatrix``, ``burrs``: those results; for a synthetic mesh they alone.
"""

METRICS = (
    "depth_rms_mm", "axis_deg", "axis_offset_mm", "generatrix_rms_mm", "burr_found", "burr_angle_deg",
    "burr_height_mm", "false_calls",
)  # fmt: skip
"""What is budgeted."""

Budget = dict[str, dict[str, float]]
"""Substitution to metric to value."""

Inspected = tuple[str, Callable[[], PartEvidence]]


def scan_budget(evidence: Evidence, pipeline: Pipeline, *, rig: Rig) -> Budget:
    """The budget of a scanned case.

    Parameters
    ----------
    evidence
        Of the pipeline as it is.
    pipeline
        Whose stages after the substituted ones run again, with the same parameters.
    rig
        The rig that the scanner was told.

    Notes
    -----
    A stage that raises on what it is given counts as failed for that substitution. O(pixels) for each.

    """
    return _measured(_scan_steps(evidence, pipeline, rig))


def mesh_budget(evidence: MeshEvidence, pipeline: Pipeline, *, vertices_mm: Floats, faces: Ints32) -> Budget:
    """The budget of a synthetic mesh; its noise is nobody's stage and stays to the end."""

    def looked(inspection: Inspection) -> MeshEvidence:
        return replace(evidence, inspection=inspection)

    steps = _part_steps(evidence, pipeline, (vertices_mm, faces, None), None, looked)
    return _measured([("none", lambda: evidence), *steps])


def _measured(steps: list[Inspected]) -> Budget:
    return {name: _values(look) for name, look in steps}


def _values(look: Callable[[], PartEvidence]) -> dict[str, float]:
    try:
        return measure_some(look(), METRICS)
    except Exception:  # noqa: BLE001 (a stage under test may raise anything; that is its result)
        failed = failed_metrics()
        return {name: failed[name] for name in METRICS}


def _scan_steps(evidence: Evidence, pipeline: Pipeline, rig: Rig) -> list[Inspected]:
    truth = evidence.truth
    accepted = evidence.outcome.surface.mask & np.isfinite(truth.u_px)
    seen = np.isfinite(truth.u_px) & (truth.measurable | accepted)
    stated = evidence.outcome.scan.correspondence.sigma_u_px
    sigma = np.where(np.isfinite(stated) & accepted, stated, truth.sigma_limit_px).astype(np.float32)
    perfect, known = (_true_columns(truth.u_px, sigma, mask) for mask in (seen, accepted))
    radiance = evidence.outcome.scan.radiance
    whole = surface(perfect, truth.rig)
    mesh = (whole.vertices_mm, whole.faces, whole.vertex_sigma_mm)

    def meshed(columns: Correspondence, told: Rig) -> Evidence:
        found = surface(columns, told)
        inspection = inspect_surface(
            found.vertices_mm,
            found.faces,
            pipeline,
            sigma_mm=found.vertex_sigma_mm,
            sight=sight_of(radiance, found, told),
        )
        return _with(evidence, columns, found, inspection)

    def looked(inspection: Inspection) -> Evidence:
        return _with(evidence, perfect, whole, inspection)

    return [
        ("none", lambda: evidence),
        ("decoding", lambda: meshed(known, rig)),
        ("triangulation", lambda: meshed(known, truth.rig)),
        ("coverage", lambda: meshed(perfect, truth.rig)),
        *_part_steps(evidence, pipeline, mesh, sight_of(radiance, whole, truth.rig), looked),
    ]


def _true_columns(u_px: Floats32, sigma_px: Floats32, mask: Bools) -> Correspondence:
    columns, sigma = (np.where(mask, values, np.nan).astype(np.float32) for values in (u_px, sigma_px))
    return Correspondence(columns, sigma, mask)


def _with(evidence: Evidence, columns: Correspondence, found: Surface, inspection: Inspection) -> Evidence:
    scan = replace(evidence.outcome.scan, correspondence=columns)
    return Evidence(evidence.truth, Outcome(scan, found, inspection))


def _part_steps(
    evidence: PartEvidence,
    pipeline: Pipeline,
    mesh: Mesh,
    sight: Sight | None,
    looked: Callable[[Inspection], PartEvidence],
) -> Iterator[Inspected]:
    """Axis, generatrix and burrs replaced, one after the other."""
    pose = evidence.T_part_mesh
    axis = true_axis(pose, mesh[0])
    answers = {
        "axis": axis,
        "generatrix": true_generatrix(pose, evidence.true_generatrix_zr_mm, axis),
        "burrs": true_burrs(pose, evidence.true_burrs, axis),
    }
    for kind, answer in answers.items():
        pipeline = knowing(pipeline, kind, answer)
        yield kind, partial(_inspected, pipeline, mesh, sight, looked)


def _inspected(
    pipeline: Pipeline,
    mesh: Mesh,
    sight: Sight | None,
    looked: Callable[[Inspection], PartEvidence],
) -> PartEvidence:
    vertices_mm, faces, sigma_mm = mesh
    return looked(inspect_surface(vertices_mm, faces, pipeline, sigma_mm=sigma_mm, sight=sight))
