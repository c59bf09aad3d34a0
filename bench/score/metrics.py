"""The table of all metrics."""

from __future__ import annotations

import functools
import math
import warnings
from collections.abc import Iterable
from dataclasses import replace

from bench.score import blemishes, burrs, cell, scan, shape
from bench.score.evidence import Evidence, PartEvidence
from bench.score.metric import Metric
from burrscan.errors import InputError
from burrscan.variants import attribute, suggest

_OURS = "burrscan"
_SEED = "Claes, Koninckx, Bruyninckx, Automatic burr detection on surfaces of revolution, section 5.2"
_POD = "MIL-HDBK-1823A (hit/miss)"

_SCAN = (
    Metric("coverage", "Coverage", "1", "higher", 1, _OURS, scan.coverage, 0.0),
    Metric("wrong_rate", "Wrong pixels", "1", "lower", 1, _OURS, scan.wrong_rate, 1.0),
    Metric("depth_rms_mm", "Depth RMS", "mm", "lower", 1, _OURS, scan.depth_rms_mm, math.inf),
    Metric("u_rms_px", "Column RMS", "px", "lower", 1, _OURS, scan.u_rms_px, math.inf),
    Metric("bound_ratio", "RMS / bound", "1", "lower", 1, _OURS, scan.bound_ratio, math.inf),
    Metric(
        "bound_ratio_second",
        "RMS / bound, second path",
        "1",
        "lower",
        1,
        _OURS,
        scan.bound_ratio_second,
        math.inf,
    ),
    Metric("pull_spread", "Pulls", "1", "lower", 1, _OURS, scan.pull_spread, math.nan),
    Metric("burr_coverage", "Burr coverage", "1", "higher", 1, _OURS, burrs.burr_coverage, 0.0),
    Metric("burr_dprime", "Least d'", "1", "higher", 1, _OURS, burrs.burr_dprime, math.nan),
    Metric("side_dprime", "Least d' of the side", "1", "higher", 1, _OURS, burrs.side_dprime, math.nan),
    Metric("burr_efficiency", "Efficiency", "1", "higher", 1, _OURS, burrs.burr_efficiency, 0.0),
    Metric("frames", "Frames", "count", "lower", 1, _OURS, scan.frames, math.nan),
    Metric("saturated_share", "Clipped pixels", "1", "lower", 1, _OURS, scan.saturated_share, 1.0),
)
_BLEMISHES = (
    Metric("blemish_calls", "On blemishes", "count", "lower", 1, _OURS, blemishes.blemish_calls, math.inf),
    *(
        Metric(f"calls_{kind}", title, "count", "lower", 1, _OURS, blemishes.calls_on(kind), math.inf)
        for kind, title in zip(
            blemishes.KINDS, ("On stains", "On bright spots", "On scratches", "On chatter"), strict=True
        )
    ),
)
_PART = (
    Metric("axis_deg", "Axis angle", "deg", "lower", 1, _OURS, shape.axis_deg, 90.0),
    Metric("axis_bound_deg", "Axis bound", "deg", "lower", 1, _OURS, shape.axis_bound_deg, math.nan),
    Metric("axis_off", "Axis off", "1", "lower", 1, _OURS, shape.axis_off, 1.0),
    Metric("axis_held", "95 % held", "1", "higher", 1, _OURS, shape.axis_held, 0.0),
    Metric("axis_offset_mm", "Axis offset", "mm", "lower", 1, _OURS, shape.axis_offset_mm, math.inf),
    Metric("generatrix_rms_mm", "Curve RMS", "mm", "lower", 1, _OURS, shape.generatrix_rms_mm, math.inf),
    Metric("band_mm", "Curve band", "mm", "lower", 1, _SEED, shape.band_mm, math.inf),
    Metric("burr_found", "Burrs found", "1", "higher", 1, _POD, burrs.burr_found, 0.0),
    Metric("burr_located", "Burrs located", "1", "higher", 1, _OURS, burrs.burr_located, 0.0),
    Metric("burr_angle_deg", "Burr angle", "deg", "lower", 1, _OURS, burrs.burr_angle_deg, math.inf),
    Metric("burr_height_mm", "Burr height", "mm", "lower", 1, _OURS, burrs.burr_height_mm, math.inf),
    Metric("burr_extent_mm", "Burr extent", "mm", "lower", 1, _OURS, burrs.burr_extent_mm, math.inf),
    Metric("false_calls", "False calls", "count", "lower", 1, _POD, burrs.false_calls, math.inf),
)
_CELL = (
    Metric("looks", "Looks", "count", "lower", 1, _OURS, cell.looks, math.inf),
    Metric("part_coverage", "Part covered", "1", "higher", 1, _OURS, cell.part_coverage, 0.0),
    Metric("burr_left", "Said to be left", "1", "lower", 1, _OURS, cell.burr_left, math.nan),
    Metric("found_by_look", "Found by look", "1", "higher", 1, _OURS, cell.found_by_look, 0.0),
    Metric("axis_gain", "Axis / best look", "1", "lower", 1, _OURS, cell.axis_gain, math.inf),
    Metric("servo_converged", "Servo converged", "1", "higher", 1, _OURS, cell.servo_converged, 0.0),
    Metric("servo_looks", "Servo looks", "count", "lower", 1, _OURS, cell.servo_looks, math.inf),
    Metric("servo_mm", "Mill off", "mm", "lower", 1, _OURS, cell.servo_mm, math.inf),
    Metric("residual_mm", "Residual burr", "mm", "lower", 1, _OURS, cell.residual_mm, math.inf),
    Metric("gouge_mm", "Gouge", "mm", "lower", 1, _OURS, cell.gouge_mm, math.inf),
    Metric("verified_mm", "Residual misjudged", "mm", "lower", 1, _OURS, cell.verified_mm, math.inf),
)
_ALL = (
    *_SCAN,
    *(replace(metric, needs="part") for metric in _PART),
    *_BLEMISHES,
    *(replace(metric, needs="cell") for metric in _CELL),
)

METRICS: dict[str, Metric] = {metric.name: metric for metric in _ALL}
"""Every metric by its name, in the order of tables."""

_NEEDS: tuple[tuple[type, str], ...] = ((Evidence, "scan"), (cell.CellEvidence, "cell"))
"""Which metrics an evidence serves, beside those of a part."""

HEADLINE = (
    "coverage", "wrong_rate", "depth_rms_mm", "axis_deg", "axis_offset_mm", "generatrix_rms_mm",
    "burr_found", "burr_coverage", "burr_angle_deg", "burr_height_mm", "false_calls", "frames",
)  # fmt: skip
"""The score table's columns where a suite names none."""


@functools.cache
def metric_named(name: str) -> Metric:
    """A metric by its short name, or anyone's own as ``"module:attribute"``.

    Raises
    ------
    burrscan.errors.InputError
        When there is no such metric.

    """
    if name in METRICS:
        return METRICS[name]
    if ":" not in name:
        raise InputError(f"unknown metric '{name}': {suggest(name, list(METRICS))} (or 'module:attribute')")
    found = attribute(name, what="metric")
    if not isinstance(found, Metric):
        raise InputError(f"metric '{name}': this is no bench.score.Metric but {type(found).__name__}")
    return replace(found, name=name)


def own_metrics(names: Iterable[str]) -> tuple[str, ...]:
    """Those of some names that are not shipped, each once."""
    return tuple(dict.fromkeys(name for name in names if name not in METRICS))


def measure(evidence: PartEvidence, *, own: Iterable[str] = ()) -> dict[str, float]:
    """Every metric of one outcome, and ``own`` ones beside them; NaN for what needs a scan and has none."""
    return measure_some(evidence, (*METRICS, *own))


def measure_some(evidence: PartEvidence, names: Iterable[str]) -> dict[str, float]:
    """The metrics of these names."""
    metrics = [metric_named(name) for name in names]
    fits = {"part", *(need for kind, need in _NEEDS if isinstance(evidence, kind))}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # NaN marks what is missing and may be compared
        return {
            metric.name: float(metric.measure(evidence)) if metric.needs in fits else math.nan
            for metric in metrics
        }


def failed_metrics(*, own: Iterable[str] = ()) -> dict[str, float]:
    """What a case without a result counts as, metric by metric."""
    return {metric.name: metric.on_failure for metric in (*METRICS.values(), *map(metric_named, own))}
