"""Zones, blemishes and burr finishes: what the renderer meets, against closed forms and the truth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.finish import (
    FINISHES,
    FinishSpec,
    LocalFinish,
    finish_bsdf,
    named_finish,
    optical_constants,
    roughness_round,
    torn,
)
from scenes.renderer import activate
from scenes.scene import SceneSpec, scene_from
from scenes.simulate import optics_of, simulate
from scenes.surface import Blemish, BrightSpot, Chatter, Scratch, Stain, Zone, blemish_at, true_blemishes
from scenes.surface.parts import surface_parts, zone_ends_mm
from scenes.transport.hits import centre_hits
from scenes.transport.stock import stock_image
from scenes.transport.world import wheel_mesh, wheel_shapes
from scenes.wheel import AxialRidge, BurrSpec, Nick, Wheel, build_wheel
from tests.scenes.wheels import CYLINDER, edge_counts

SHINY = FinishSpec(alpha=0.1)
N, K = optical_constants("aluminium", (550.0,))
FRESNEL = float((((N - 1.0) ** 2 + K**2) / ((N + 1.0) ** 2 + K**2))[0])


def _scene(mi: Any, wheel: Wheel, finish: FinishSpec = SHINY, **surface: Any) -> Any:
    parts = surface_parts(wheel, finish, **surface)
    return mi.load_dict({"type": "scene", **wheel_shapes(mi, wheel, np.eye(4), parts, channels="mono")})


def _retroreflected(
    mi: Any, scene: Any, angle_deg: Floats, z_mm: Floats, tilt_rad: Floats | float = 0.0
) -> Floats:
    """(N,) reflection back along radial rays leaned by ``tilt_rad`` towards growing angles."""
    if mi.variant().startswith("scalar"):
        pytest.skip("needs a vectorised variant")
    angle, z, tilt = (
        np.broadcast_to(a, np.shape(angle_deg)) for a in np.broadcast_arrays(angle_deg, z_mm, tilt_rad)
    )
    at = np.radians(angle)
    out = np.stack([np.cos(at + tilt), np.sin(at + tilt), 0.0 * at])
    surface = np.stack([100.0 * np.cos(at), 100.0 * np.sin(at), z])
    start = surface + 50.0 * out
    ray = mi.Ray3f(mi.Point3f(*map(mi.Float, start)), mi.Vector3f(*map(mi.Float, -out)))
    hit = scene.ray_intersect(ray)
    value = hit.bsdf(ray).eval(mi.BSDFContext(), hit, hit.wi)
    return np.asarray(np.array(value[0], dtype=float) / np.array(hit.wi.z, dtype=float))


@pytest.mark.parametrize("angle", [0.0, 137.0, -180.0])
def test_a_stain_is_its_ellipse_and_nothing_else(angle: float) -> None:
    """Across the seam of u too. Half of it covered is at the rim in closed form; the truth says the same."""
    mi = activate()
    stain = Stain(
        angle_deg=angle, z_mm=3.0, length_mm=6.0, width_mm=10.0, waviness=0.0, cover=1.0, reflectance=0.25
    )
    scene = _scene(mi, build_wheel(CYLINDER, ()), blemishes=[stain])
    rng = np.random.default_rng(0)
    x, z = rng.uniform(-8.0, 8.0, 4000), rng.uniform(-3.0, 9.0, 4000)
    degrees = angle + np.degrees(x / 100.0)
    value = _retroreflected(mi, scene, degrees, z)
    metal = FRESNEL / (4.0 * np.pi * 0.1**2)
    radius = np.hypot(x / 5.0, (z - 3.0) / 3.0)
    # the rim is a blend over 8 % of the radius
    share = np.clip((1.0 - radius) / 0.08 + 0.5, 0.0, 1.0)
    assert np.allclose(value, metal * (1.0 - share) + share * 0.25 / np.pi, atol=0.02 * metal)
    at = np.radians(degrees)
    points = np.stack([100.0 * np.cos(at), 100.0 * np.sin(at), z], axis=1)
    owner = blemish_at(points, [stain], build_wheel(CYLINDER, ()).generatrix_zr_mm)
    clear = np.abs(radius - 1.0) > 0.005
    assert np.array_equal(owner[clear] == 0, radius[clear] < 1.0)


def test_every_blemish_lies_where_its_truth_says_also_over_others() -> None:
    mi = activate()
    wheel = build_wheel(CYLINDER, ())
    blemishes: list[Blemish] = [
        Chatter(z_start_mm=-12.0, z_end_mm=8.0, height_um=0.0, roughness=2.0),
        Stain(angle_deg=-1.0, z_mm=0.0, cover=1.0, reflectance=0.1, seed=2),
        BrightSpot(angle_deg=2.0, z_mm=9.0, seed=1),
        Scratch(angle_deg=0.0, z_mm=-6.0, length_mm=14.0, width_mm=1.0, depth_um=0.0, direction_deg=30.0,
                finish=LocalFinish(alpha=0.5)),
    ]  # fmt: skip
    scene = _scene(mi, wheel, blemishes=blemishes)
    rng = np.random.default_rng(1)
    degrees, z = rng.uniform(-6.0, 6.0, 6000), rng.uniform(-15.0, 14.0, 6000)
    value = _retroreflected(mi, scene, degrees, z)
    at = np.radians(degrees)
    points = np.stack([100.0 * np.cos(at), 100.0 * np.sin(at), z], axis=1)
    owner = blemish_at(points, blemishes, wheel.generatrix_zr_mm)
    peak = [FRESNEL / (4.0 * np.pi * alpha**2) for alpha in (0.1, 0.2, 0.08, 0.5)]
    expected = np.array([peak[1], 0.1 / np.pi, peak[2], peak[3], peak[0]])[owner]
    right = np.abs(value - expected) < 0.03 * expected
    assert {*np.unique(owner)} == {-1, 0, 1, 2, 3}
    for index in range(-1, 4):
        assert right[owner == index].mean() > (0.85 if index in {1, 2, 3} else 0.98), index  # soft rims


def test_the_scratch_is_as_wide_and_as_deep_as_said() -> None:
    """Its flanks turn the normal by its slope: the direction of the strongest reflection back tells."""
    mi = activate()
    scratch = Scratch(angle_deg=90.0, z_mm=0.0, length_mm=20.0, width_mm=0.2, depth_um=4.0,
                      direction_deg=90.0, finish=LocalFinish(alpha=0.1))  # fmt: skip
    scene = _scene(mi, build_wheel(CYLINDER, ()), blemishes=[scratch])
    x = np.linspace(-0.18, 0.18, 37)
    turned = np.array([_lean(mi, scene, 90.0 + np.degrees(one / 100.0), 1.0) for one in x])
    slope = np.where(np.abs(x) < 0.1, 0.004 * np.pi / 0.1 / 2.0 * np.sin(np.pi * x / 0.1), 0.0)
    # a surface that rises towards +x has a normal that leans towards -x
    inside = np.abs(np.abs(x) - 0.1) > 0.006
    assert np.allclose(turned[inside], -np.arctan(slope)[inside], atol=2.5e-3)
    assert np.abs(turned).max() > 0.05


def test_chatter_ripples_round_the_wheel_by_its_height_and_wavelength() -> None:
    mi = activate()
    chatter = Chatter(z_start_mm=-5.0, z_end_mm=5.0, wavelength_mm=2.0, height_um=8.0, roughness=1.0)
    scene = _scene(mi, build_wheel(CYLINDER, ()), blemishes=[chatter])
    waves = round(2.0 * np.pi * 100.0 / 2.0)
    degrees = np.linspace(-1.5, 1.5, 61)
    turned = np.array([_lean(mi, scene, one, 0.0) for one in degrees])
    height = 0.004 * waves / 100.0
    expected = np.arctan(height * np.sin(waves * np.radians(degrees)))
    assert np.allclose(turned, expected, atol=1.2e-3)
    assert abs(_lean(mi, scene, 0.3, 6.0)) < 2e-4


def _lean(mi: Any, scene: Any, angle_deg: float, z_mm: float) -> float:
    """Lean of the shading normal: the middle of the lobe that comes back."""
    tilt = np.linspace(-0.4, 0.4, 161)
    value = _retroreflected(mi, scene, np.full(161, angle_deg), np.full(161, z_mm), tilt)
    value = np.maximum(value - 0.3 * value.max(), 0.0)
    return float((tilt * value).sum() / value.sum())


def test_a_zone_ends_exactly_where_it_says_on_a_closed_mesh() -> None:
    mi = activate()
    zones = [Zone(z_start_mm=2.0, z_end_mm=7.5, finish=LocalFinish(alpha=0.3))]
    ridge = AxialRidge(0.0, 1.0, 2.0, -5.0, 15.0, finish=LocalFinish())
    wheel = build_wheel(CYLINDER, [ridge], cuts_mm=zone_ends_mm(zones))
    assert edge_counts(wheel.welded()[1]) == (True, True)
    scene = _scene(mi, wheel, burrs=[ridge], zones=zones)
    z = np.array([-20.0, 1.999, 2.001, 5.0, 7.499, 7.501, 20.0])
    value = _retroreflected(mi, scene, np.full(7, 50.0), z)
    alpha = np.sqrt(FRESNEL / (4.0 * np.pi * value))
    assert alpha == pytest.approx([0.1, 0.1, 0.3, 0.3, 0.3, 0.1, 0.1], rel=2e-3)


def test_roughness_varies_slowly_round_the_wheel() -> None:
    mi = activate()
    finish = FinishSpec(alpha=0.2, roughness_variation=0.4, roughness_seed=3)
    degrees = np.linspace(-180.0, 179.0, 90)
    value = _retroreflected(mi, _scene(mi, build_wheel(CYLINDER, ()), finish), degrees, np.zeros(90))
    alpha = np.sqrt(FRESNEL / (4.0 * np.pi * value))
    assert np.allclose(alpha, 0.2 * roughness_round(finish, degrees / 360.0), rtol=3e-3)
    assert np.abs(alpha / 0.2 - 1.0).max() == pytest.approx(0.4, abs=0.01)


def test_a_burr_is_rougher_than_the_wheel_unless_it_says_otherwise() -> None:
    for finish in FINISHES.values():
        rough = torn(finish)
        if finish.texture == "matte":
            assert rough == finish
            continue
        largest = max(finish.alpha_along, finish.alpha_across) if finish.texture == "turned" else finish.alpha
        assert rough.texture == "isotropic"
        assert rough.alpha == pytest.approx(max(0.3, 1.5 * largest))
    brass = named_finish("ground", metal="brass")
    assert LocalFinish(name="polished").on(brass) == named_finish("polished", metal="brass")
    assert LocalFinish(alpha=0.35).on(brass).alpha == 0.35
    assert LocalFinish().on(brass) == brass


def test_each_burr_has_its_own_finish_and_the_control_the_wheels() -> None:
    mi = activate()
    burrs: list[BurrSpec] = [
        AxialRidge(0.0, 1.0, 2.0, -5.0, 5.0, finish=LocalFinish()),
        AxialRidge(40.0, 1.0, 2.0, -5.0, 5.0),
        Nick(80.0, 1.0, 2.0, -5.0, 5.0, finish=LocalFinish(name="polished")),
    ]
    wheel = build_wheel(CYLINDER, burrs)
    parts = surface_parts(wheel, SHINY, burrs=burrs)
    alpha = np.full(len(wheel.faces), np.nan)
    for part in parts:
        alpha[part.faces] = part.finish.alpha
    for index, expected in {-1: 0.1, 0: 0.1, 1: 0.3, 2: 0.08}.items():
        assert (alpha[wheel.face_burr == index] == expected).all()
    assert len(surface_parts(wheel, SHINY, burrs=[burrs[0]])) == 1
    assert len(wheel_shapes(mi, wheel, np.eye(4), parts, channels="mono")) == 3


def _zoomed() -> tuple[SceneSpec, Wheel, Any, Any]:
    document = {
        "wheel": "cylinder", "finish": {"name": "ground"}, "rig": {"scale": 0.15},
        "burr": [{"kind": "axial_ridge", "angle_deg": 5.0, "height_mm": 2.0, "width_mm": 2.0,
                  "z_start_mm": -20.0, "z_end_mm": 20.0, "section": "rolled", "gap_share": 0.2,
                  "height_rms": 0.2}],
        "zone": [{"z_start_mm": -40.0, "z_end_mm": -10.0, "finish": "blasted"}],
        "blemish": [{"kind": "stain", "angle_deg": -10.0, "z_mm": 0.0, "length_mm": 12.0, "width_mm": 12.0},
                    {"kind": "chatter", "z_start_mm": 5.0, "z_end_mm": 20.0}],
    }  # fmt: skip
    scene = scene_from(document, source="here")
    wheel = build_wheel(scene.wheel, scene.burrs, cuts_mm=zone_ends_mm(scene.zone))
    parts = surface_parts(wheel, scene.finish, burrs=scene.burrs, zones=scene.zone, blemishes=scene.blemish)
    return scene, wheel, parts, scene.pose.T_camera_part(standoff_mm=scene.rig.standoff_mm, middle_z_mm=0.0)


@pytest.mark.parametrize("variant", ["chosen", "scalar_rgb"])
def test_pixels_know_their_face_however_many_meshes_there_are(variant: str) -> None:
    mi = activate()
    chosen = mi.variant()
    scene, wheel, parts, pose = _zoomed()
    try:
        if variant != "chosen":
            mi.set_variant(variant)
        channels: Any = "rgb" if mi.variant().endswith("rgb") else "mono"
        optics = optics_of(scene)
        many = mi.load_dict({"type": "scene", **wheel_shapes(mi, wheel, pose, parts, channels=channels)})
        one = mi.load_dict(
            {
                "type": "scene",
                "wheel": wheel_mesh(mi, wheel, pose, finish_bsdf(scene.finish, channels=channels)),
            }
        )
        found = centre_hits(mi, many, optics, faces_of={part.name: part.faces for part in parts})
        alone = centre_hits(mi, one, optics)
    finally:
        mi.set_variant(chosen)
    assert len(parts) > 3
    assert (found.faces >= 0).sum() > 1000
    assert (found.faces == alone.faces).mean() > 0.999  # a ray through an edge may choose either side
    assert np.allclose(found.points_mm, alone.points_mm, atol=1e-2, equal_nan=True)


def test_the_traced_light_is_that_of_stock_mitsuba_on_every_part() -> None:
    mi = activate()
    if mi.variant().startswith("scalar"):
        pytest.skip("nothing is traced by a scalar variant")
    scene, wheel, parts, pose = _zoomed()
    optics = optics_of(scene)
    truth = simulate(scene).truth
    shapes = wheel_shapes(mi, wheel, pose, parts, channels="mono")
    white = np.ones(optics.rig.projector.shape, np.float32)
    stock = stock_image(mi, shapes, optics, white, samples=256, bounces=1, seed=5)
    places = [
        truth.blemish_index == 0,
        truth.blemish_index == 1,
        truth.burr_index == 0,
        truth.blemish_index == -1,
    ]
    for place in places:
        assert place.sum() > 10
        assert truth.direct[place].mean() == pytest.approx(float(stock[place].mean()), rel=0.04)


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"zone": [{"z_start_mm": 1.0, "z_end_mm": 0.0, "finish": "ground"}]}, "zone 0: z_start_mm 1 must"),
        (
            {"zone": [{"z_start_mm": 0.0, "z_end_mm": 5.0, "finish": "ground"},
                      {"z_start_mm": 4.0, "z_end_mm": 9.0, "finish": "ground"}]},
            "zones overlap between z 4 and 5 mm",
        ),
        ({"blemish": [{"kind": "stain", "angle_deg": 0.0, "z_mm": 99.0}]}, "blemish 0: stain: z 99 mm is"),
        ({"blemish": [{"kind": "stain", "angle_deg": 0.0, "z_mm": 0.0, "width_mm": 400.0}]}, "is too much"),
    ],
)  # fmt: skip
def test_what_does_not_fit_the_wheel_is_refused(tables: dict[str, Any], message: str) -> None:
    scene = scene_from({"wheel": "cylinder", "finish": "ground", **tables}, source="here")
    wheel = build_wheel(scene.wheel, ())
    with pytest.raises(InputError, match=message):
        surface_parts(wheel, scene.finish, zones=scene.zone, blemishes=scene.blemish)


def test_every_mistake_in_a_scene_is_listed_at_once() -> None:
    tables = {
        "wheel": "cylinder", "finish": "ground",
        "burr": [{"kind": "rim", "angle_deg": 0, "arc_deg": 9, "height_mm": 1, "width_mm": 1, "edge": 2,
                  "section": "curly", "finish": "ruff"}],
        "blemish": [{"kind": "chatter", "z_start_mm": 0, "z_end_mm": 5, "height_um": 50}],
        "zone": [{"z_start_mm": 0, "z_end_mm": 5, "finsh": "ground"}],
    }  # fmt: skip
    with pytest.raises(InputError) as caught:
        scene_from(tables, source="here")
    for expected in ("section", "finish", "height_um", "did you mean 'finish'"):
        assert expected in str(caught.value)


def test_true_blemishes_have_their_extent() -> None:
    blemishes: Sequence[Any] = [
        Scratch(angle_deg=10.0, z_mm=0.0, length_mm=20.0, width_mm=0.1, direction_deg=0.0),
        Chatter(z_start_mm=-5.0, z_end_mm=10.0),
    ]
    scratch, chatter = true_blemishes(
        blemishes, build_wheel(CYLINDER, (), facet_error_mm=0.01).generatrix_zr_mm
    )
    assert scratch.kind == "scratch"
    assert [scratch.width_mm, scratch.length_mm] == pytest.approx([20.0, 0.1])
    assert scratch.arc_deg == pytest.approx(np.degrees(0.2))
    assert [chatter.z_start_mm, chatter.z_end_mm] == pytest.approx([-5.0, 10.0], abs=0.02)
    assert chatter.arc_deg == 360.0
