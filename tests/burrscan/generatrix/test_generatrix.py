from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.score.polyline import resample
from bench.synthetic.revolution import RevolutionScan, profile_of, random_pose, revolution_scan
from burrscan.axis.basis import T_part_mesh
from burrscan.errors import InputError
from burrscan.generatrix import METHODS, curve, deviation_mm, fit_generatrix
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Axis, Generatrix
from burrscan.variants import resolve
from tests.burrscan.parts import distance_to_polyline, exact_axis, whole_wheel, z_offset_mm

SHAPES = ["stepped_wheel", "cylinder", "cone", "flanged_hub", "plane", "torus", "vase", "sphere"]


def errors_mm(scan: RevolutionScan, axis: Axis, curve: Generatrix, shape: str) -> np.ndarray:
    nodes = np.stack([curve.z_mm + z_offset_mm(scan, axis), curve.r_mm], axis=1)
    return distance_to_polyline(nodes[np.isfinite(nodes).all(axis=1)], profile_of(shape))


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("sigma_mm", [0.05, 0.2])
def test_curve_lies_on_the_profile(shape: str, sigma_mm: float) -> None:
    scan = revolution_scan(shape, sigma_mm=sigma_mm, seed=3)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    assert np.sqrt(np.mean(errors_mm(scan, axis, curve, shape) ** 2)) < 0.4 * sigma_mm
    deviation = deviation_mm(scan.vertices_mm, axis, curve)
    assert np.isfinite(deviation).mean() > 0.999
    assert np.nanstd(deviation) == pytest.approx(sigma_mm, rel=0.05)


def test_curve_covers_the_profile() -> None:
    scan = revolution_scan("flanged_hub", sigma_mm=0.05, seed=1)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    nodes = np.stack([curve.z_mm + z_offset_mm(scan, axis), curve.r_mm], axis=1)
    assert not np.isnan(nodes).any()  # one piece, flat faces and undercut included
    corners = profile_of("flanged_hub")
    assert np.linalg.norm(nodes[:, None] - corners, axis=2).min(axis=0).max() < 0.5


def test_sigma_is_honest() -> None:
    scores = []
    for seed in range(6):
        scan = revolution_scan("cylinder", sigma_mm=0.05, seed=seed)
        axis = exact_axis(scan)
        curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
        scores.append((curve.r_mm - 90.0) / curve.sigma_mm)
    # 6 × 117 nodes: the standard deviation of their scores is known to 3 %; neighbours share vertices.
    assert 0.75 < np.std(np.concatenate(scores)) < 1.15


def test_band_is_the_span_of_the_data() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.1, seed=2)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    # Some 500 vertices at a node: their range is 6 to 7 sigma.
    assert 0.55 < np.nanmedian(curve.band_mm) < 0.7


@pytest.mark.parametrize("shape", SHAPES)
def test_outwards_is_where_the_faces_look(shape: str) -> None:
    scan = revolution_scan(shape, sigma_mm=0.02, seed=5, shape=(240, 100))
    outwards = _lifted(scan, 0.3)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    deviation = deviation_mm(outwards, axis, curve)
    assert np.nanmedian(deviation) == pytest.approx(0.3, abs=0.03)


def test_a_bore_and_its_faces_wound_the_other_way() -> None:
    bore = np.stack([np.linspace(30, -30, 80), np.full(80, 50.0)], axis=1)  # its left side looks inwards
    scan = revolution_scan(bore, sigma_mm=0.02, seed=6, shape=(240, 80))
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    inner = deviation_mm(_moved_radially(scan, -0.5), axis, curve)
    assert np.nanmedian(inner) == pytest.approx(0.5, abs=0.03)
    flipped = fit_generatrix(scan.vertices_mm, scan.faces[:, ::-1], axis)
    assert np.nanmedian(deviation_mm(_moved_radially(scan, -0.5), axis, flipped)) < -0.4


def _moved_radially(scan: RevolutionScan, by_mm: float) -> np.ndarray:
    foot = scan.point_mm + np.outer((scan.vertices_mm - scan.point_mm) @ scan.direction, scan.direction)
    arm = scan.vertices_mm - foot
    return np.asarray(scan.vertices_mm + by_mm * arm / np.linalg.norm(arm, axis=1, keepdims=True))


def _lifted(scan: RevolutionScan, by_mm: float) -> np.ndarray:
    """Every vertex moved along the mean normal of its faces."""
    a, b, c = (scan.vertices_mm[scan.faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    total = np.zeros_like(scan.vertices_mm)
    for i in range(3):
        np.add.at(total, scan.faces[:, i], normal)
    return np.asarray(scan.vertices_mm + by_mm * total / np.linalg.norm(total, axis=1, keepdims=True))


def test_an_arc_of_burr_is_not_the_surface() -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, seed=4)
    axis = exact_axis(scan)
    local = (scan.vertices_mm - scan.T_mesh_part[:3, 3]) @ scan.T_mesh_part[:3, :3]
    angle, z = np.degrees(np.arctan2(local[:, 1], local[:, 0])), local[:, 2]
    on = (np.abs(z - 5.0) < 2.0) & (angle > -60.0) & (angle < -10.0)
    vertices = np.where(on[:, None], _moved_radially(scan, 1.5), scan.vertices_mm)
    curve = fit_generatrix(vertices, scan.faces, axis)
    assert np.nanmax(np.abs(curve.r_mm - 90.0)) < 0.06


def test_outliers_and_missing_vertices_do_not_matter() -> None:
    scan = revolution_scan("stepped_wheel", sigma_mm=0.05, seed=7, outlier_share=0.1)
    vertices = scan.vertices_mm.copy()
    vertices[::50] = np.nan
    axis = exact_axis(scan)
    curve = fit_generatrix(vertices, scan.faces, axis)
    assert np.median(errors_mm(scan, axis, curve, "stepped_wheel")) < 0.02
    assert np.isnan(deviation_mm(vertices, axis, curve)[::50]).all()


def _turned(profile_zr: np.ndarray, *, seed: int) -> np.ndarray:
    """A cloud of a part turned about z as a scan shows it: at any place of the profile and any angle."""
    random = np.random.default_rng(seed)
    along = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(profile_zr, axis=0), axis=1)))
    at = random.uniform(0.0, along[-1], 80_000)
    z, r = (np.interp(at, along, profile_zr[:, i]) for i in range(2))
    segment = np.clip(np.searchsorted(along, at) - 1, 0, len(along) - 2)
    tangent = np.diff(profile_zr, axis=0)[segment]
    normal = np.stack([-tangent[:, 1], tangent[:, 0]], axis=1) / np.linalg.norm(tangent, axis=1)[:, None]
    z, r = np.stack([z, r]) + random.normal(scale=0.02, size=len(z)) * normal.T
    angle = np.radians(random.uniform(-60.0, 60.0, len(z)))
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)


def _rounded(radius_mm: float) -> np.ndarray:
    """A disc's rim from one face to the other, its two edges rounded; sharp where the radius is zero."""
    turn = np.linspace(0.0, 0.5 * np.pi, 60)
    first = np.stack([-45.0 + radius_mm * (1 - np.cos(turn)), 90.0 - radius_mm * (1 - np.sin(turn))], axis=1)
    last = first[::-1] * [-1.0, 1.0]
    profile = np.concatenate([[[-45.0, 5.0]], first, last, [[45.0, 5.0]]])
    return np.asarray(profile[np.append(True, np.linalg.norm(np.diff(profile, axis=0), axis=1) > 0.0)])


@pytest.mark.parametrize("radius_mm", [0.0, 0.5, 1.0, 2.0, 4.0])
def test_edges_are_as_round_as_the_data_show(radius_mm: float) -> None:
    """Nodes a cell apart (1.1 mm) cut a rounding of 1 mm by 0.13 mm, and a crease overshoots it by 0.4."""
    profile = _rounded(radius_mm)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    cloud = _turned(profile, seed=11)
    curve = fit_generatrix(cloud, np.empty((0, 3), np.int32), axis)
    nodes = np.stack([curve.z_mm, curve.r_mm], axis=1)
    off = distance_to_polyline(resample(nodes, step_mm=0.05), profile)
    assert np.sqrt(np.mean(off**2)) < 0.008
    assert off.max() < (0.15 if radius_mm == 0.5 else 0.08)


def test_a_burr_on_a_third_of_an_edge_is_no_rounding() -> None:
    profile = _rounded(1.0)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    cloud = _turned(profile, seed=12)
    angle = np.degrees(np.arctan2(cloud[:, 1], cloud[:, 0]))
    r = np.hypot(cloud[:, 0], cloud[:, 1])
    on = (np.abs(cloud[:, 2] - 44.0) < 1.0) & (r > 88.0) & (angle > 10.0) & (angle < 50.0)
    cloud[on, :2] *= (1.0 + 1.0 / r[on])[:, None]
    curve = fit_generatrix(cloud, np.empty((0, 3), np.int32), axis)
    nodes = np.stack([curve.z_mm, curve.r_mm], axis=1)
    assert distance_to_polyline(resample(nodes, step_mm=0.05), profile).max() < 0.1
    assert np.nanmedian(deviation_mm(cloud[on], axis, curve)) > 0.4


def test_a_burr_that_hides_more_of_an_edge_than_is_seen_of_the_face_beyond_is_no_curve(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From the end of a wheel: all of its face, a seventh of its cylinder, and a burr that stands out."""
    rng = np.random.default_rng(5)
    face_r, turn = 60.0 * np.sqrt(rng.uniform(size=18_000)), rng.uniform(-np.pi, np.pi, 18_000)
    beyond_z, about = rng.uniform(0.0, 15.0, 1_200), np.pi + rng.uniform(-0.45, 0.45, 1_200)
    flank, along = rng.uniform(0.0, 3.0, 700), rng.uniform(-0.25, 0.25, 700)
    face_r, turn = (one[(np.abs(turn) > 0.25) | (face_r < 59.0)] for one in (face_r, turn))
    r = np.concatenate([face_r, np.full(1_200, 60.0), 59.5 + flank])
    z = np.concatenate([np.zeros(len(face_r)), beyond_z, flank])
    angle = np.concatenate([turn, about, along])
    cloud = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
    cloud += rng.normal(0.0, 0.01, cloud.shape)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")

    def furthest_mm() -> float:
        return float(np.nanmax(fit_generatrix(cloud, np.empty((0, 3), np.int32), axis).r_mm))

    assert furthest_mm() == pytest.approx(60.0, abs=0.1)
    monkeypatch.setattr(curve, "without", lambda data, *_, **__: data)
    assert furthest_mm() > 60.5


def test_the_curve_ends_where_a_good_share_of_the_arc_has_data() -> None:
    """A rounding goes out of sight sooner here than there: what runs on beyond the data runs straight."""
    profile = _rounded(2.0)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    cloud = _turned(profile, seed=13)
    angle = np.degrees(np.arctan2(cloud[:, 1], cloud[:, 0]))
    cloud = cloud[cloud[:, 2] < 44.0 + angle / 60.0]  # the rounding is from 43 to 45 mm
    curve = fit_generatrix(cloud, np.empty((0, 3), np.int32), axis)
    nodes = np.stack([curve.z_mm, curve.r_mm], axis=1)
    assert distance_to_polyline(resample(nodes, step_mm=0.05), profile).max() < 0.1
    assert np.nanmax(curve.z_mm) == pytest.approx(44.3, abs=0.2)  # where 35 % of the arc has data


def test_a_cloud_has_no_faces() -> None:
    scan = revolution_scan("stepped_wheel", sigma_mm=0.05, seed=8)
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, np.empty((0, 3), np.int32), axis)
    assert np.sqrt(np.mean(errors_mm(scan, axis, curve, "stepped_wheel") ** 2)) < 0.03
    assert np.nanmedian(deviation_mm(_moved_radially(scan, 0.5), axis, curve)) > 0.3


def test_a_drawn_part_has_vertices_at_its_corners_only() -> None:
    ring = np.array([[0.0, 20.0], [0.0, 40.0], [60.0, 40.0], [60.0, 20.0], [0.0, 20.0]])
    vertices, faces = whole_wheel(ring, around=90)
    axis = Axis(np.array([0.0, 0.0, 30.0]), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    curve = fit_generatrix(vertices, faces, axis)
    nodes = np.stack([curve.z_mm, curve.r_mm], axis=1)
    assert distance_to_polyline(nodes[np.isfinite(nodes[:, 0])], ring).max() < 0.15
    assert distance_to_polyline(ring, nodes[np.isfinite(nodes[:, 0])]).max() < 0.3


def test_deviation_is_the_distance_to_the_nearest_segment() -> None:
    scan = revolution_scan("stepped_wheel", sigma_mm=0.3, seed=9, shape=(60, 60))
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    part = T_part_mesh(axis.point_mm, axis.direction)
    local = scan.vertices_mm @ part[:3, :3].T + part[:3, 3]
    points = np.stack([local[:, 2], np.hypot(local[:, 0], local[:, 1])], axis=1)
    nodes = polyline_of(curve).nodes_mm
    deviation = deviation_mm(scan.vertices_mm, axis, curve)
    known = np.isfinite(deviation)
    ends = np.min(np.linalg.norm(points[:, None] - nodes[[0, -1]], axis=2), axis=1) < 3.0
    inner = known & ~ends
    assert inner.sum() > 3000
    assert np.abs(deviation[inner]) == pytest.approx(distance_to_polyline(points[inner], nodes), abs=1e-9)


def test_pieces_are_parted_by_nan() -> None:
    z = np.concatenate([np.linspace(-30, -5, 60), np.linspace(8, 30, 60)])
    scan = revolution_scan("cylinder", sigma_mm=0.02, seed=10, shape=(200, 240))
    axis = exact_axis(scan)
    local = (scan.vertices_mm - scan.point_mm) @ scan.direction
    keep = (local < z[59]) | (local > z[60])
    curve = fit_generatrix(scan.vertices_mm[keep], np.empty((0, 3), np.int32), axis)
    assert np.isnan(curve.z_mm).sum() == 1
    assert np.isnan(curve.sigma_mm).sum() == np.isnan(curve.band_mm).sum() == 1
    assert len(polyline_of(curve).starts) == len(curve.z_mm) - 3


def test_no_curve_is_said() -> None:
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    none = np.empty((0, 3), np.int32)
    with pytest.raises(InputError, match="coincide"):
        fit_generatrix(np.ones((300, 3)), none, axis)


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 1000), exponent=st.floats(-2.0, 2.0))
def test_motion_scale_and_order_leave_the_curve_unchanged(seed: int, exponent: float) -> None:
    scan = revolution_scan("stepped_wheel", sigma_mm=0.05, seed=1, shape=(150, 100))
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    rng = np.random.default_rng(seed)
    factor, pose = 10.0**exponent, random_pose(rng)
    order = rng.permutation(len(scan.vertices_mm))
    vertices = factor * (scan.vertices_mm @ pose[:3, :3].T + pose[:3, 3])[order]
    faces = np.argsort(order)[scan.faces].astype(np.int32)[rng.permutation(len(scan.faces))]
    direction = pose[:3, :3] @ axis.direction
    moved = Axis(factor * (pose[:3, :3] @ axis.point_mm + pose[:3, 3]), direction, np.zeros((4, 4)), "exact")
    other = fit_generatrix(vertices, faces, moved)
    assert np.allclose(other.r_mm, factor * curve.r_mm, rtol=0.0, atol=1e-5 * factor)
    from_origin = factor * float(direction @ pose[:3, 3])  # z counts from the mesh's origin, which stays
    assert np.allclose(other.z_mm - from_origin, factor * curve.z_mm, rtol=0.0, atol=1e-5 * factor)


def test_every_method_fits_a_wheel() -> None:
    scan = revolution_scan("vase", sigma_mm=0.05, seed=11)
    axis = exact_axis(scan)
    for name in METHODS:
        curve = resolve(name, METHODS, stage="generatrix")(scan.vertices_mm, scan.faces, axis, sigma_mm=None)
        assert np.median(errors_mm(scan, axis, curve, "vase")) < 0.1, name


def test_pieces_lie_as_far_apart_as_they_are_or_as_is_asked() -> None:
    z = np.array([0.0, 10.0, np.nan, 10.0, 13.0, np.nan, 40.0, 42.0])
    r = np.array([50.0, 50.0, np.nan, 54.0, 54.0, np.nan, 54.0, 54.0])
    line = polyline_of(Generatrix(z, r, np.zeros(8), np.zeros(8)))
    assert line.along_mm == pytest.approx([0.0, 10.0, 13.0])
    assert line.apart_mm(9.0) == pytest.approx([0.0, 14.0, 26.0])
    assert line.apart_mm(0.0) == pytest.approx(line.along_mm)
