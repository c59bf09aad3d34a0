from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from burrscan.errors import InputError
from scenes.wheel import AxialRidge, BurrSpec, Nick, RimBurr, WheelSpec, build_wheel, load_wheel, wheel_names
from tests.scenes.wheels import CYLINDER, RING, STEPPED, edge_counts, face_normals, sampled_points, volume_mm3
from tests.tiers import some_of


@some_of("name", wheel_names(), first=4)
def test_every_wheel_of_the_catalogue_is_watertight_with_its_burrs(name: str) -> None:
    wheel = build_wheel(load_wheel(name))
    vertices, faces = wheel.welded()
    assert edge_counts(faces) == (True, True)
    assert len(wheel.burrs) >= 1
    assert set(np.unique(wheel.face_burr)) == {-1, *range(len(wheel.burrs))}
    assert np.ptp(vertices[:, 2]) > 40.0


def test_facets_stay_within_2_um_of_the_exact_cylinder_at_radius_100() -> None:
    wheel = build_wheel(CYLINDER)
    a, b, c = (wheel.vertices_mm[wheel.faces[:, i]] for i in range(3))
    # the chord's middle is the worst point: try the three edge middles and the centroid of every facet
    worst = np.concatenate([(a + b) / 2, (b + c) / 2, (c + a) / 2, (a + b + c) / 3])
    on_shell = np.abs(worst[:, 2]) < 30.0 - 1e-9
    sagitta = 100.0 - np.hypot(worst[on_shell, 0], worst[on_shell, 1])
    assert sagitta.min() > -1e-9
    assert 1e-4 < sagitta.max() < 0.002


def test_facets_stay_within_2_um_of_the_exact_torus_of_a_fillet() -> None:
    spec = WheelSpec("f", ((-30.0, 0.0), (-30.0, 100.0, 8.0), (30.0, 100.0), (30.0, 0.0)))
    wheel = build_wheel(spec)
    zr = np.stack([wheel.vertices_mm[:, 2], np.hypot(*wheel.vertices_mm[:, :2].T)], axis=1)
    on_arc = (zr[:, 0] < -22.0 + 1e-9) & (zr[:, 1] > 92.0 - 1e-9)
    faces = np.flatnonzero(on_arc[wheel.faces].all(axis=1))
    points = sampled_points(wheel, faces, per_face=4)
    off = np.hypot(points[:, 2] + 22.0, np.hypot(points[:, 0], points[:, 1]) - 92.0) - 8.0
    assert len(faces) > 10_000
    assert np.abs(off).max() < 0.002


def test_normals_are_those_of_the_exact_surface() -> None:
    wheel = build_wheel(RING, [AxialRidge(20.0, 1.0, 2.0, -5.0, 5.0)])
    bare = np.unique(wheel.faces[wheel.face_burr == -1])
    points, normals = wheel.vertices_mm[bare], wheel.normals[bare]
    radius = np.hypot(points[:, 0], points[:, 1])
    radial = np.stack([points[:, 0] / radius, points[:, 1] / radius, 0.0 * radius], axis=1)
    shell = (radius > 80.0 - 1e-6) & (np.abs(points[:, 2]) < 6.9)
    corner = (radius > 77.0 + 1e-6) & (points[:, 2] > 7.0 + 1e-6)
    to_centre = np.stack([points[:, 2] - 7.0, radius - 77.0], axis=1) / 3.0
    exact = to_centre[:, 1:] * radial + to_centre[:, :1] * np.array([0.0, 0.0, 1.0])
    assert np.abs(normals[shell] - radial[shell]).max() < 1e-5
    assert np.abs(normals[corner] - exact[corner]).max() < 1e-5
    assert corner.sum() > 1000


def test_sharp_edges_split_vertices_and_fillets_do_not() -> None:
    sharp = build_wheel(WheelSpec("s", ((-10.0, 50.0), (-10.0, 80.0), (10.0, 80.0), (10.0, 50.0))), ())
    n = len(sharp.welded()[0])
    seam = 8
    assert len(sharp.vertices_mm) == 2 * n + seam
    rounded = build_wheel(RING, ())
    sections = len(np.unique(rounded.uvs[:, 0])) - 1
    points = len(rounded.welded()[0]) // sections
    # no crease: only the seams of u and v repeat vertices
    assert len(rounded.vertices_mm) == (points + 1) * (sections + 1)


def test_normals_agree_with_faces_and_uv_runs_along_the_circumference() -> None:
    wheel = build_wheel(STEPPED, [AxialRidge(2.0, 1.0, 2.0, 5.0, 20.0), Nick(-40.0, 1.0, 3.0, -20.0, -10.0)])
    normals, area = face_normals(wheel)
    solid = area > 1e-6
    agreement = np.einsum("tci,ti->tc", wheel.normals[wheel.faces], normals)[solid].min()
    assert agreement > 0.9
    bare = solid & (wheel.face_burr == -1)
    a, b, c = (wheel.vertices_mm[wheel.faces[bare, i]] for i in range(3))
    uv_a, uv_b, uv_c = (wheel.uvs[wheel.faces[bare, i]] for i in range(3))
    (u1, v1), (u2, v2) = (uv_b - uv_a).T, (uv_c - uv_a).T
    dp_du = ((b - a) * v2[:, None] - (c - a) * v1[:, None]) / (u1 * v2 - u2 * v1)[:, None]
    middle = (a + b + c) / 3.0
    circumference = np.stack([-middle[:, 1], middle[:, 0], 0.0 * middle[:, 0]], axis=1)
    cosine = np.einsum("ij,ij->i", dp_du, circumference)
    cosine /= np.linalg.norm(dp_du, axis=1) * np.linalg.norm(circumference, axis=1)
    well = area[bare] > 1e-3
    assert np.quantile(cosine[well], 0.01) > 0.999
    # dp/du is one turn: its length is the circumference
    turn = np.linalg.norm(dp_du, axis=1) / (2.0 * np.pi * np.hypot(middle[:, 0], middle[:, 1]))
    shell = well & (np.abs(np.hypot(middle[:, 0], middle[:, 1]) - 100.0) < 0.01)
    assert np.allclose(turn[shell], 1.0, atol=1e-3)


def test_volume_of_a_bored_ring_is_pappus() -> None:
    wheel = build_wheel(WheelSpec("s", ((-10.0, 50.0), (-10.0, 80.0), (10.0, 80.0), (10.0, 50.0))), ())
    assert volume_mm3(wheel) == pytest.approx(np.pi * (80.0**2 - 50.0**2) * 20.0, rel=3e-5)


def test_either_sense_of_rotation_gives_the_same_wheel() -> None:
    back = WheelSpec("stepped", STEPPED.generatrix[::-1])
    assert volume_mm3(build_wheel(back, ())) == pytest.approx(volume_mm3(build_wheel(STEPPED, ())), rel=1e-12)


def test_a_wheel_of_1440_sections_builds_fast_and_bit_for_bit_alike() -> None:
    spec = load_wheel("paper")
    build_wheel(spec)
    start = time.process_time()
    wheel = build_wheel(spec, sections=1440)
    assert time.process_time() - start < 2.0
    again = build_wheel(spec, sections=1440)
    assert np.array_equal(wheel.vertices_mm, again.vertices_mm)
    assert np.array_equal(wheel.faces, again.faces)
    assert np.array_equal(wheel.normals, again.normals)


@st.composite
def _wheels(draw: st.DrawFn) -> WheelSpec:
    """Stepped wheels, solid or bored, with fillets that fit."""
    steps = draw(st.lists(st.tuples(st.floats(6.0, 25.0), st.floats(30.0, 100.0)), min_size=1, max_size=4))
    fillet = draw(st.sampled_from([0.0, 0.3, 1.0]))
    bore = draw(st.sampled_from([0.0, 12.0]))
    z = np.concatenate([[0.0], np.cumsum([length for length, _ in steps])])
    radii = [steps[0][1]]
    for _, radius in steps[1:]:
        radii.append(radius if abs(radius - radii[-1]) > 3.0 else radii[-1] + 4.0)
    shell = [(float(z[i + k]), r, fillet) for i, r in enumerate(radii) for k in (0, 1)]
    return WheelSpec("drawn", ((0.0, bore), *shell, (float(z[-1]), bore)))


@settings(max_examples=12, deadline=None)
@given(
    spec=_wheels(),
    angle=st.floats(-180.0, 180.0),
    height=st.floats(0.2, 3.0),
    width=st.floats(0.3, 5.0),
    lean=st.floats(-40.0, 40.0),
    variation=st.sampled_from([0.0, 0.5, 0.95]),
)
def test_any_wheel_with_burrs_is_closed_and_keeps_its_volume(
    spec: WheelSpec, angle: float, height: float, width: float, lean: float, variation: float
) -> None:
    z = [vertex[0] for vertex in spec.generatrix]
    length = max(z)
    burrs: list[BurrSpec] = [
        AxialRidge(angle, height, width, 0.1 * length, 0.8 * length, lean, variation),
        Nick(angle + 90.0, min(height, 1.5), width, -1.0, 0.4 * length, variation),
        RimBurr(angle + 180.0, 20.0, height, 0.5, (0.0, spec.generatrix[1][1]), "radial", variation),
    ]
    wheel = build_wheel(spec, burrs, facet_error_mm=0.01)
    assert edge_counts(wheel.welded()[1]) == (True, True)
    assert np.isfinite(wheel.normals).all()
    bare = volume_mm3(build_wheel(spec, (), facet_error_mm=0.01))
    signed = sum(b.volume_mm3 * (1.0 if b.side == "protrusion" else -1.0) for b in wheel.burrs)
    assert volume_mm3(wheel) - bare == pytest.approx(signed, rel=1e-6, abs=1e-6)


def test_overlapping_burrs_and_the_seam_stay_closed() -> None:
    burrs: list[BurrSpec] = [
        AxialRidge(0.0, 1.0, 2.0, 5.0, 25.0),
        AxialRidge(0.5, 2.0, 2.0, 10.0, 20.0, 20.0),
        RimBurr(0.0, 340.0, 1.0, 1.0, (30.0, 100.0), "axial"),
        Nick(180.0, 1.0, 2.0, -31.0, -20.0),
    ]
    wheel = build_wheel(STEPPED, burrs)
    assert edge_counts(wheel.welded()[1]) == (True, True)


@pytest.mark.parametrize(
    ("generatrix", "message"),
    [
        (((0.0, 0.0), (1.0, 1.0)), "at least 3"),
        (((0.0, -1.0), (1.0, 1.0), (2.0, 3.0)), "beyond the axis"),
        (((0.0, 1.0), (0.0, 1.0), (2.0, 3.0)), "repeated"),
        (((0.0, 1.0), (10.0, 10.0), (10.0, 1.0), (0.0, 10.0)), "crosses or touches itself"),
        (((0.0, 0.0), (0.0, 10.0), (10.0, 10.0)), "exactly one edge"),
        (((0.0, 0.0, 1.0), (0.0, 10.0), (10.0, 10.0), (10.0, 0.0)), "cannot have a fillet"),
        (((0.0, 0.0), (0.0, 10.0, 6.0), (10.0, 10.0, 6.0), (10.0, 0.0)), "make them smaller"),
        (((0.0, 1.0), (10.0, 1.0), (5.0, 1.0), (5.0, 8.0)), "touches itself|folds back"),
    ],
)
def test_a_bad_generatrix_is_refused_with_one_clear_message(
    generatrix: tuple[tuple[float, ...], ...], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        build_wheel(WheelSpec("bad", generatrix), ())  # type: ignore[arg-type]
