"""burrscan's Python face: three functions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from burrscan.arrays import Floats
from burrscan.datum import Datum, referred_to
from burrscan.errors import InputError
from burrscan.inspection import Inspection
from burrscan.pipeline import Pipeline, Stage, inspect_surface, run
from burrscan.scanner import Scanner


def inspect(scanner: Scanner, *, pipeline: Pipeline | None = None, datum: Datum | None = None) -> Inspection:
    """Scan a part and find its axis, its generatrix and its burrs.

    Parameters
    ----------
    scanner
        Anything with a rig, two data sheets and ``capture``.
    pipeline
        Which variant does what; the defaults are the best there are.
    datum
        What angles and z count from; by the frame of the camera where None.

    Raises
    ------
    burrscan.InputError
        When the scanner or the pipeline cannot be used, or the scan shows no surface of revolution.

    """
    return _referred(run(scanner, pipeline or Pipeline()).inspection, datum)


def inspect_mesh(
    vertices: ArrayLike,
    faces: ArrayLike | None = None,
    *,
    sigma_mm: Floats | float | None = None,
    axis: str | Stage = "profile",
    generatrix: str | Stage = "curve",
    burrs: str | Stage = "residual",
    limit_mm: float | None = None,
    datum: Datum | None = None,
) -> Inspection:
    """Find the axis, the generatrix and the burrs of a mesh.

    Parameters
    ----------
    vertices
        (V, 3) millimetres; NaN where there is none.
    faces
        (T, 3) indices, counter-clockwise seen from outside; None for a cloud.
    sigma_mm
        Standard deviation of the vertices, one or (V,), where known.
    axis, generatrix, burrs
        A method's short name, ``"module:function"``, or a :class:`Stage` with parameters.
    limit_mm
        Largest permitted burr (ISO 13715); each burr then carries a verdict.
    datum
        What angles and z count from; by the frame of the mesh where None (see
        :attr:`burrscan.Inspection.T_part_mesh`).

    Returns
    -------
    Inspection
        With ``deviation_mm`` per vertex.

    Raises
    ------
    burrscan.InputError
        When the mesh cannot be used, a method or parameter is unknown, or the datum does not fit.

    Examples
    --------
    >>> inspection = burrscan.inspect_mesh(vertices, faces, axis="seed", limit_mm=0.5)  # doctest: +SKIP

    """
    stages = {"axis": _stage(axis), "generatrix": _stage(generatrix), "burrs": _stage(burrs)}
    if limit_mm is not None:
        if not (np.isfinite(limit_mm) and limit_mm >= 0.0):
            raise InputError(f"limit_mm is {limit_mm}: a size limit is a length in mm, zero or more")
        stages["burrs"] = _with(stages["burrs"], {"limit_mm": limit_mm})
    inspection = inspect_surface(
        np.asarray(vertices, dtype=np.float64),
        np.empty((0, 3), np.int32) if faces is None else np.asarray(faces, dtype=np.int32),
        Pipeline(**stages),
        sigma_mm=sigma_mm,
    )
    return _referred(inspection, datum)


def _referred(inspection: Inspection, datum: Datum | None) -> Inspection:
    return inspection if datum is None else referred_to(inspection, datum)


def _stage(method: str | Stage) -> Stage:
    return Stage(method) if isinstance(method, str) else method


def _with(stage: Stage, parameters: Mapping[str, Any]) -> Stage:
    return replace(stage, parameters={**stage.parameters, **parameters})
