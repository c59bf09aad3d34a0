from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel import (
    AxialRidge,
    BurrSpec,
    Nick,
    RimBurr,
    WheelSpec,
    build_wheel,
    burr_at,
    deviation_mm,
    load_wheel,
)
from tests.scenes.wheels import CYLINDER, STEPPED, sampled_points
from tests.tiers import some_of

# a fillet of 1 mm between the cone of the rim test and its face begins tan(49.7 deg) = 1.180 mm from the edge
COS = float(np.cos(np.arctan2(10.0, 60.0)))
CONE = WheelSpec("cone", ((-40.0, 0.0), (-40.0, 90.0), (40.0, 60.0), (40.0, 0.0)))


@pytest.mark.parametrize("lean", [0.0, 30.0, -45.0])
@pytest.mark.parametrize("angle", [0.0, 137.0])
def test_a_ridge_on_a_cylinder_has_its_parameters(angle: float, lean: float) -> None:
    wheel = build_wheel(CYLINDER, [AxialRidge(angle, 1.5, 3.0, -10.0, 20.0, lean)])
    points = wheel.vertices_mm[np.unique(wheel.faces[wheel.face_burr == 0])]
    radius = np.hypot(points[:, 0], points[:, 1])
    assert radius.max() - 100.0 == pytest.approx(1.5, abs=1e-6)
    assert (points[:, 2].min(), points[:, 2].max()) == pytest.approx((-10.0, 20.0), abs=1e-9)
    base = points[radius < 100.001]
    off = 100.0 * np.arcsin(
        (base[:, 1] * np.cos(np.radians(angle)) - base[:, 0] * np.sin(np.radians(angle))) / 100
    )
    assert (off.min(), off.max()) == pytest.approx((-1.5, 1.5), abs=5e-3)
    (truth,) = wheel.burrs
    assert truth.height_mm == pytest.approx(1.5, abs=1e-6)
    assert truth.length_mm == 30.0
    # the triangle over the chord of its base, less the segment between chord and cylinder
    half = np.arcsin(1.5 / 100.0)
    tip = np.sqrt(101.5**2 - (1.5 * np.tan(np.radians(lean))) ** 2) - 100.0 * np.cos(half)
    segment = 100.0**2 * (half - np.sin(half) * np.cos(half))
    assert truth.area_mm2 == pytest.approx(tip * 1.5 - segment, rel=1.5e-3)
    assert truth.volume_mm3 == pytest.approx(truth.area_mm2 * 30.0)


def test_the_height_on_a_cone_is_along_the_normal() -> None:
    wheel = build_wheel(CONE, [AxialRidge(30.0, 1.0, 2.0, -30.0, 30.0)])
    slope = np.arctan2(30.0, 80.0)
    crest = wheel.burrs[0].ridge_mm
    radius = np.hypot(crest[:, 0], crest[:, 1])
    on_cone = 90.0 - (crest[:, 2] + 40.0) * np.tan(slope)
    assert np.allclose((radius - on_cone) * np.cos(slope), 1.0, atol=1e-6)
    assert np.allclose(wheel.burrs[0].deviation_mm, 1.0, atol=1e-6)


@some_of("name", ["paper", "vase", "grooved_pulley"])
def test_a_ridge_over_steps_and_fillets_never_exceeds_its_height(name: str) -> None:
    spec = load_wheel(name)
    z = np.array([vertex[0] for vertex in spec.generatrix])
    wheel = build_wheel(spec, [AxialRidge(-50.0, 1.0, 2.0, z.min() + 1.0, z.max() - 1.0)])
    assert wheel.burrs[0].height_mm == pytest.approx(1.0, abs=1e-3)
    inside = sampled_points(wheel, np.flatnonzero(wheel.face_burr == 0), per_face=3)
    assert deviation_mm(inside, wheel.generatrix_zr_mm).max() < 1.02
    followed = np.median(wheel.burrs[0].deviation_mm)
    assert followed == pytest.approx(1.0, abs=1e-3)


def test_the_height_varies_smoothly_by_seed() -> None:
    def crest(seed: int) -> Floats:
        ridge = AxialRidge(0.0, 1.0, 2.0, -25.0, 25.0, 0.0, 0.6, seed)
        return build_wheel(CYLINDER, [ridge]).burrs[0].deviation_mm

    heights = crest(1)
    assert heights.max() == pytest.approx(1.0, abs=1e-6)
    assert heights.min() == pytest.approx(0.4, abs=1e-6)
    assert np.abs(np.diff(heights)).max() < 0.1
    assert np.array_equal(heights, crest(1))
    assert not np.array_equal(heights, crest(2))


@pytest.mark.parametrize(
    ("edge", "direction", "expected_z"),
    [
        ((30.0, 100.0), "radial", (30.0 - 2.230 * COS, 30.0 - 1.230 * COS)),
        ((30.0, 100.0), "axial", (30.0, 30.8)),
        (1, "axial", (-30.8, -30.0)),
        (0, "radial", (-29.95, -28.95)),
    ],
)
def test_a_rim_burr_stands_on_its_edge(
    edge: int | tuple[float, float], direction: Literal["radial", "axial"], expected_z: tuple[float, float]
) -> None:
    spec = WheelSpec("w", ((-30.0, 40.0), (-30.0, 90.0, 1.0), (30.0, 100.0, 1.0), (30.0, 40.0)))
    wheel = build_wheel(spec, [RimBurr(170.0, 40.0, 0.8, 1.0, edge, direction)])
    (truth,) = wheel.burrs
    assert truth.height_mm == pytest.approx(0.8, abs=1e-3)
    assert (truth.z_start_mm, truth.z_end_mm) == pytest.approx(expected_z, abs=2e-3)
    angles = np.degrees(np.arctan2(truth.ridge_mm[:, 1], truth.ridge_mm[:, 0])) % 360.0
    assert (angles.min(), angles.max()) == pytest.approx((150.0, 190.0), abs=1e-9)
    # Pappus: the triangle turned by its arc
    centroid = float(np.hypot(*truth.ridge_mm[0, :2]))
    assert truth.volume_mm3 == pytest.approx(0.4 * np.radians(40.0) * centroid, rel=0.02)


def test_a_nick_is_as_deep_as_said_and_open_at_the_end() -> None:
    wheel = build_wheel(CYLINDER, [Nick(45.0, 1.2, 3.0, 10.0, 30.0)])
    (truth,) = wheel.burrs
    assert truth.side == "nick"
    assert truth.height_mm == pytest.approx(1.2, abs=1e-6)
    points = sampled_points(wheel, np.flatnonzero(wheel.face_burr == 0), per_face=5)
    assert np.hypot(points[:, 0], points[:, 1]).min() == pytest.approx(98.8, abs=0.01)
    assert deviation_mm(points, wheel.generatrix_zr_mm).max() < 1e-3
    # nothing of the end face is left in the notch
    face = (wheel.face_burr == -1) & (wheel.vertices_mm[wheel.faces, 2] > 30.0 - 1e-6).all(axis=1)
    on_face = sampled_points(wheel, np.flatnonzero(face), per_face=20)
    radius, angle = (
        np.hypot(on_face[:, 0], on_face[:, 1]),
        np.degrees(np.arctan2(on_face[:, 1], on_face[:, 0])),
    )
    in_notch = (radius > 99.5) & (np.abs(angle - 45.0) < 0.3)
    assert not in_notch.any()


def test_every_surface_point_knows_its_burr() -> None:
    burrs: list[BurrSpec] = [
        AxialRidge(5.0, 1.0, 2.0, 5.0, 25.0, 25.0, 0.5, 3),
        AxialRidge(8.0, 0.6, 1.5, 4.0, 20.0),
        RimBurr(-60.0, 30.0, 0.7, 1.0, (30.0, 100.0), "radial"),
        Nick(180.0, 1.0, 3.0, -25.0, -5.0),
    ]
    wheel = build_wheel(STEPPED, burrs)
    for index in range(-1, 4):
        faces = np.flatnonzero(wheel.face_burr == index)[::7]
        points = sampled_points(wheel, faces, per_face=2)
        found = burr_at(points, burrs=wheel.burrs, generatrix_zr_mm=wheel.generatrix_zr_mm)
        off = np.abs(deviation_mm(points, wheel.generatrix_zr_mm)) > 0.01
        clear = off if index >= 0 else np.full(len(points), True)
        assert (found[clear] == index).all(), index


@pytest.mark.parametrize("lean_deg", [-60.0, 60.0])
def test_a_crest_that_leans_far_over_is_its_burrs(lean_deg: float) -> None:
    """3 mm high, its crest hangs 5 mm beside a base of 1 mm; what floats elsewhere is nobody's."""
    wheel = build_wheel(CYLINDER, [AxialRidge(45.0, 3.0, 1.0, -10.0, 10.0, lean_deg)])
    (truth,) = wheel.burrs
    angle = np.degrees(np.arctan2(truth.ridge_mm[:, 1], truth.ridge_mm[:, 0])) - 45.0
    assert (angle * np.sign(lean_deg) > 2.5).all()
    found = burr_at(truth.ridge_mm, burrs=wheel.burrs, generatrix_zr_mm=wheel.generatrix_zr_mm)
    assert (found == 0).all()
    elsewhere = np.array(
        [[101.0 * np.cos(a), 101.0 * np.sin(a), 0.0] for a in np.radians([45.0 - 6.0, 45.0 + 6.0])]
    )
    nobody = burr_at(elsewhere, burrs=wheel.burrs, generatrix_zr_mm=wheel.generatrix_zr_mm)
    assert (nobody == -1).all()


@pytest.mark.parametrize(
    ("burr", "message"),
    [
        (AxialRidge(0.0, 1.0, 2.0, 10.0, 5.0), "must be less than"),
        (AxialRidge(0.0, 1.0, 2.0, 10.0, 50.0), "reaches beyond the wheel"),
        (AxialRidge(0.0, 1.0, 500.0, 0.0, 5.0), "does not fit"),
        (Nick(0.0, 1.0, 2.0, 40.0, 50.0), "misses the wheel"),
        (RimBurr(0.0, 10.0, 1.0, 2.0, 9), "no vertex 9"),
        (RimBurr(0.0, 10.0, 1.0, 90.0, (30.0, 100.0)), "does not fit"),
    ],
)
def test_a_burr_that_does_not_fit_is_refused(burr: BurrSpec, message: str) -> None:
    with pytest.raises(InputError, match=f"burr 0: .*{message}"):
        build_wheel(CYLINDER, [burr])


def test_a_rim_burr_on_an_inner_corner_is_refused() -> None:
    with pytest.raises(InputError, match="inner corner"):
        build_wheel(STEPPED, [RimBurr(0.0, 10.0, 1.0, 1.0, (0.0, 80.0))])


@pytest.mark.parametrize("burr", [AxialRidge(0.0, 1.0, 2.0, -20.0, 0.0), Nick(0.0, 1.0, 2.0, -20.0, 0.0)])
def test_a_burr_that_ends_at_a_wall_does_not_climb_it(burr: BurrSpec) -> None:
    # a sharp step from radius 80 to 100 at z = 0
    sharp = WheelSpec(
        "s", ((-30.0, 20.0), (-30.0, 80.0), (0.0, 80.0), (0.0, 100.0), (30.0, 100.0), (30.0, 20.0))
    )
    (truth,) = build_wheel(sharp, [burr]).burrs
    assert truth.height_mm == pytest.approx(1.0, abs=1e-3)
    assert truth.volume_mm3 == pytest.approx(20.0, rel=0.02)


def test_a_flat_wide_nick_on_a_small_radius_is_cut_cleanly() -> None:
    # its mouth's sagitta, 0.13 mm, is more than its depth
    hub = WheelSpec("hub", ((-20.0, 0.0), (-20.0, 30.0), (20.0, 30.0), (20.0, 0.0)))
    (truth,) = build_wheel(hub, [Nick(180.0, 0.06, 5.7, -22.0, 5.0)]).burrs
    assert 0.0 < truth.volume_mm3 < 25.0 * 5.7 * 0.135
