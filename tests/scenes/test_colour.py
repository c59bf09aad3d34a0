"""Scenes in colour: against the grey scene, against stock Mitsuba in rgb, and copper scanned."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from scipy import stats

from burrscan import InputError, Patterns
from burrscan.arrays import Floats, Floats32, Image
from burrscan.colour.mixing import measured_mixing
from burrscan.colour.scan import scan_colour
from burrscan.scan.adaptive import scan_adaptive
from scenes.colour import BANDS
from scenes.finish import finish_bsdf, named_finish, optical_constants
from scenes.pose import PoseSpec
from scenes.renderer import activate
from scenes.rig import RigSpec
from scenes.scene import load_scene, scene_document, scene_from
from scenes.simulate import Simulation, simulate
from scenes.transport import stock
from scenes.transport.optics import Optics
from scenes.transport.trace import trace
from scenes.transport.world import wheel_mesh
from scenes.wheel import build_wheel, load_wheel

CAMERA_MIX = [[1.0, 0.12, 0.03], [0.1, 1.0, 0.08], [0.02, 0.15, 1.0]]
PROJECTOR_MIX = [[1.0, 0.08, 0.01], [0.06, 1.0, 0.07], [0.01, 0.05, 1.0]]
FEW = {"most": 64}
"""Paths, where the light itself is not in question."""


@pytest.fixture(scope="module")
def mi() -> Iterator[Any]:
    module = activate()
    chosen = module.variant()
    if chosen.startswith("scalar"):
        pytest.skip("no vectorised Mitsuba variant on this machine; see 'burrscan doctor'")
    yield module
    module.set_variant(chosen)


def small(**tables: Any) -> Simulation:
    document = scene_document("paper") | {"rig": {"scale": 0.15}, **tables}
    return simulate(scene_from(document, source="test"))


def even(simulation: Simulation, levels: list[list[int]]) -> Patterns:
    shape = simulation.truth.rig.projector.shape
    frames = np.broadcast_to(np.array(levels, np.uint8)[:, None, None], (len(levels), *shape, 3))
    return Patterns(frames, tuple(str(n) for n in range(len(levels))))


def electrons(images: Image) -> Floats:
    return (images.astype(float) - 8.0) / (1015.0 / 10_000.0)


@pytest.fixture(scope="module")
def mono() -> Simulation:
    return small(finish="matte", render=FEW)


@pytest.mark.study
@pytest.mark.usefixtures("mi")
def test_a_grey_part_without_crosstalk_is_the_grey_scene(mono: Simulation) -> None:
    colour = small(finish="matte", channels="rgb", render=FEW)
    white = np.ones((1, *mono.truth.rig.projector.shape), np.float32)
    for band in colour.bands:
        assert np.array_equal(band.relight(white), mono.light.relight(white))
    assert np.array_equal(colour.truth.u_px, mono.truth.u_px, equal_nan=True)
    images = electrons(colour.scanner().capture(even(colour, [[255, 255, 255]]), 5.0))
    shape = mono.truth.rig.projector.shape
    shown = Patterns(np.full((1, *shape), 255, np.uint8), ("white",))
    grey = electrons(mono.scanner().capture(shown, 5.0))
    lit = mono.truth.direct > 0.1
    for c in range(3):
        off = (images[0, ..., c] - grey[0])[lit]
        sigma = np.sqrt(2.0 * (grey[0][lit].mean() + 36.0 + 97.0 / 12.0))
        assert abs(off.mean()) < 4.0 * sigma / np.sqrt(off.size)
        assert off.std() == pytest.approx(sigma, rel=0.1)  # each channel has noise of its own


def test_channels_are_the_stated_mixture() -> None:
    """One primary at full: the channels' light is C diag(band) P, pixel sums against the bands' own light."""
    simulation = small(
        finish={"name": "blasted", "metal": "copper"},
        channels="rgb",
        camera={"crosstalk": CAMERA_MIX},
        projector={"crosstalk": PROJECTOR_MIX, "contrast": 1e9},
        light={"ambient": 0.0},
        render=FEW,
    )
    images = electrons(simulation.scanner().capture(even(simulation, np.diag([255] * 3).tolist()), 20.0))
    white = np.ones((1, *simulation.truth.rig.projector.shape), np.float32)
    bands = np.stack([band.relight(white)[0] for band in simulation.bands])
    unclipped = bands.max(axis=0) < 0.7
    sums = bands[:, unclipped].sum(axis=1, dtype=float) * 10_000.0
    for primary in range(3):
        want = np.array(CAMERA_MIX) @ (sums * np.array(PROJECTOR_MIX)[:, primary])
        got = images[primary, unclipped].sum(axis=0)
        assert got == pytest.approx(want, rel=0.004, abs=4.0 * 6.8 * np.sqrt(unclipped.sum()))


@pytest.mark.study
def test_copper_has_the_colour_of_its_constants() -> None:
    simulation = small(finish={"name": "ground", "metal": "copper"}, channels="rgb", render={"bounces": 1})
    n, k = optical_constants("copper", (611.0, 549.0, 464.0))
    fresnel = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    light = np.array([band.white_direct.sum(dtype=float) for band in simulation.bands])
    assert light / light[0] == pytest.approx(fresnel / fresnel[0], rel=0.02)
    assert fresnel[0] > 1.4 * fresnel[2]


@pytest.mark.study
def test_the_bands_are_stock_mitsubas_colours(mi: Any) -> None:
    """Gold with interreflections, in Mitsuba's own rgb: every block of every band, z-tested at 99.9 %."""
    spec = RigSpec(scale=0.125)
    optics = Optics(spec.rig(), spec.standoff_mm)
    wheel = build_wheel(load_wheel("grooved_pulley"), facet_error_mm=0.02)
    pose = PoseSpec(elevation_deg=12.0, roll_deg=20.0).T_camera_part(standoff_mm=600.0, middle_z_mm=0.0)
    finish, runs = named_finish("ground", metal="gold"), 10
    view = optics.rig.projector
    light = np.broadcast_to(0.5 + 0.5 * np.sin(np.arange(view.width) / 3.0), view.shape).astype(np.float32)
    ours = []
    for band in BANDS:
        mesh = wheel_mesh(mi, wheel, pose, finish_bsdf(finish, channels=band))
        scene = mi.load_dict({"type": "scene", "wheel": mesh})
        ours.append(
            [
                trace(mi, scene, optics, samples=8, seed=i, error=0.2, most=64).relight(light[None])[0]
                for i in range(runs)
            ]
        )
    chosen = mi.variant()
    mi.set_variant("llvm_ad_rgb" if "llvm_ad_rgb" in mi.variants() and "llvm" in chosen else "scalar_rgb")
    try:
        mesh = wheel_mesh(mi, wheel, pose, finish_bsdf(finish, channels="rgb"))
        theirs = np.stack([_rgb(mi, mesh, optics, light, seed=i) for i in range(runs)])
    finally:
        mi.set_variant(chosen)
    a, b = _blocks(np.moveaxis(np.array(ours), 0, -1)), _blocks(theirs)
    variance = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / runs
    lit = b.mean(axis=0) > 1e-3
    t = (a.mean(axis=0) - b.mean(axis=0))[lit] / np.sqrt(variance[lit])
    assert lit.sum() > 60
    assert np.abs(t).max() < stats.t.isf(0.0005 / t.size, runs - 1)
    assert a.mean(axis=(0, 1, 2)) == pytest.approx(b.mean(axis=(0, 1, 2)), rel=0.01)
    red, _, blue = b.mean(axis=(0, 1, 2))
    assert red > 1.8 * blue


def _rgb(mi: Any, mesh: Any, optics: Optics, light: Floats32, *, seed: int) -> Floats32:
    """Stock Mitsuba's picture in colour, (h, w, 3)."""
    sensor = stock._sensor(mi, optics.rig.camera, 16)
    sensor["film"]["pixel_format"] = "rgb"
    integrator = {"type": "path", "max_depth": 4, "rr_depth": 1000, "hide_emitters": True}
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": integrator,
            "sensor": sensor,
            "emitter": stock._projector(mi, optics, light),
            "wheel": mesh,
        }
    )
    return np.array(mi.render(scene, seed=seed), dtype=np.float32)


def _blocks(images: Floats32) -> Floats:
    runs, h, w, bands = images.shape
    size = 16
    cut = images[:, : h // size * size, : w // size * size].astype(float)
    return np.asarray(cut.reshape(runs, h // size, size, w // size, size, bands).mean(axis=(2, 4)))


@pytest.fixture(scope="module")
def copper() -> Simulation:
    return small(
        finish={"name": "ground", "metal": "copper"},
        channels="rgb",
        camera={"crosstalk": CAMERA_MIX},
        projector={"crosstalk": PROJECTOR_MIX},
    )


def test_a_copper_wheel_is_scanned_in_colour(copper: Simulation) -> None:
    truth = copper.truth
    scan = scan_colour(copper.scanner())
    found = scan.correspondence
    off = (found.u_px - truth.u_response_px)[found.mask]
    assert scan.frames <= 35
    assert (found.mask & truth.measurable).sum() > 0.97 * truth.measurable.sum()
    assert np.mean(np.abs(off) > 1.0) < 0.004
    pulls = off / found.sigma_u_px[found.mask]
    assert 0.85 < 1.4826 * np.median(np.abs(pulls)) < 1.15
    assert np.median(found.sigma_u_px[found.mask]) < 0.02


def test_crosstalk_left_in_spoils_the_copper_scan(copper: Simulation) -> None:
    def spread(unmix: Any) -> float:
        found = scan_colour(copper.scanner(), method="fixed", unmix=unmix).correspondence
        pulls = ((found.u_px - copper.truth.u_response_px) / found.sigma_u_px)[found.mask]
        return float(1.4826 * np.median(np.abs(pulls)))

    assert 0.85 < spread("part") < 1.15
    assert 0.85 < spread("sheets") < 1.15
    assert spread("none") > 2.0


def test_the_mixing_measured_on_copper_is_the_planted_one(copper: Simulation) -> None:
    n, k = optical_constants("copper", (611.0, 549.0, 464.0))
    fresnel = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    want = np.array(CAMERA_MIX) @ np.diag(fresnel) @ np.array(PROJECTOR_MIX)
    mixing, _ = measured_mixing(copper.scanner())
    # interreflections are a little redder than the metal
    assert mixing.matrix / mixing.matrix[0, 0] == pytest.approx(want / want[0, 0], abs=0.015)


def test_grey_scans_and_scanners_in_colour_do_not_mix(copper: Simulation, mono: Simulation) -> None:
    with pytest.raises(InputError, match="strategy 'colour'"):
        scan_adaptive(copper.scanner())
    with pytest.raises(InputError, match="strategy 'colour'"):
        scan_colour(mono.scanner())


def test_the_catalogue_has_a_scene_in_colour() -> None:
    scene = load_scene("copper")
    assert scene.channels == "rgb"
    assert scene.finish.metal == "copper"
    assert len(scene.camera.crosstalk) == len(scene.projector.crosstalk) == 3
