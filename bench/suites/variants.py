"""From a suite's variant to the pipeline it means."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

from bench.suites.suite import Variant
from burrscan.documents import build, problems_of, refuse
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
    tables = {kind: _table(choice) for kind, choice in variant.stages.items()}
    problems: list[str] = []
    try:
        pipeline = build(Pipeline, tables, source=source)
    except InputError as error:
        problems = problems_of(error)
        wrong = {problem.partition(":")[0].partition(".")[0] for problem in problems}
        pipeline = build(Pipeline, {k: table for k, table in tables.items() if k not in wrong}, source=source)
    named = [_problem(pipeline, stage.name) for stage in fields(Pipeline)]
    refuse([*problems, *(problem for problem in named if problem)], source)
    return pipeline


def stages_of(variant: Variant) -> Pipeline:
    """The pipeline of a variant as it is written, its methods neither looked for nor imported.

    Raises
    ------
    burrscan.errors.InputError
        When it names stages that do not exist.

    """
    tables = {kind: _table(choice) for kind, choice in variant.stages.items()}
    return build(Pipeline, tables, source=f"variant '{variant.name}'")


def _table(choice: str | Mapping[str, Any]) -> Mapping[str, Any]:
    return {"method": choice} if isinstance(choice, str) else choice


def _problem(pipeline: Pipeline, kind: str) -> str:
    try:
        stage_function(getattr(pipeline, kind), kind)
    except InputError as error:
        return str(error)
    return ""
