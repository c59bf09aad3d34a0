"""The columns of a page: which variants of which runs stand side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.compare.result import ArmComparison
from bench.run import Record, Run
from bench.run.records import count_failed

Arrays = Mapping[str, NDArray[Any]]
"""Pictures and maps of a case (:mod:`bench.run.artefacts`)."""


@dataclass(frozen=True, eq=False)
class Side:
    """One arm.

    Parameters
    ----------
    label
        How the page calls it.
    css
        Its style class, for its colour.
    run, variant
        Whose records.

    """

    label: str
    css: str
    run: Run
    variant: str

    @cached_property
    def records(self) -> Mapping[str, Record]:
        """Case to record, in the suite's order."""
        return {record.case: record for record in self.run.records if record.variant == self.variant}

    def truth(self, case: str) -> Arrays:
        """The true maps of a case; nothing where none were kept."""
        return self._arrays(case, "truth.npz")

    def found(self, case: str) -> Arrays:
        """The pictures and maps of a case; nothing where none were kept."""
        return self._arrays(case, f"{self.variant}.npz")

    def _arrays(self, case: str, name: str) -> Arrays:
        """None when the file is missing or damaged, for a report shows what there is."""
        path = self.run.artefact(case, name)
        try:
            with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
                return dict(arrays)
        except Exception:  # noqa: BLE001 (a damaged archive raises a dozen kinds, EOFError and KeyError too)
            return {}

    @property
    def failed(self) -> int:
        """How many of its cases have no result."""
        return count_failed(self.records.values())


@dataclass(frozen=True)
class Panel:
    """Sides that are shown together.

    Parameters
    ----------
    title
        Empty where the page has one panel only.
    sides
        At least one.
    arms
        Comparisons of these sides, for the forest plot.
    paired
        Whether the page compares: the two sides' difference is shown, not their values.

    """

    title: str
    sides: tuple[Side, ...]
    arms: tuple[ArmComparison, ...]
    paired: bool = False

    @property
    def records(self) -> tuple[Record, ...]:
        """Of all sides."""
        return tuple(record for side in self.sides for record in side.records.values())

    def records_of(self, side: Side) -> list[Record]:
        """A side's records and its run's others of the same cases, which know a failed case's burrs."""
        return [record for record in side.run.records if record.case in side.records]


def sides_of(run: Run) -> tuple[Side, ...]:
    """Every variant of a run."""
    return tuple(
        Side(variant.name, colour_of(run, variant.name), run, variant.name) for variant in run.suite.variant
    )


def colour_of(run: Run, variant: str) -> str:
    """The style class of a variant's colour: the same on every page of a suite."""
    names = [one.name for one in run.suite.variant]
    return f"v{names.index(variant) % 9}"


def paired_panels(base: Run, news: Sequence[Run], arms: Sequence[ArmComparison]) -> tuple[Panel, ...]:
    """A panel per comparison: the base and the new arm, of the run in ``news`` at its place.

    The new arm has its variant's colour, the base too where it is another variant; else the base is grey.
    """
    return tuple(
        Panel(
            f"{arm.base} → {arm.new}" if len(arms) > 1 else "",
            (
                Side(arm.base, _base_colour(base, arm), base, arm.base_variant),
                Side(arm.new, colour_of(new, arm.new_variant), new, arm.new_variant),
            ),
            (arm,),
            paired=True,
        )
        for arm, new in zip(arms, news, strict=True)
    )


def _base_colour(base: Run, arm: ArmComparison) -> str:
    return "before" if arm.base_variant == arm.new_variant else colour_of(base, arm.base_variant)
