from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import pytest
from scipy.ndimage import uniform_filter
from scipy.stats import norm

from bench.synthetic.revolution import RevolutionScan, RidgeBurr, revolution_scan
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh, perpendicular_basis
from burrscan.burrs import burrs_residual
from burrscan.burrs.detect import BOXES, evidence_of, threshold
from burrscan.burrs.field import APART_CELLS, CLIP, field_of, summed
from burrscan.burrs.noise.sigma_calibration import calibrated
from burrscan.burrs.rivals.seed import _planes_cut, burrs_seed, burrs_seed_literal
from burrscan.errors import InputError
from burrscan.generatrix import fit_generatrix
from burrscan.inspection import Axis, Burr
from tests.burrscan.parts import angle_in_frame_deg, exact_axis, scattered_scan, turned, z_offset_mm
from tests.tiers import some_of

Lift: TypeAlias = Callable[[Floats, Floats, Floats], Floats]


def found(scan: RevolutionScan, axis: Axis | None = None, **options: Any) -> tuple[Burr, ...]:
    axis = axis or exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    return burrs_residual(scan.vertices_mm, scan.faces, axis, curve, **options)


def ridge(
    angle_deg: float, height_mm: float, width_mm: float, *, low: float = -99.0, high: float = 99.0
) -> Lift:
    """A triangular ridge along the axis, of constant width in mm."""

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        x = np.abs(angle - np.radians(angle_deg)) * r
        return np.asarray(height_mm * np.clip(1.0 - 2.0 * x / width_mm, 0.0, None) * ((z > low) & (z < high)))

    return lift


def test_no_box_holds_vertices_of_two_pieces_of_the_curve() -> None:
    assert max(along for along, _ in BOXES) <= APART_CELLS


@pytest.mark.parametrize(("height_mm", "seed"), [(2.0, 0), (1.5, 1), (1.0, 2)])
def test_a_ridge_is_measured(height_mm: float, seed: int) -> None:
    scan = scattered_scan("stepped_wheel", ridge(13.3, height_mm, 1.0), seed=seed)
    (burr,) = found(scan)
    axis = exact_axis(scan)
    assert burr.side == "protrusion"
    assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, axis, 13.3))) < 0.05
    assert burr.height_mm.value == pytest.approx(height_mm, abs=0.05)
    assert burr.width_mm.value == pytest.approx(1.0, abs=0.05)
    assert burr.area_mm2.value == pytest.approx(0.5 * height_mm, abs=0.03)
    assert burr.significance > 10.0


def test_ends_and_volume() -> None:
    scan = scattered_scan("cylinder", ridge(-20.0, 1.2, 1.5, low=-12.0, high=9.0), seed=3)
    (burr,) = found(scan)
    offset = z_offset_mm(scan, exact_axis(scan))
    ends = np.array([burr.z_start_mm.value, burr.z_end_mm.value]) + offset
    assert ends == pytest.approx([-12.0, 9.0], abs=0.6)
    assert burr.length_mm.value == pytest.approx(21.0, abs=0.8)
    assert burr.volume_mm3.value == pytest.approx(0.5 * 1.2 * 1.5 * 21.0, rel=0.08)


def test_burrs_in_line_on_two_steps_are_two() -> None:
    """Between them is another surface, or one that nobody saw."""
    scan = scattered_scan("cylinder", ridge(10.0, 1.2, 1.5, low=-30.0, high=30.0), seed=7)
    z = scan.vertices_mm @ scan.direction
    middle = 0.5 * (z.min() + z.max())
    seen = dataclasses.replace(scan, vertices_mm=scan.vertices_mm[np.abs(z - middle) > 10.0])
    burrs = found(seen)
    assert sorted(burr.length_mm.value for burr in burrs) == pytest.approx([20.0, 20.0], abs=0.8)


def test_the_pose_stands_on_the_burr() -> None:
    scan = scattered_scan("cylinder", ridge(25.0, 1.5, 1.5), seed=4)
    (burr,) = found(scan)
    pose = burr.T_mesh_burr
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-9)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1.0)
    turn = np.radians(25.0)
    outwards = scan.T_mesh_part[:3, :3] @ [np.cos(turn), np.sin(turn), 0.0]
    assert pose[:3, 2] @ outwards > 0.9999
    assert abs(pose[:3, 0] @ scan.direction) > 0.999
    local = scan.T_mesh_part[:3, :3].T @ (pose[:3, 3] - scan.T_mesh_part[:3, 3])
    assert np.hypot(local[0], local[1]) == pytest.approx(90.0, abs=0.05)
    assert np.degrees(np.arctan2(local[1], local[0])) == pytest.approx(25.0, abs=0.1)


def test_a_nick_is_material_missing() -> None:
    scan = scattered_scan("cone", ridge(5.0, -0.8, 1.6, low=-10.0, high=15.0), seed=5)
    (burr,) = found(scan, limit_mm=0.5)
    assert burr.side == "nick"
    assert burr.height_mm.value == pytest.approx(0.8, abs=0.05)
    assert burr.within_limit is False
    (again,) = found(scan, limit_mm=1.0)
    assert again.within_limit is True


def test_an_arc_round_a_rim() -> None:
    def lift(z: Floats, _r: Floats, angle: Floats) -> Floats:
        on = np.abs(np.degrees(angle) - 10.0) < 15.0
        return np.asarray(np.clip(1.0 - np.abs(z - 20.0) / 0.8, 0.0, None) * on)

    scan = scattered_scan("cylinder", lift, seed=6)
    (burr,) = found(scan)
    axis = exact_axis(scan)
    assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, axis, 10.0))) < 0.5
    assert burr.length_mm.value == pytest.approx(np.radians(30.0) * 90.0, abs=1.5)
    assert burr.height_mm.value == pytest.approx(1.0, abs=0.06)
    assert abs(burr.T_mesh_burr[:3, 0] @ scan.direction) < 0.02


def test_a_burr_askew_to_the_axis() -> None:
    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        x = angle * r
        across, along = (x - z) / np.sqrt(2.0), (x + z) / np.sqrt(2.0)
        return np.asarray(1.2 * np.clip(1.0 - np.abs(across) / 0.8, 0.0, None) * (np.abs(along) < 12.0))

    scan = scattered_scan("cylinder", lift, seed=7)
    (burr,) = found(scan)
    assert abs(burr.T_mesh_burr[:3, 0] @ scan.direction) == pytest.approx(np.sqrt(0.5), abs=0.02)
    assert burr.length_mm.value == pytest.approx(24.0, abs=1.0)
    assert burr.height_mm.value == pytest.approx(1.2, abs=0.05)


def test_several_burrs_on_both_sides() -> None:
    first, second = ridge(-40.0, 1.0, 1.2), ridge(30.0, -1.0, 1.5, low=-10.0, high=10.0)
    scan = scattered_scan("stepped_wheel", lambda z, r, a: first(z, r, a) + second(z, r, a), seed=8)
    burrs = found(scan)
    assert sorted(burr.side for burr in burrs) == ["nick", "protrusion"]


def test_regular_rows_leave_height_open_and_say_so() -> None:
    # Two vertices across: many heights explain them. The interval stated holds the truth.
    for seed, angle in enumerate([12.13, -33.07, 41.9]):
        scan = revolution_scan(sigma_mm=0.05, seed=seed, burrs=(RidgeBurr(angle_deg=angle),))
        (burr,) = found(scan)
        axis = exact_axis(scan)
        assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, axis, angle))) < 0.05
        assert abs(burr.height_mm.value - 2.0) < 2.0 * burr.height_mm.sigma


@some_of("height_mm", [2.0, 1.5])
def test_a_crest_on_a_vertex_is_measured_exactly(height_mm: float) -> None:
    for seed in range(4):
        scan = revolution_scan(
            sigma_mm=0.05, seed=seed, burrs=(RidgeBurr(angle_deg=10.0, height_mm=height_mm),)
        )
        (burr,) = found(scan)
        assert burr.height_mm.value == pytest.approx(height_mm, abs=0.05)


def test_the_height_is_that_of_the_highest_stretch() -> None:
    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        across = np.abs(angle - np.radians(15.0)) * r
        height = np.where(z > 0.0, 1.0, 1.6)  # a parabola along the burr would round the step off
        return np.asarray(height * np.clip(1.0 - across / 0.8, 0.0, None))

    (burr,) = found(scattered_scan("cylinder", lift, seed=14))
    assert burr.height_mm.value == pytest.approx(1.6, abs=0.1)
    assert abs(burr.height_mm.value - 1.6) < 3.0 * burr.height_mm.sigma


@some_of("shape", ["stepped_wheel", "cylinder", "vase", "flanged_hub", "torus"], first=2)
def test_clean_wheels_are_clean(shape: str) -> None:
    for seed in range(3):
        scan = revolution_scan(shape, sigma_mm=0.05, seed=100 + seed, arc_deg=[60.0, 140.0, 100.0][seed])
        assert found(scan) == ()


def test_spikes_are_no_burrs() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, seed=9, outlier_share=0.02)
    assert found(scan) == ()


def test_an_axis_slightly_off_makes_no_burrs() -> None:
    scan = revolution_scan("stepped_wheel", sigma_mm=0.05, seed=10, burrs=(RidgeBurr(angle_deg=10.0),))
    axis = exact_axis(scan)
    tilt = axis.direction + perpendicular_basis(axis.direction)[:, 0] * np.radians(0.1)
    off = dataclasses.replace(
        axis,
        direction=tilt / np.linalg.norm(tilt),
        point_mm=axis.point_mm + 0.1 * perpendicular_basis(axis.direction)[:, 1],
    )
    (burr,) = found(scan, off)
    assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, axis, 10.0))) < 0.2


def test_half_of_a_burr_hidden() -> None:
    scan = scattered_scan("cylinder", ridge(20.0, 1.5, 1.5), seed=11)
    local = (scan.vertices_mm - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    seen = (local[:, 2] < 0.0) | (np.abs(np.degrees(np.arctan2(local[:, 1], local[:, 0])) - 20.0) > 3.0)
    cut = dataclasses.replace(scan, vertices_mm=scan.vertices_mm[seen])
    (burr,) = found(cut)
    assert burr.length_mm.value == pytest.approx(30.0, abs=1.5)


def test_a_burr_across_the_seam_of_a_whole_wheel_is_one() -> None:
    for angle in (0.0, 90.0, 180.0):
        scan = scattered_scan("cylinder", _ridge_all_round(angle), seed=12, arc_deg=360.0, vertices=100_000)
        assert len(found(scan)) == 1


def _ridge_all_round(angle_deg: float) -> Lift:
    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:  # noqa: ARG001
        x = np.abs(np.angle(np.exp(1j * (angle - np.radians(angle_deg))))) * r
        return np.asarray(1.5 * np.clip(1.0 - x, 0.0, None))

    return lift


def test_the_threshold_keeps_its_promise() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, seed=13)
    axis = exact_axis(scan)
    field = field_of(
        scan.vertices_mm, scan.faces, axis, fit_generatrix(scan.vertices_mm, scan.faces, axis), sigma_mm=None
    )
    limit = threshold(int((field.count > 0).sum()), false_calls_per_wheel=0.3)
    rng = np.random.default_rng(0)
    wheels, over = 60, 0
    for _ in range(wheels):
        noise = rng.normal(size=len(field.sigma_mm))
        score = summed(noise, field.flat_cell, field.count.shape)
        noisy = dataclasses.replace(field, deviation_mm=noise * field.sigma_mm, score=score)
        over += bool((np.abs(evidence_of(noisy).statistic) > limit).any())
    # At most 0.3 wheels in expectation: more than 0.3 + 3 sigma of 60 would be a broken promise.
    assert over / wheels < 0.3 + 3.0 * np.sqrt(0.3 * 0.7 / wheels)
    assert limit == pytest.approx(
        -norm.ppf(0.3 / 2 / sum(3 * (field.count > 0).sum() / (a * b) for a, b in BOXES))
    )


@pytest.mark.parametrize(
    ("size", "least", "most"), [((2, 12), 8.0, np.inf), ((1, 2), 0.0, 6.0)], ids=["burr", "spikes"]
)
def test_what_neighbours_share_hides_no_burr_and_no_spike_is_one(
    size: tuple[int, int], least: float, most: float
) -> None:
    """Where a box of n vertices varies √n times as much, a sum of 6 sigma each is as low as one of them."""
    shape, sigma = (484, 128), 0.05
    scan = revolution_scan("cylinder", sigma_mm=sigma, seed=15, shape=shape)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    field = field_of(scan.vertices_mm, scan.faces, axis, curve, sigma_mm=None)
    noise = 5.0 * uniform_filter(np.random.default_rng(0).normal(size=shape), 5)
    noise[200 : 200 + size[0], 60 : 60 + size[1]] = 400.0
    score = noise.ravel()[field.vertex]
    shared = dataclasses.replace(
        field,
        deviation_mm=score * field.sigma_mm,
        score=summed(np.clip(score, -CLIP, CLIP), field.flat_cell, field.count.shape),
        waves_mm=np.full(len(score), sigma),
    )
    strongest = float(evidence_of(shared).statistic.max())
    assert least < strongest < most


def test_seed_finds_the_angle_of_an_axial_burr() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, seed=14, burrs=(RidgeBurr(angle_deg=-17.0),))
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    (burr,) = burrs_seed(scan.vertices_mm, scan.faces, axis, curve, limit_mm=1.0)
    assert abs(turned(burr.angle_deg.value - angle_in_frame_deg(scan, axis, -17.0))) < 0.5
    assert burr.side == "protrusion"
    assert burr.within_limit is False
    assert burr.significance > 5.0


@pytest.mark.study
def test_the_printed_arctangent_loses_half_a_turn() -> None:
    """The same burr on the half x < 0 of the part frame and on the other: only one is stated where it is."""
    for angle_deg in (-60.0, -17.0, 40.0):
        scan = revolution_scan("cylinder", sigma_mm=0.05, seed=14, burrs=(RidgeBurr(angle_deg=angle_deg),))
        axis = exact_axis(scan)
        curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
        true = turned(angle_in_frame_deg(scan, axis, angle_deg))
        (kept,) = burrs_seed(scan.vertices_mm, scan.faces, axis, curve)
        (lost,) = burrs_seed_literal(scan.vertices_mm, scan.faces, axis, curve)
        assert abs(turned(kept.angle_deg.value - true)) < 0.5
        assert abs(turned(lost.angle_deg.value - true - (180.0 if abs(true) > 90.0 else 0.0))) < 0.5


def test_seed_answers_even_where_there_is_nothing() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, seed=15)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    (burr,) = burrs_seed(scan.vertices_mm, scan.faces, axis, curve)
    assert burr.significance < 4.0


def test_seed_cuts_triangles_as_the_paper_says() -> None:
    layers = np.array([0.2, 0.9, 1.1, 2.5, 1.0])
    faces = np.array([[0, 1, 0], [0, 1, 2], [2, 2, 3], [1, 3, 4]], dtype=np.int32)
    # Corner layers 0 0 0: not cut; 0 0 1: mean 1/3, plane 1; 1 1 2: mean 4/3, plane 2; 0 2 1: mean 1.
    assert _planes_cut(layers, faces).tolist() == [0, 1, 2, 2]


def test_angles_are_those_of_the_part_frame() -> None:
    scan = scattered_scan("cylinder", ridge(33.0, 1.5, 1.5), seed=16)
    axis = exact_axis(scan)
    (burr,) = found(scan)
    part = T_part_mesh(axis.point_mm, axis.direction)
    origin = part[:3, :3] @ burr.T_mesh_burr[:3, 3] + part[:3, 3]
    assert np.degrees(np.arctan2(origin[1], origin[0])) == pytest.approx(burr.angle_deg.value, abs=1e-6)


def test_what_lies_on_the_border_of_the_mesh_only_is_no_evidence() -> None:
    # The last column of pixels before a terminator is half lit, and off by many sigma, all of it together.
    scan = revolution_scan("cylinder", sigma_mm=0.02, seed=15, shape=(300, 100))
    vertices = scan.vertices_mm.reshape(300, 100, 3).copy()
    local = (vertices[-1] - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    outward = (local * [1.0, 1.0, 0.0] / np.hypot(local[:, :1], local[:, 1:2])) @ scan.T_mesh_part[:3, :3].T
    vertices[-1] += 0.2 * outward
    assert found(dataclasses.replace(scan, vertices_mm=vertices.reshape(-1, 3))) == ()


def test_sigmas_that_promise_too_much_are_raised() -> None:
    rng = np.random.default_rng(16)
    stated = np.where(np.arange(4000) < 1000, 0.08, 0.01)
    true = np.where(np.arange(4000) < 1000, 0.24, 0.01)
    raised = calibrated(stated, rng.normal(size=4000) * true)
    assert raised[:1000] == pytest.approx(0.24, rel=0.1)
    assert raised[1000:] == pytest.approx(0.01, rel=0.1)


def test_a_patch_that_is_stated_to_be_doubtful_is_no_burr() -> None:
    # Bounced light moves a whole patch; the scanner states a larger sigma there. Trusted, it is a burr.
    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        return np.asarray(0.3 * np.exp(-((angle * r) ** 2 + z**2) / 4.0))

    scan = scattered_scan("cylinder", lift, seed=21)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    part = (scan.vertices_mm - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    near = (np.abs(part[:, 1]) < 6.0) & (np.abs(part[:, 2]) < 6.0) & (part[:, 0] > 0.0)
    sigma = np.where(near, 0.15, 0.05)
    assert len(burrs_residual(scan.vertices_mm, scan.faces, axis, curve, sigma_mm=0.05)) == 1
    assert not burrs_residual(scan.vertices_mm, scan.faces, axis, curve, sigma_mm=sigma)


def test_a_rounded_edge_that_the_generatrix_misses_is_no_burr() -> None:
    def groove(z: Floats, _r: Floats, _angle: Floats) -> Floats:
        return np.asarray(-1.2 * (np.abs(z - 10.0) < 0.15))

    scan = scattered_scan("cylinder", groove, seed=22)
    axis = exact_axis(scan)
    plain = scattered_scan("cylinder", lambda z, _r, _a: 0.0 * z, seed=22)
    smooth = fit_generatrix(plain.vertices_mm, scan.faces, axis)
    assert burrs_residual(scan.vertices_mm, scan.faces, axis, smooth) == ()
    # It is narrower than a row of the field, but common to its parallels: nothing of it is left.
    field = field_of(scan.vertices_mm, scan.faces, axis, smooth, sigma_mm=None)
    z = field.foot[:, 0] * np.sign(axis.direction @ scan.direction) + z_offset_mm(scan, axis)
    middle = np.abs(z - 10.0) < 0.1
    assert field.step_mm > 0.5
    assert np.count_nonzero(middle) > 150
    assert abs(np.median(field.deviation_mm[middle])) < 0.05


@pytest.mark.parametrize("scale", [0.005, 50.0])
def test_a_burr_scales_with_the_part(scale: float) -> None:
    scan = revolution_scan(sigma_mm=0.05, shape=(242, 96), burrs=(RidgeBurr(width_deg=2.0),), seed=4)
    (burr,) = inspect_mesh(scan.vertices_mm, scan.faces).burrs
    (other,) = inspect_mesh(scale * scan.vertices_mm, scan.faces).burrs
    assert other.angle_deg.value == pytest.approx(burr.angle_deg.value, abs=1e-6)
    for name in ("height_mm", "width_mm", "length_mm"):
        one, scaled = getattr(burr, name), getattr(other, name)
        assert scaled.value == pytest.approx(scale * one.value, rel=1e-6)
        assert scaled.sigma == pytest.approx(scale * one.sigma, rel=1e-4)


@pytest.mark.parametrize("method", [burrs_seed, burrs_residual])
def test_a_generatrix_of_another_part_is_refused(method: Callable[..., tuple[Burr, ...]]) -> None:
    """It was an IndexError: no vertex lies near the curve, so that there is no arc."""
    scan = revolution_scan(sigma_mm=0.05, shape=(120, 40))
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    centre = scan.vertices_mm.mean(axis=0)
    with pytest.raises(InputError, match="near the generatrix"):
        method(centre + 9.0 * (scan.vertices_mm - centre), scan.faces, axis, curve)
