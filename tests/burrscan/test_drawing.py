"""Meshes as CAD draws them, inspected: wheels that nothing was tuned to, through every file format."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import trimesh

import burrscan
from bench.synthetic.clean_command import PARTS
from bench.synthetic.depth_view import single_view
from bench.synthetic.revolution import RidgeBurr, random_pose, revolution_scan
from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.agreement import agreed
from burrscan.drawing import sampled
from burrscan.inspection import Axis, Inspection
from burrscan.meshio import read_mesh
from scenes.wheel import Wheel, build_wheel, load_wheel
from scenes.wheel.spec import AxialRidge, WheelSpec
from tests.burrscan.parts import turned, whole_wheel
from tests.tiers import some_of

UP = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")


def drawn(seed: int) -> Wheel:
    """A stepped wheel of any size with ridges on its steps, drawn with facets of any error."""
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.3, 1.5)
    steps = int(rng.integers(2, 4))
    edges = np.linspace(-30.0, 30.0, steps + 1) * size
    outline = [(edges[0], 20.0 * size)]
    burrs = []
    for k, radius in enumerate(rng.uniform(75.0, 100.0, steps) * size):
        outline += [(edges[k], radius), (edges[k + 1], radius + rng.uniform(-3.0, 3.0) * size)]
        height = rng.uniform(0.3, 2.5) * size
        burrs.append(
            AxialRidge(
                angle_deg=-150.0 + 100.0 * k + rng.uniform(0.0, 50.0),
                height_mm=height,
                width_mm=height + 0.8 * size,
                z_start_mm=edges[k] + 4.0 * size,
                z_end_mm=edges[k + 1] - 4.0 * size,
            )
        )
    outline.append((edges[-1], 20.0 * size))
    spec = WheelSpec(name="drawn", generatrix=tuple(outline))
    return build_wheel(spec, burrs, facet_error_mm=float(rng.choice([0.005, 0.02, 0.1])) * size)


@lru_cache
def paper(facet_error_mm: float) -> tuple[Wheel, Inspection]:
    """The catalogue's wheel as it is drawn, and what is found on it."""
    wheel = build_wheel(load_wheel("paper"), facet_error_mm=facet_error_mm)
    return wheel, burrscan.inspect_mesh(*wheel.welded())


def assert_found(wheel: Wheel, found: Inspection, T_mesh_part: Floats, *, within: float) -> None:
    """Every burr, and no other: angle, place and height; heights within a share of their own."""
    part = np.linalg.inv(T_mesh_part)
    assert len(found.burrs) == len(wheel.burrs)
    for true in wheel.burrs:
        places = [(part @ burr.T_mesh_burr)[:3, 3] for burr in found.burrs]
        off = [abs(turned(float(np.degrees(np.arctan2(p[1], p[0]))) - true.angle_deg)) for p in places]
        nearest = int(np.argmin(off))
        burr = found.burrs[nearest]
        assert off[nearest] < 0.1
        assert true.z_start_mm < places[nearest][2] < true.z_end_mm
        assert burr.height_mm.value == pytest.approx(true.height_mm, rel=within, abs=0.05)
        assert abs(burr.height_mm.value - true.height_mm) < 2.0 * burr.height_mm.sigma
        assert burr.width_mm.value == pytest.approx(true.width_mm, rel=0.15)


@some_of("seed", [1, 0, *range(2, 9)])
def test_burrs_of_drawn_wheels_are_found_and_measured(seed: int, tmp_path: Path) -> None:
    wheel = drawn(seed)
    vertices, faces = wheel.welded()
    pose = np.eye(4) if seed % 2 else random_pose(np.random.default_rng(seed))
    path = tmp_path / f"wheel.{('ply', 'stl', 'obj')[seed % 3]}"
    trimesh.Trimesh(vertices @ pose[:3, :3].T + pose[:3, 3], faces, process=False).export(path)
    mesh = read_mesh(path)
    found = burrscan.inspect_mesh(mesh.vertices_mm, mesh.faces)
    assert_found(wheel, found, pose, within=0.1)
    assert "facets" in {check.name for check in found.checks if check.passed}


@pytest.mark.study
@pytest.mark.parametrize("facet_error_mm", [0.02, 0.005, 0.1])
def test_finer_facets_do_not_change_a_burr(facet_error_mm: float) -> None:
    """A burr of 1.5 mm read 3.1, 2.6, 2.3 mm."""
    wheel, found = paper(facet_error_mm)
    assert_found(wheel, found, np.eye(4), within=0.1)


@pytest.mark.study
def test_a_burr_is_where_the_drawing_has_it() -> None:
    """The part frame of a part drawn along z at its origin is the drawing's own."""
    wheel, found = paper(0.02)
    np.testing.assert_allclose(found.T_part_mesh, np.eye(4), atol=2e-3)
    for burr, true in zip(sorted(found.burrs, key=lambda b: b.angle_deg.value), (1, 0, 2), strict=True):
        assert burr.angle_deg.value == pytest.approx(wheel.burrs[true].angle_deg, abs=0.1)
        assert burr.z_start_mm.value == pytest.approx(wheel.burrs[true].z_start_mm, abs=0.5)
        assert burr.z_end_mm.value == pytest.approx(wheel.burrs[true].z_end_mm, abs=0.5)


def test_a_drawn_wheel_without_burrs_has_none() -> None:
    wheel = build_wheel(load_wheel("paper"), [], facet_error_mm=0.02)
    assert burrscan.inspect_mesh(*wheel.welded()).burrs == ()


@pytest.mark.study
@pytest.mark.parametrize(
    ("count", "height_mm", "width_mm", "section"),
    [
        (12, 2.0, 2.0, "triangle"),
        pytest.param(14, 1.06, 1.44, "rounded", marks=pytest.mark.study),
        pytest.param(22, 0.89, 0.69, "rounded", marks=pytest.mark.study),
        pytest.param(30, 0.9, 1.2, "triangle", marks=pytest.mark.study),
    ],
)
def test_many_burrs_that_are_alike_are_no_surface(
    count: int, height_mm: float, width_mm: float, section: Literal["triangle", "rounded"]
) -> None:
    """Their crests lie on a circle; and a drawing's own vertices crowd on them, in their rows."""
    burrs = [
        AxialRidge(
            angle_deg=angle,
            height_mm=height_mm,
            width_mm=width_mm,
            z_start_mm=1.0,
            z_end_mm=19.0,
            section=section,
        )
        for angle in -175.0 + 360.0 / count * np.arange(count)
    ]
    wheel = build_wheel(load_wheel("stepped_hub"), burrs, facet_error_mm=0.02)
    assert_found(wheel, burrscan.inspect_mesh(*wheel.welded()), np.eye(4), within=0.02)


@pytest.mark.study
def test_a_drawing_inside_out_is_the_same_drawing() -> None:
    wheel, _ = paper(0.02)
    vertices, faces = wheel.welded()
    turned_inside_out = burrscan.inspect_mesh(vertices, faces[:, ::-1])
    assert_found(wheel, turned_inside_out, np.eye(4), within=0.1)
    assert {burr.side for burr in turned_inside_out.burrs} == {"protrusion"}


@pytest.mark.study
def test_a_drawing_with_a_stated_sigma_is_the_same_drawing() -> None:
    wheel, _ = paper(0.02)
    assert_found(wheel, burrscan.inspect_mesh(*wheel.welded(), sigma_mm=0.01), np.eye(4), within=0.1)


@pytest.mark.study
def test_facets_too_coarse_for_the_burrs_are_said_to_be() -> None:
    wheel = build_wheel(load_wheel("paper"), facet_error_mm=0.05, sections=24)
    failed = {
        check.name: check for check in burrscan.inspect_mesh(*wheel.welded()).checks if not check.passed
    }
    assert "smaller chord tolerance" in failed["facets"].reason


def test_a_scan_is_no_drawing() -> None:
    noisy = revolution_scan(sigma_mm=0.005, shape=(120, 40), burrs=(RidgeBurr(),))  # few vertices, far apart
    clean = revolution_scan(shape=(484, 128))  # no noise, but vertices as close as samples would be
    for scan in (noisy, clean):
        axis = Axis(scan.point_mm, scan.direction, np.zeros((4, 4)), "exact")
        assert sampled(scan.vertices_mm, scan.faces, axis) is None
    assert sampled(noisy.vertices_mm, np.empty((0, 3), np.int32), axis) is None


@pytest.mark.parametrize("reach_px", [10.0, 40.0])
@pytest.mark.parametrize("view", [(1.0, 0.0, 0.0), (0.9, 0.2, 0.4)], ids=["rows along parallels", "aslant"])
def test_a_scan_whose_noise_is_smooth_is_no_drawing(view: tuple[float, ...], reach_px: float) -> None:
    """Facets beside each other are as flat as a drawing's (37 to 60 % of edges); they stand in no rings."""
    ring = np.array(
        [[0.0, 40.0], [0.0, 90.0], [30.0, 90.0], [30.0, 100.0], [90.0, 100.0], [90.0, 40.0], [0.0, 40.0]]
    )
    seen = single_view(
        *whole_wheel(ring, around=720), np.array(view), pixels=200, sigma=0.2, reach_px=reach_px, seed=1
    )
    assert sampled(*seen, UP) is None


@some_of("part", ["ovals", "flutes", "spokes", "treads"])
def test_drawings_of_parts_that_are_not_round_are_drawings(part: str) -> None:
    """Of the edges of a fluted vase only a twentieth run along parallels."""
    for number in range(3):
        assert sampled(*PARTS[part](np.random.default_rng((list(PARTS).index(part), number))), UP) is not None


def test_samples_lie_on_the_surface_that_the_facets_stand_for() -> None:
    """Two rings of twelve: the facets are 3.4 mm inside the cylinder, the samples on it."""
    ring = np.array([[0.0, 40.0], [0.0, 100.0], [60.0, 100.0], [60.0, 40.0], [0.0, 40.0]])
    vertices, faces = whole_wheel(ring, around=12)
    drawing = sampled(vertices, faces, UP)
    assert drawing is not None
    new = drawing.vertices_mm[len(vertices) :]
    radius = np.hypot(new[:, 0], new[:, 1])
    wall = (new[:, 2] > 1e-6) & (new[:, 2] < 60.0 - 1e-6) & (radius > 60.0)
    np.testing.assert_allclose(radius[wall], 100.0, atol=1e-9)
    assert drawing.facet_error_mm == pytest.approx(100.0 * (1.0 - np.cos(np.radians(15.0))), rel=0.1)
    assert not drawing.check(UP).passed


def test_samples_are_even_and_always_the_same() -> None:
    ring = np.array([[0.0, 40.0], [0.0, 100.0], [60.0, 100.0], [60.0, 40.0], [0.0, 40.0]])
    vertices, faces = whole_wheel(ring, around=200)
    one, two = (sampled(vertices, faces, UP) for _ in range(2))
    assert one is not None
    assert two is not None
    np.testing.assert_array_equal(one.vertices_mm, two.vertices_mm)
    new = one.vertices_mm[len(vertices) :]
    wall = np.hypot(new[:, 0], new[:, 1]) > 99.9
    count, _, _ = np.histogram2d(np.arctan2(new[wall, 1], new[wall, 0]), new[wall, 2], bins=(30, 6))
    assert count.min() > 0.9 * count.max()


@pytest.mark.study
def test_the_burrs_of_a_drawing_agree_with_themselves() -> None:
    _, found = paper(0.02)
    frame = T_part_mesh(found.axis.point_mm, found.axis.direction)
    assert agreed(found.burrs, frame, method="residual") == found.burrs
