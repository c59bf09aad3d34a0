"""Several runs against one: their comparisons as a single one, which every output can write."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from bench.compare.result import ArmComparison, Comparison


def joined(comparisons: Sequence[Comparison]) -> Comparison:
    """Comparisons with the same base as one that has all their arms; one alone stays as it is.

    Each keeps its verdicts: every run is judged as if it were compared alone, so that a run's verdict does
    not hang on which others are named beside it. Arms say which run is theirs, in
    :attr:`~bench.compare.result.ArmComparison.run`; runs whose folders have one name are numbered.
    """
    if len(comparisons) == 1:
        return comparisons[0]
    base, names = comparisons[0].base, _distinct([one.new for one in comparisons])
    arms = [_named(arm, base, name) for name, one in zip(names, comparisons, strict=True) for arm in one.arms]
    provenance: dict[str, tuple[Any, Any]] = {
        f"{name}: {key}": values
        for name, one in zip(names, comparisons, strict=True)
        for key, values in one.provenance.items()
    }
    return Comparison(base, ", ".join(names), tuple(arms), provenance)


def _named(arm: ArmComparison, base: str, run: str) -> ArmComparison:
    return replace(arm, base=f"{arm.base_variant} ({base})", new=f"{arm.new_variant} ({run})", run=run)


def _distinct(names: Sequence[str]) -> list[str]:
    counts = Counter(names)
    return [
        name if counts[name] == 1 else f"{name} {1 + names[:place].count(name)}"
        for place, name in enumerate(names)
    ]
