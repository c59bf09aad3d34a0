"""The whole path, stage by stage, each stage a variant: scan, surface, axis, generatrix, burrs."""

from __future__ import annotations

import functools
import importlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis.api import FEWEST, checked_mesh, refuse_flat
from burrscan.axis.basis import T_part_mesh
from burrscan.axis.checks import axis_checks
from burrscan.axis.sense import in_sense
from burrscan.burrs.agreement import agreed
from burrscan.correspondence import Scan
from burrscan.documents import STRICT
from burrscan.drawing import Sampled, sampled
from burrscan.errors import InputError
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Axis, Check, Generatrix, Inspection
from burrscan.scanner import Scanner
from burrscan.sideways import by_columns
from burrscan.sight import Sight, sight_of
from burrscan.strays import WILD, beyond
from burrscan.surface import Surface
from burrscan.variants import check_call, check_parameters, resolve, takes
from burrscan.welding import welded

Mesh = tuple[Floats, Ints32, Floats | None]
"""Vertices, faces, standard deviations."""
_NOTE = "raised in stage "
_CALLS = {
    "scan": (("scanner",), ()),
    "axis": (("vertices_mm", "faces"), ("sigma_mm",)),
    "generatrix": (("vertices_mm", "faces", "axis"), ("sigma_mm",)),
    "burrs": (("vertices_mm", "faces", "axis", "generatrix"), ("sigma_mm",)),
}
"""By what every stage is called: arguments by place, arguments by name."""


@dataclass(frozen=True)
class Stage:
    """One stage of the pipeline.

    Parameters
    ----------
    method
        A short name, or ``"module:function"`` of anyone's package.
    parameters
        Keyword parameters of that function.

    """

    method: str
    parameters: Mapping[str, Any] = field(default_factory=dict)

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class Pipeline:
    """Which variant does what; in TOML ``axis = {method = "seed", parameters = {planes = 20}}``."""

    scan: Stage = field(default_factory=lambda: Stage("adaptive"))
    axis: Stage = field(default_factory=lambda: Stage("profile"))
    generatrix: Stage = field(default_factory=lambda: Stage("curve"))
    burrs: Stage = field(default_factory=lambda: Stage("residual"))

    __pydantic_config__ = STRICT


@dataclass(frozen=True)
class Outcome:
    """What a run of the whole path gives.

    Parameters
    ----------
    scan, surface
        What was measured.
    inspection
        What was found on it; its timings cover every stage, scan and surface included.

    """

    scan: Scan
    surface: Surface
    inspection: Inspection


def stage_function(stage: Stage, kind: str) -> Callable[..., Any]:
    """The function of a stage with its parameters bound.

    Parameters
    ----------
    stage
        The variant.
    kind
        ``"scan"``, ``"axis"``, ``"generatrix"`` or ``"burrs"``: the package whose short names apply.

    Raises
    ------
    InputError
        For an unknown method or parameter, or a function that cannot be called as the stage calls it.

    """
    methods = importlib.import_module(f"burrscan.{kind}").METHODS
    function = resolve(stage.method, methods, stage=f"{kind} method")
    name = f"{kind} method '{stage.method}'"
    check_parameters(function, stage.parameters, stage=name)
    check_call(function, *_CALLS[kind], stage.parameters, stage=name)
    return functools.partial(function, **stage.parameters)


def stage_of(error: BaseException) -> str:
    """The stage that raised an error (:func:`run` notes it), empty where none is known."""
    notes = [note for note in getattr(error, "__notes__", ()) if note.startswith(_NOTE)]
    return notes[0].removeprefix(_NOTE) if notes else ""


def check(pipeline: Pipeline) -> None:
    """Refuse a pipeline with an unknown method or parameter, before anything runs.

    Raises
    ------
    InputError
        For the first such stage.

    """
    for kind in ("scan", "axis", "generatrix", "burrs"):
        stage_function(getattr(pipeline, kind), kind)


def run(scanner: Scanner, pipeline: Pipeline) -> Outcome:
    """Scan, mesh and inspect.

    Parameters
    ----------
    scanner
        The instrument. Where its baseline runs along its projector's columns, the scan counts the projector's
        raster a quarter turn on (:mod:`burrscan.sideways`).
    pipeline
        Which variant does what.

    Raises
    ------
    InputError
        For an unknown variant, or a scan that holds no measurable surface of revolution.

    """
    from burrscan.meshing import surface as surface_of  # noqa: PLC0415 (numba kernels a mesh user never needs)

    check(pipeline)
    scanner = by_columns(scanner)
    timings: dict[str, float] = {}
    scan = _timed(timings, "scan", stage_function(pipeline.scan, "scan"), scanner)
    _noted("scan", _typed, scan, Scan, f"scan method '{pipeline.scan.method}'")
    surface = _timed(timings, "surface", surface_of, scan.correspondence, scanner.rig, radiance=scan.radiance)
    inspection = inspect_surface(
        surface.vertices_mm,
        surface.faces,
        pipeline,
        sigma_mm=surface.vertex_sigma_mm,
        sight=sight_of(scan.radiance, surface, scanner.rig),
    )
    return Outcome(scan, surface, replace(inspection, timings_s={**timings, **inspection.timings_s}))


def inspect_surface(
    vertices_mm: Floats,
    faces: Ints32,
    pipeline: Pipeline,
    *,
    sigma_mm: Floats | float | None = None,
    sight: Sight | None = None,
) -> Inspection:
    """Find axis, generatrix and burrs on a mesh.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3) mesh; vertices that are NaN are set aside, with the faces that use them. A cloud has
        no faces.
    pipeline
        Its axis, generatrix and burrs stages.
    sigma_mm
        Stated standard deviation of the vertices, one or (V,). Unless every vertex has its own, as in a scan,
        a mesh whose facets are those of a drawing is sampled before its generatrix and its burrs are looked
        for (:mod:`burrscan.drawing`).
    sight
        What a scan saw besides, in the frame of the vertices, for a burrs method that has a parameter
        of that name.

    Raises
    ------
    InputError
        For an unknown variant, or a mesh that is no surface of revolution.

    Notes
    -----
    O(V + T).

    """
    vertices, used, sigma, row = _noted("surface", _usable, vertices_mm, faces, sigma_mm)
    timings: dict[str, float] = {}

    def stage(kind: str, mesh: Mesh, *given: Any) -> Any:
        function = stage_function(getattr(pipeline, kind), kind)
        seen = {"sight": sight} if kind == "burrs" and takes(function, "sight") else {}
        return _timed(timings, kind, function, *mesh[:2], *given, sigma_mm=mesh[2], **seen)

    mesh: Mesh = (vertices, used, sigma)
    axis = _noted("axis", in_sense, stage("axis", mesh), method=pipeline.axis.method)
    # One sigma for all is a word about a drawing as well; a scan's are its vertices' own.
    drawing = (
        _timed(
            timings,
            "facets",
            sampled,
            vertices,
            used,
            axis,
            sigma_mm=0.0 if sigma_mm is None else float(sigma_mm),
        )
        if np.ndim(0.0 if sigma_mm is None else sigma_mm) == 0
        else None
    )
    if drawing is not None:
        mesh = (drawing.vertices_mm, drawing.faces, drawing.sigma_mm)
    generatrix = stage("generatrix", mesh, axis)
    _noted("generatrix", _typed, generatrix, Generatrix, f"generatrix method '{pipeline.generatrix.method}'")
    frame = T_part_mesh(axis.point_mm, axis.direction)
    burrs = _noted(
        "burrs", agreed, stage("burrs", mesh, axis, generatrix), frame, method=pipeline.burrs.method
    )
    start = time.perf_counter()
    deviation = deviation_mm(vertices, axis, generatrix)
    timings["deviation"] = time.perf_counter() - start
    checks = _timed(timings, "checks", _checks, vertices, used, axis, deviation, drawing, generatrix)
    return Inspection(
        axis=axis,
        generatrix=generatrix,
        burrs=burrs,
        T_part_mesh=frame,
        deviation_mm=np.append(deviation, np.nan)[row],
        checks=checks,
        timings_s=timings,
    )


def _usable(
    vertices_mm: Floats, faces: Ints32, sigma_mm: Floats | float | None
) -> tuple[Floats, Ints32, Floats | None, Ints32]:
    """Vertices that are numbers and no strays, each place once; the faces between them; their sigma.

    Last which of them stands for each given vertex, -1 where none does.
    """
    vertices, triangles = checked_mesh(vertices_mm, faces)
    known: Bools = np.isfinite(vertices[:, 0] + vertices[:, 1] + vertices[:, 2])
    known[known] = ~beyond(vertices[known], times=WILD)
    sigma = _per_vertex(sigma_mm, len(vertices))
    if sigma is not None:
        known &= np.isfinite(sigma) & (sigma > 0.0)
    number = np.cumsum(known, dtype=np.int32) - np.int32(1)
    if not known.all():
        triangles = number[triangles[known[triangles].all(axis=1)]]
        vertices, sigma = vertices[known], None if sigma is None else sigma[known]
    vertices, triangles, sigma, place = welded(vertices, triangles, sigma)
    if len(vertices) < FEWEST:
        raise InputError(
            f"only {len(vertices)} usable vertices: an inspection needs at least {FEWEST}; "
            "is the scan empty, or the wrong part of it selected?"
        )
    refuse_flat(vertices)
    return vertices, triangles, sigma, np.where(known, place[number], np.int32(-1))


def _per_vertex(sigma_mm: Floats | float | None, count: int) -> Floats | None:
    if sigma_mm is None:
        return None
    sigma = np.asarray(sigma_mm, dtype=np.float64)
    if sigma.shape not in {(), (count,)}:
        raise InputError(f"sigma_mm must be one number or one per vertex, ({count},), not {sigma.shape}")
    return np.array(np.broadcast_to(sigma, (count,)))


def _checks(
    vertices: Floats,
    faces: Ints32,
    axis: Axis,
    deviation: Floats,
    drawing: Sampled | None,
    generatrix: Generatrix,
) -> tuple[Check, ...]:
    """The secondary tests; of a drawing on its samples, for its own vertices crowd at corners and burrs."""
    if drawing is None:
        return axis_checks(vertices, faces, axis, deviation_mm=deviation)
    spread = deviation_mm(drawing.vertices_mm, axis, generatrix)
    checks = axis_checks(drawing.vertices_mm, np.empty((0, 3), np.int32), axis, deviation_mm=spread)
    return (*checks, drawing.check(axis))


def _typed(result: Any, wanted: type, method: str) -> None:
    """Refuse what a stage returned if it is something else than it should be."""
    if not isinstance(result, wanted):
        raise InputError(f"{method}: must return a burrscan.{wanted.__name__}, not {type(result).__name__}")


def _timed(
    timings: dict[str, float], name: str, function: Callable[..., Any], *args: Any, **kwargs: Any
) -> Any:
    start = time.perf_counter()
    result = _noted(name, function, *args, **kwargs)
    timings[name] = time.perf_counter() - start
    return result


def _noted(name: str, function: Callable[..., Any], *args: Any, **kwargs: Any) -> Any:
    """Call a stage; what it raises says which stage that was, its message left as it is."""
    try:
        return function(*args, **kwargs)
    except Exception as error:
        error.add_note(f"{_NOTE}{name}")
        raise
