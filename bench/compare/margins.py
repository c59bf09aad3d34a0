"""Equivalence margins: differences too small to matter, in each metric's own unit, and what is gated.

A margin is not a noise level. It answers "how much worse would make an engineer act?", so it belongs to the
task. The defaults suit wheels of some 200 mm diameter, burrs of 0.3 mm and more, and a projector pixel of
about 0.3 mm on the part. A suite overrides them in ``[[gate]]`` tables, the command line in ``--margin``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from bench.score.metrics import METRICS, metric_named
from bench.suites.suite import Gate, Suite
from burrscan.documents import refuse
from burrscan.variants import suggest

FAILURES = "failures"
"""The row of cases without a result; gated like a metric, margin in cases."""

MARGINS: dict[str, float] = {
    "coverage": 0.01,  # one point of the measurable surface
    "wrong_rate": 0.002,  # one wrong pixel in 500: what a 5 x 5 median still removes
    "depth_rms_mm": 0.01,  # a thirtieth of the lowest burr of interest
    "axis_deg": 0.01,  # 0.01 mm over half the length of a wheel of 120 mm
    "axis_offset_mm": 0.01,  # likewise
    "generatrix_rms_mm": 0.01,  # likewise
    "band_mm": 0.05,
    "burr_found": 0.05,  # one burr in twenty
    "burr_coverage": 0.05,  # 1 mm of a burr of 20 mm
    "burr_angle_deg": 0.1,  # 0.2 mm along the circumference: less than the width of a burr
    "burr_height_mm": 0.05,  # a tenth of a common burr limit, 0.5 mm
    "burr_extent_mm": 0.5,  # half the step at which coverage is judged
    "false_calls": 0.5,  # one more false call on every second wheel
    "frames": 1.0,
    "saturated_share": 0.01,
    FAILURES: 0.0,  # what raised no error must not begin to
}
"""Metric to its default margin, in the metric's unit (shares as fractions, not per cent)."""

_OTHERS = {"1": 0.01, "mm": 0.05, "deg": 0.05, "count": 0.5}
"""Margin of a metric that has none of its own, by its unit."""

GATED: tuple[str, ...] = (
    FAILURES, "coverage", "wrong_rate", "depth_rms_mm", "axis_deg", "axis_offset_mm", "generatrix_rms_mm",
    "burr_found", "burr_angle_deg", "burr_height_mm", "false_calls",
)  # fmt: skip
"""Gated where the suite has no ``[[gate]]`` tables."""


def gates_of(suite: Suite, overrides: Mapping[str, float]) -> dict[str, Gate]:
    """The gates of a suite by metric: its own, or the usual ones, under which no burr may be lost either.

    A margin given on the command line for a metric that is not gated gates nothing.

    Raises
    ------
    burrscan.errors.InputError
        When a gate or an override names no metric, or a margin is negative or not finite.

    """
    own = {gate.metric: gate for gate in suite.gate}
    given = {name: gate.margin for name, gate in own.items() if gate.margin is not None}
    named = {name: 0.0 for name in own if name not in given}
    refuse(margin_problems({**named, **given, **overrides}), "margins")
    return own or {name: _usual(name) for name in GATED}


def _usual(name: str) -> Gate:
    return Gate(name, margin=MARGINS[name], lost=0 if name == "burr_found" else None)


def margin_of(name: str, *, own: float | None = None, override: float | None = None) -> float:
    """A metric's margin: the command line's, else the suite's, else the table's, else one for its unit."""
    if override is not None:
        return override
    if own is not None:
        return own
    return MARGINS[name] if name in MARGINS else _OTHERS.get(metric_named(name).unit, 0.0)


def margin_problems(margins: Mapping[str, float]) -> list[str]:
    """What is wrong with margins that somebody gave."""
    known = [FAILURES, *METRICS]
    unknown = [
        f"unknown metric '{name}': {suggest(name, known)}"
        for name in margins
        if name not in known and ":" not in name
    ]
    bad = [
        f"{name}: a margin is a number from 0 upwards, not {value}"
        for name, value in margins.items()
        if not (math.isfinite(value) and value >= 0.0)
    ]
    return unknown + bad
