"""Every stage's random numbers from the case's identity."""

from __future__ import annotations

import importlib
import inspect
from dataclasses import replace

from bench.suites.identity import stream
from burrscan.pipeline import Pipeline, Stage
from burrscan.variants import resolve

_KINDS = ("scan", "axis", "generatrix", "burrs")
_MOST = 2**31 - 1
"""Largest seed: of a signed 32-bit number, which every generator takes."""


def seeded(pipeline: Pipeline, identity: str) -> Pipeline:
    """The pipeline with the parameter ``seed`` of every stage that takes one and was not given one.

    Parameters
    ----------
    pipeline
        A variant's.
    identity
        The case's: 64 hexadecimal digits. So all arms of a comparison draw the same numbers on a case, and
        other numbers on the next; a fixed default would have drawn the same circles on every wheel.

    Raises
    ------
    InputError
        For a method that does not exist.

    """
    return replace(pipeline, **{kind: _seeded(getattr(pipeline, kind), kind, identity) for kind in _KINDS})


def _seeded(stage: Stage, kind: str, identity: str) -> Stage:
    methods = importlib.import_module(f"burrscan.{kind}").METHODS
    function = resolve(stage.method, methods, stage=f"{kind} method")
    if "seed" in stage.parameters or "seed" not in inspect.signature(function).parameters:
        return stage
    drawn = int(stream(identity, f"stage {kind}").integers(_MOST))
    return replace(stage, parameters={**stage.parameters, "seed": drawn})
