"""Sweeps over the pipeline: ``"pipeline.scan.frames" = [30, 60]`` makes a variant of every value."""

from __future__ import annotations

import itertools
import re
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

from bench.suites.paths import override
from burrscan.pipeline import Pipeline

_ROOT = "pipeline."


def swept_pipelines(document: Mapping[str, Any]) -> dict[str, Any]:
    """A suite's tables with its sweeps of pipeline parameters turned into variants.

    ``pipeline.STAGE`` sweeps the stage's method, ``pipeline.STAGE.PARAMETER`` one of its parameters; what
    follows goes into tables below it. Every variant is crossed with every combination of values and named
    after them: ``adaptive+frames=30``. Stages and parameters that do not exist are refused later, with the
    variants that have them. O(variants x values).
    """
    sweep, variants = document.get("sweep"), document.get("variant")
    if not isinstance(sweep, Mapping) or not isinstance(variants, Sequence):
        return dict(document)
    ours = {path: values for path, values in sweep.items() if path.startswith(_ROOT)}
    if not ours or not all(isinstance(v, Mapping) for v in variants):
        return dict(document)
    combinations = list(itertools.product(*(_listed(values) for values in ours.values())))
    return {
        **document,
        "sweep": {path: values for path, values in sweep.items() if path not in ours},
        "variant": [_variant(v, dict(zip(ours, one, strict=True))) for v in variants for one in combinations],
    }


def _listed(values: Any) -> Sequence[Any]:
    return values if isinstance(values, list | tuple) else [values]


def _variant(variant: Mapping[str, Any], point: Mapping[str, Any]) -> dict[str, Any]:
    """A variant with the values of one point of the sweep."""
    stages = {key: _table(key, choice) for key, choice in dict(variant.get("stages", {})).items()}
    for path, value in point.items():
        stage, _, rest = path.removeprefix(_ROOT).partition(".")
        stages.setdefault(stage, _table(stage, None))
        stages = override(stages, f"{stage}.parameters.{rest}" if rest else f"{stage}.method", value)
    names = _leaves(list(point))
    told = "+".join(f"{names[path]}={_text(value)}" for path, value in point.items())
    return {**variant, "name": f"{variant.get('name', '')}+{told}", "stages": stages}


def _table(stage: str, choice: Any) -> dict[str, Any]:
    """A stage's choice as a table, the pipeline's own where none was made."""
    if isinstance(choice, Mapping):
        return {"parameters": {}, **choice}
    usual = {item.name: getattr(Pipeline(), item.name).method for item in fields(Pipeline)}
    return {"method": usual.get(stage, "") if choice is None else choice, "parameters": {}}


def _leaves(paths: Sequence[str]) -> dict[str, str]:
    """Each path by its last part, or whole where two end alike."""
    last = [path.rpartition(".")[2] for path in paths]
    return {
        path: leaf if last.count(leaf) == 1 else path.removeprefix(_ROOT)
        for path, leaf in zip(paths, last, strict=True)
    }


def _text(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return re.sub(r"[^A-Za-z0-9_.-]", "_", text)
