"""What a metric is: one definition, with everything needed to read and to compare its numbers."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal


@dataclass(frozen=True)
class Metric:
    """One number per case and variant.

    Parameters
    ----------
    name, title, unit
        The key in records, the heading in tables, and the unit (``1`` for a share, ``count`` for a number of
        things).
    better
        Which direction is better.
    version
        Raised whenever the definition changes; numbers of different versions are not comparable.
    source
        Where the definition comes from.
    measure
        The definition itself; NaN where the metric does not apply to a case.
    on_failure
        What a case without a result counts as: the worst value where there is one; infinity, which ranks
        behind every error, where there is none; NaN for what is neither good nor bad.
    needs
        ``scan`` where ``measure`` takes :class:`bench.score.Evidence`, which a mesh that nobody scanned has
        not; ``cell`` where it takes :class:`bench.score.cell.CellEvidence`; ``part`` where a
        :class:`bench.score.evidence.PartEvidence` will do.

    """

    name: str
    title: str
    unit: str
    better: Literal["higher", "lower"]
    version: int
    source: str
    measure: Callable[[Any], float]
    on_failure: float
    needs: Literal["scan", "part", "cell"] = "scan"

    @property
    def description(self) -> str:
        """The definition in words."""
        return inspect.cleandoc(self.measure.__doc__ or "")


def shown_unit(unit: str) -> str:
    """The unit that numbers are shown in: shares in per cent, a number of things in none."""
    return {"1": "%", "count": ""}.get(unit, unit)


def within(title: str) -> str:
    """A title inside a sentence: ``Depth RMS`` is ``depth RMS`` there, ``RMS / bound`` stays."""
    return title if title[1:2].isupper() else title[:1].lower() + title[1:]
