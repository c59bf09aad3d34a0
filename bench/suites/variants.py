"""From a suite's variant to the pipeline it means."""

from __future__ import annotations

from burrscan.pipeline import Pipeline

from bench.suites.suite import Variant


def pipeline_of(variant: Variant) -> Pipeline:
    """The pipeline of a variant.

    Raises
    ------
    burrscan.errors.InputError
        When it names a stage, a method or a parameter that does not exist.

    """
    raise NotImplementedError(variant)
