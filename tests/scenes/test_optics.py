"""Finite apertures and pixel gaps against the thin lens: blur circles, penumbrae, lit shares."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import special

from burrscan.arrays import Floats, Floats32
from burrscan.calibration.board import Board
from scenes.board import BoardSpec, board_light
from scenes.rig import DeviceSpec, RigSpec
from scenes.transport.optics import Optics
from scenes.transport.profile import PixelProfile
from scenes.transport.trace import trace

Z_MM = 600.0
EDGE = Board(2, 2, 200.0)
SAMPLES = 64
BOX_PX2 = 2.0 / 12.0
"""A camera pixel is a box, and so is the difference of two of them."""


def side_by_side(*, baseline_mm: float, camera: DeviceSpec, projector: DeviceSpec) -> Optics:
    """Camera and projector with parallel axes, which makes every plane z = const a plane of equal blur."""
    spec = RigSpec(
        camera=camera,
        projector=projector,
        baseline_mm=baseline_mm,
        projector_target_mm=(baseline_mm, 0.0, Z_MM),
    )
    return Optics(rig=spec.rig(), standoff_mm=Z_MM)


@pytest.fixture
def optics() -> Optics:
    return side_by_side(
        baseline_mm=1e-3,
        camera=DeviceSpec(width=200, height=32, focal_px=800.0),
        projector=DeviceSpec(width=128, height=64, focal_px=400.0),
    )


def plane(*, edge_at_mm: float | None = None) -> tuple[BoardSpec, Floats]:
    """A wide white board at Z_MM; or one whose left is white and right is black, from ``edge_at_mm`` on."""
    pose = np.eye(4)
    pose[:3, 3] = (-300.0 if edge_at_mm is None else edge_at_mm, -100.0, Z_MM)
    return BoardSpec(EDGE, black=0.8 if edge_at_mm is None else 0.0), pose


def spread_px2(image: Floats32) -> float:
    """Variance, px², of the edge across the middle of an image's rows: of its line spread."""
    line = np.abs(np.diff(image.astype(float).mean(axis=0)))
    line[line < 0.002 * line.max()] = 0.0
    at = np.arange(len(line))
    mean = (line * at).sum() / line.sum()
    return float((line * (at - mean) ** 2).sum() / line.sum())


def relit(optics: Optics, levels: Floats32, *, edge_at_mm: float | None = None) -> Floats32:
    spec, pose = plane(edge_at_mm=edge_at_mm)
    image: Floats32 = board_light(spec, pose, optics, samples=SAMPLES).relight(levels[None])[0]
    return image


def white(optics: Optics) -> Floats32:
    return np.ones(optics.rig.projector.shape, np.float32)


@pytest.mark.parametrize(
    ("aperture_mm", "focus_mm"), [(0.0, 600.0), (20.0, 500.0), (20.0, 750.0), (9.0, 400.0)]
)
def test_a_camera_out_of_focus_blurs_as_a_thin_lens(
    mi: Any, optics: Optics, aperture_mm: float, focus_mm: float
) -> None:
    """A disc of diameter D |1 - z / focus| in the object, whose line spread has a variance of (d / 4)²."""
    assert mi
    blurred = replace(optics, camera_aperture_mm=aperture_mm, camera_focus_mm=focus_mm)
    circle_px = optics.rig.camera.fx / Z_MM * aperture_mm * abs(1.0 - Z_MM / focus_mm)
    found = spread_px2(relit(blurred, white(optics), edge_at_mm=0.4))
    assert found == pytest.approx(BOX_PX2 + circle_px**2 / 16.0, rel=0.06, abs=0.1)


@pytest.mark.parametrize(("aperture_mm", "focus_mm"), [(0.0, 600.0), (25.0, 500.0), (25.0, 750.0)])
def test_a_projector_out_of_focus_blurs_as_a_thin_lens(
    mi: Any, optics: Optics, aperture_mm: float, focus_mm: float
) -> None:
    assert mi
    blurred = replace(optics, projector_aperture_mm=aperture_mm, projector_focus_mm=focus_mm)
    circle_px = optics.rig.camera.fx / Z_MM * aperture_mm * abs(1.0 - Z_MM / focus_mm)
    half = white(optics)
    half[:, 64:] = 0.0
    pixel_px = optics.rig.camera.fx / optics.rig.projector.fx
    profile = pixel_px**2 / 12.0  # full pixels add up to a sharp step; the lens's box of one pixel blurs it
    found = spread_px2(relit(blurred, half))
    assert found == pytest.approx(BOX_PX2 + profile + circle_px**2 / 16.0, rel=0.06, abs=0.1)


@pytest.mark.parametrize("lens", ["projector", "camera"])
def test_every_single_pixel_is_blurred_as_its_neighbours_are(mi: Any, optics: Optics, lens: str) -> None:
    """Columns and modulation of stripes of 6.5 px, pixel by pixel, not on the average over any.

    Sixteen places on the lens at random move columns by 0.2 px from pixel to pixel, and modulation by 15 %.
    """
    assert mi
    if lens == "projector":
        blurred = replace(optics, projector_aperture_mm=25.0, projector_focus_mm=500.0)
    else:
        blurred = replace(optics, camera_aperture_mm=25.0, camera_focus_mm=500.0)
    projector, step = blurred.rig.projector, 0.5  # of a camera's pixel, in projector pixels
    circle_px = projector.fx / Z_MM * 25.0 * abs(1.0 - Z_MM / 500.0)
    spec, pose = plane()
    light = board_light(spec, pose, blurred, samples=16)
    inside = (slice(8, -8), slice(20, -20))
    column = light.u_px[inside].astype(float)
    assert np.diff(column, axis=1).mean() == pytest.approx(step, rel=1e-3)
    straight = column.mean() + step * (np.arange(column.shape[1]) - 0.5 * (column.shape[1] - 1))
    assert np.std(column - straight) < 0.02
    turn = 2.0 * np.pi * np.arange(projector.width) / 6.5
    waves = [0.5 + 0.5 * np.cos(turn - 2.0 * np.pi * n / 3.0) for n in range(3)]
    frames = np.stack([np.tile(wave, (projector.height, 1)) for wave in waves]).astype(np.float32)
    seen = light.relight(frames)[(slice(None), *inside)].astype(float)
    phasor = np.tensordot(np.exp(2j * np.pi * np.arange(3) / 3.0), seen, axes=1) * 2.0 / 3.0
    kept = np.abs(phasor) / seen.mean(axis=0)
    airy = special.jv(1, np.pi * circle_px / 6.5) / (0.5 * np.pi * circle_px / 6.5)
    assert kept.mean() == pytest.approx(airy * np.sinc(step / 6.5) * np.sinc(1.0 / 6.5) ** 2, rel=0.02)
    assert kept.std() < 0.03 * kept.mean()


@pytest.mark.parametrize("aperture_mm", [0.0, 6.0, 12.0])
def test_penumbrae_are_as_wide_as_the_pupil_makes_them(mi: Any, aperture_mm: float) -> None:
    """An edge at z₁ before a plane at z₂: a penumbra of D (z₂ - z₁) / z₁."""
    optics = side_by_side(
        baseline_mm=200.0,
        camera=DeviceSpec(width=200, height=32, focal_px=800.0),
        projector=DeviceSpec(width=128, height=64, focal_px=300.0, cx=63.5 + 100.0),
    )
    optics = replace(optics, projector_aperture_mm=aperture_mm)
    edge_z_mm = 300.0
    turn = mi.ScalarTransform4f
    scene = mi.load_dict(
        {
            "type": "scene",
            "plane": {
                "type": "rectangle",
                "to_world": turn().translate([0.0, 0.0, Z_MM]) @ turn().scale(500.0),
                "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}},
            },
            "edge": {  # it begins at x = 100, half way between the projector and the plane's x = 0
                "type": "rectangle",
                "to_world": turn().translate([150.0, 0.0, edge_z_mm]) @ turn().scale([50.0, 200.0, 1.0]),
            },
        }
    )
    light = trace(mi, scene, optics, samples=SAMPLES, bounces=1)
    found = spread_px2(light.relight(white(optics)[None])[0])
    width_px = optics.rig.camera.fx / Z_MM * aperture_mm * (Z_MM - edge_z_mm) / edge_z_mm
    assert found == pytest.approx(BOX_PX2 + width_px**2 / 16.0, rel=0.06, abs=0.15)


@pytest.mark.parametrize("fill", [0.5, 0.75])
def test_gaps_between_pixels_stay_dark_and_take_no_light(mi: Any, fill: float) -> None:
    """Sharp pixels under a magnifying camera: a share of fill² is lit, and the mean light is what it was."""
    assert mi
    magnified = side_by_side(
        baseline_mm=1e-3,
        camera=DeviceSpec(width=160, height=160, focal_px=1600.0),
        projector=DeviceSpec(width=32, height=32, focal_px=100.0),
    )
    gaps = relit(replace(magnified, profile=PixelProfile(fill=fill, blur_px=0.0)), white(magnified))
    whole = relit(replace(magnified, profile=PixelProfile(fill=1.0, blur_px=0.0)), white(magnified))
    assert gaps.mean() == pytest.approx(whole.mean(), rel=0.02)
    assert (gaps > 0.5 * gaps.max()).mean() == pytest.approx(fill**2, abs=0.05)
    assert np.median(gaps[gaps > 0.9 * gaps.max()]) == pytest.approx(np.median(whole) / fill**2, rel=0.03)
