"""From a suite's variant to the pipeline it means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from bench.suites.suite import Variant, refuse
from burrscan.documents import build
from burrscan.errors import InputError
from burrscan.pipeline import Pipeline, stage_function


def pipeline_of(variant: Variant) -> Pipeline:
    """The pipeline of a variant.

    Raises
    ------
    burrscan.errors.InputError
        When it names stages, methods or parameters that do not exist.

    """
    source = f"variant '{variant.name}'"
    pipeline = build(
        Pipeline, {kind: _table(choice) for kind, choice in variant.stages.items()}, source=source
    )
    problems = [_problem(pipeline, stage.name) for stage in fields(Pipeline)]
    refuse([problem for problem in problems if problem], source)
    return pipeline


def _table(choice: str | Mapping[str, Any]) -> Mapping[str, Any]:
    return {"method": choice} if isinstance(choice, str) else choice


def _problem(pipeline: Pipeline, kind: str) -> str:
    try:
        stage_function(getattr(pipeline, kind), kind)
    except InputError as error:
        return str(error)
    return ""
