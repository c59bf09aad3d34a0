"""Every metric answers to the error planted for it, by the amount planted, and to no other."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.score import Evidence, Metric
from bench.score.metrics import METRICS, failed_metrics, measure, metric_named, own_metrics
from burrscan.errors import InputError
from tests.bench.ideal import HEIGHT, PROFILE, WIDTH, evidence, found_burr, true_burr

PERFECT = {
    "coverage": 1.0, "wrong_rate": 0.0, "depth_rms_mm": 0.0, "axis_deg": 0.0, "axis_offset_mm": 0.0,
    "generatrix_rms_mm": 0.0, "band_mm": 0.2, "burr_found": 1.0, "burr_coverage": 1.0, "burr_angle_deg": 0.0,
    "burr_located": 1.0, "burr_height_mm": 0.0, "burr_extent_mm": 0.0, "false_calls": 0.0, "frames": 42.0,
    "saturated_share": 0.0, "burr_dprime": math.nan, "side_dprime": math.nan, "burr_efficiency": math.nan,
    "u_rms_px": 0.0, "bound_ratio": 0.0, "bound_ratio_second": 0.0, "pull_spread": 0.0,
    "axis_off": 0.0, "axis_held": 1.0, "axis_bound_deg": math.nan, "blemish_calls": math.nan,
    "calls_stain": math.nan, "calls_bright_spot": math.nan, "calls_scratch": math.nan,
    "calls_chatter": math.nan,
    # what a cell does besides is no part of a scan
    "looks": math.nan, "part_coverage": math.nan, "burr_left": math.nan, "found_by_look": math.nan,
    "axis_gain": math.nan, "servo_converged": math.nan, "servo_looks": math.nan, "servo_mm": math.nan,
    "residual_mm": math.nan, "gouge_mm": math.nan, "verified_mm": math.nan,
}  # fmt: skip
COLUMN_METRICS = {"u_rms_px", "bound_ratio", "bound_ratio_second", "pull_spread"}
HIT = found_burr(90.0, (-10.0, 10.0))


def changed(metrics: dict[str, float]) -> set[str]:
    return {
        name
        for name, value in metrics.items()
        if value != pytest.approx(PERFECT[name], abs=1e-5, nan_ok=True)
    }


def turned(tilt_deg: float, offset_mm: float) -> np.ndarray:
    angle = math.radians(tilt_deg)
    motion = np.eye(4)
    motion[1:3, 1:3] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    motion[0, 3] = offset_mm
    return motion


def test_a_perfect_outcome_scores_perfectly() -> None:
    assert changed(measure(evidence(true_burr(), found=(HIT,)))) == set()


def test_pixels_that_are_missing_lower_coverage_alone() -> None:
    left = np.arange(WIDTH) < 22  # 22 of 110 lit columns
    metrics = measure(evidence(true_burr(), found=(HIT,), accept=~left))
    assert metrics["coverage"] == pytest.approx(0.8)
    assert changed(metrics) == {"coverage"}


def test_a_shifted_column_is_wrong_from_one_pixel_on() -> None:
    assert changed(measure(evidence(true_burr(), found=(HIT,), u_error_px=0.99))) == COLUMN_METRICS
    left = np.where(np.arange(WIDTH) < 11, 1.5, 0.0)
    metrics = measure(evidence(true_burr(), found=(HIT,), u_error_px=left))
    assert metrics["wrong_rate"] == pytest.approx(0.1)
    assert metrics["coverage"] == pytest.approx(0.9)


def test_column_errors_are_compared_with_the_bound_and_the_stated_sigma() -> None:
    metrics = measure(evidence(true_burr(), found=(HIT,), u_error_px=0.5))
    assert metrics["u_rms_px"] == pytest.approx(0.5, abs=1e-6)
    assert metrics["bound_ratio"] == pytest.approx(0.5 / 0.25, abs=1e-5)
    assert metrics["bound_ratio_second"] == pytest.approx(0.5 / 0.5, abs=1e-5)
    assert metrics["pull_spread"] == pytest.approx(1.4826 * 0.5 / 1.0, abs=1e-5)
    # wrong pixels are another metric's
    wrong = np.where(np.arange(WIDTH) < 11, 1.5, 0.5)
    assert measure(evidence(true_burr(), found=(HIT,), u_error_px=wrong))["u_rms_px"] == pytest.approx(0.5)


def test_pulls_to_both_sides_spread() -> None:
    """A third errs to one side, the rest to the other: the size of all is 0.5, their median is not."""
    both = np.where(np.arange(WIDTH) % 3 == 0, 0.5, -0.5)
    metrics = measure(evidence(true_burr(), found=(HIT,), u_error_px=both))
    assert metrics["pull_spread"] == pytest.approx(1.4826 * 0.5, abs=1e-5)


def test_depth_errors_are_those_of_right_pixels() -> None:
    metrics = measure(evidence(true_burr(), found=(HIT,), shift_mm=0.25))
    assert metrics["depth_rms_mm"] == pytest.approx(0.25)
    assert changed(metrics) == {"depth_rms_mm"}


def test_clipped_pixels_are_counted_where_they_are_measurable() -> None:
    metrics = measure(evidence(true_burr(), found=(HIT,), saturated=np.arange(WIDTH) >= 99))
    assert metrics["saturated_share"] == pytest.approx(0.1)


@given(tilt=st.floats(-30.0, 30.0), offset=st.floats(-5.0, 5.0))
def test_a_turned_and_shifted_axis_is_measured(tilt: float, offset: float) -> None:
    metrics = measure(evidence(T_found_part=turned(tilt, offset)))
    assert metrics["axis_deg"] == pytest.approx(abs(tilt), abs=1e-6)
    assert metrics["axis_offset_mm"] == pytest.approx(abs(offset), abs=1e-6)


def test_an_interval_holds_as_far_as_it_says() -> None:
    """Stated: 1 mrad and 1 um; a tilt about one axis and an offset along one are two of four."""
    stated_deg = math.degrees(1e-3)
    inside = measure(evidence(T_found_part=turned(1.9 * stated_deg, 1.9e-3)))
    assert inside["axis_held"] == 1.0
    assert measure(evidence(T_found_part=turned(3.0 * stated_deg, 0.0)))["axis_held"] < 1.0
    assert measure(evidence(T_found_part=turned(0.99, 0.0)))["axis_off"] == 0.0
    assert measure(evidence(T_found_part=turned(1.01, 0.0)))["axis_off"] == 1.0


def test_an_axis_that_points_the_other_way_is_the_same_axis() -> None:
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    metrics = measure(evidence(true_burr(), found=(HIT,), T_found_part=flip))
    assert changed(metrics) == set()


def test_a_profile_too_far_out_is_measured() -> None:
    metrics = measure(evidence(profile=PROFILE + np.array([0.0, 0.3])))
    assert metrics["generatrix_rms_mm"] == pytest.approx(0.3)


def test_a_gap_in_the_profile_is_not_bridged() -> None:
    gap = np.array([[-30.0, 50.0], [-20.0, 50.0], [np.nan, np.nan], [20.0, 51.0], [30.0, 51.0]])
    assert measure(evidence(profile=gap))["generatrix_rms_mm"] == pytest.approx(math.sqrt(0.5), rel=1e-6)


def test_burr_errors_are_those_planted() -> None:
    found = found_burr(88.5, (-9.0, 13.0), height_mm=1.4)
    metrics = measure(evidence(true_burr(), found=(found,)))
    assert metrics["burr_angle_deg"] == pytest.approx(1.5)
    assert metrics["burr_height_mm"] == pytest.approx(0.4)
    assert metrics["burr_extent_mm"] == pytest.approx(2.0)
    assert changed(metrics) == {"burr_angle_deg", "burr_height_mm", "burr_extent_mm"}


@pytest.mark.parametrize(
    "wrong",
    [
        found_burr(93.1, (-10.0, 10.0)),
        found_burr(90.0, (10.5, 20.0)),
        found_burr(90.0, (-10.0, 10.0), side="nick"),
        found_burr(-90.0, (-10.0, 10.0)),
    ],
)
def test_a_burr_in_the_wrong_place_is_a_miss_and_a_false_call(wrong: object) -> None:
    metrics = measure(evidence(true_burr(), found=(wrong,)))  # type: ignore[arg-type]
    assert metrics["burr_found"] == 0.0
    assert metrics["false_calls"] == 1.0
    assert math.isnan(metrics["burr_angle_deg"])


def test_pieces_of_a_burr_are_one_hit_and_the_longest_tells_the_errors() -> None:
    pieces = (found_burr(89.0, (-10.0, -7.0)), found_burr(91.0, (-5.0, 10.0)))
    metrics = measure(evidence(true_burr(), found=pieces))
    assert metrics["burr_found"] == 1.0
    assert metrics["false_calls"] == 0.0
    assert metrics["burr_extent_mm"] == pytest.approx(2.5)


def test_of_two_burrs_one_found_is_half() -> None:
    other = true_burr(angle_deg=60.0)
    metrics = measure(evidence(true_burr(), other, found=(HIT,)))
    assert metrics["burr_found"] == 0.5


def test_angles_are_compared_across_the_wrap() -> None:
    metrics = measure(evidence(true_burr(angle_deg=179.0), found=(found_burr(-179.5, (-10.0, 10.0)),)))
    assert metrics["burr_angle_deg"] == pytest.approx(1.5)


def test_a_rim_burr_is_found_anywhere_on_its_arc() -> None:
    rim = true_burr(kind="rim", arc_deg=40.0)
    metrics = measure(evidence(rim, found=(found_burr(110.0, (0.0, 2.0)),)))
    assert metrics["burr_found"] == 1.0
    assert metrics["burr_angle_deg"] == pytest.approx(20.0)


def test_half_of_a_burr_without_pixels_is_half_covered() -> None:
    upper = np.arange(HEIGHT)[:, None] >= HEIGHT // 2
    metrics = measure(evidence(true_burr(), found=(HIT,), accept=upper))
    assert metrics["burr_coverage"] == pytest.approx(0.5)


def test_a_wheel_without_burrs_has_no_burr_metrics_but_false_calls() -> None:
    metrics = measure(evidence(found=(HIT,)))
    assert metrics["false_calls"] == 1.0
    assert math.isnan(metrics["burr_found"])
    assert math.isnan(metrics["burr_coverage"])


def test_a_blind_scan_covers_nothing() -> None:
    metrics = measure(evidence(true_burr(), accept=False))
    assert metrics["coverage"] == 0.0
    assert math.isnan(metrics["depth_rms_mm"])
    assert metrics["burr_coverage"] == 0.0


def test_a_failure_is_never_better_than_any_result() -> None:
    perfect = measure(evidence(true_burr(), found=(HIT,)))
    for name, value in failed_metrics().items():
        metric = METRICS[name]
        if not math.isnan(value) and not math.isnan(perfect[name]):
            assert value < perfect[name] if metric.better == "higher" else value > perfect[name], name


def test_every_metric_says_what_it_is() -> None:
    for metric in METRICS.values():
        assert metric.description
        assert metric.source
        assert metric.version >= 1
        assert metric.unit in {"1", "px", "mm", "deg", "count"}


OWN = Metric("", "Accepted pixels", "count", "higher", 3, "this test", lambda e: float(e.accepted.sum()), 0.0)


def test_a_metric_of_ones_own_is_measured_beside_the_shipped_ones() -> None:
    name = f"{__name__}:OWN"
    assert own_metrics(["coverage", name, name]) == (name,)
    outcome: Evidence = evidence(true_burr(), found=(HIT,))
    metrics = measure(outcome, own=[name])
    assert metrics[name] == outcome.accepted.sum() > 0
    assert set(metrics) - {name} == set(METRICS)
    assert failed_metrics(own=[name])[name] == 0.0
    assert metric_named(name).version == 3


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("covrage", "coverage"),
        (f"{__name__}:HIT", "Burr"),
        (f"{__name__}:OWM", "OWN"),
        ("nowhere:x", "nowhere"),
    ],
)
def test_what_is_no_metric_is_refused_with_a_hint(name: str, why: str) -> None:
    with pytest.raises(InputError, match=why):
        metric_named(name)
