"""Burrs called where there is a blemish: false calls, counted by what misled the algorithm."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Literal

from bench.score.evidence import Evidence
from bench.score.matching import WITHIN_DEG, Place
from burrscan.turns import turn_deg
from scenes.surface import TrueBlemish

Kind = Literal["stain", "bright_spot", "scratch", "chatter"]
KINDS: tuple[Kind, ...] = ("stain", "bright_spot", "scratch", "chatter")


def blemish_calls(evidence: Evidence) -> float:
    """False calls on a blemish: within 3 degrees of it and overlapping it along the axis.

    They are among ``false_calls``. NaN where the wheel has no blemish.
    """
    if not evidence.truth.blemishes:
        return math.nan
    return float(sum(kind is not None for kind in called_kinds(evidence)))


def calls_on(kind: Kind) -> Callable[[Evidence], float]:
    """The metric that counts the false calls on blemishes of one kind."""

    def calls(evidence: Evidence) -> float:
        if all(blemish.kind != kind for blemish in evidence.truth.blemishes):
            return math.nan
        return float(sum(called == kind for called in called_kinds(evidence)))

    calls.__doc__ = (
        f"False calls on a {kind.replace('_', ' ')}, as ``blemish_calls``; NaN where there is none. A call "
        "on several blemishes counts for the nearest, then for the narrowest."
    )
    return calls


def called_kinds(evidence: Evidence) -> list[str | None]:
    """The kind of blemish that each false call is on, None where it is on none."""
    matching = evidence.matching
    return [
        _kind_at(place, evidence.truth.blemishes)
        for place, owner in zip(matching.found, matching.match, strict=True)
        if owner < 0
    ]


def _kind_at(found: Place, blemishes: tuple[TrueBlemish, ...]) -> str | None:
    near = [
        (off, blemish.arc_deg, number)
        for number, blemish in enumerate(blemishes)
        if min(found.z_end_mm, blemish.z_end_mm) > max(found.z_start_mm, blemish.z_start_mm)
        and (off := _off_deg(found, blemish)) <= WITHIN_DEG
    ]
    return blemishes[min(near)[2]].kind if near else None


def _off_deg(found: Place, blemish: TrueBlemish) -> float:
    return max(abs(turn_deg(found.angle_deg - blemish.angle_deg)) - blemish.arc_deg / 2.0, 0.0)
