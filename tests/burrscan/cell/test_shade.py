"""The middle of a dark line on a drum, from a picture of it."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.shade import shade_centre
from burrscan.inspection import Axis, Generatrix, Inspection, Value
from burrscan.sight import Sight
from scenes.rig import RigSpec
from tests.burrscan.cell.parts import RADIUS_MM, burr, facing
from tests.tiers import some_of

_RIG = RigSpec(scale=0.5).rig()
_CAMERA = facing(0.0)
_PIXEL_MM = 600.0 / _RIG.camera.fx
_WIDTH_MM, _LENGTH_MM = 2.0, 10.0


def _inspection() -> Inspection:
    axis = Axis(_CAMERA[:3, 3], _CAMERA[:3, 2], np.eye(4) * 1e-8, "given")
    z = np.linspace(20.0, -20.0, 81)[::-1]  # counts from the camera's height
    line = Generatrix(z, np.full_like(z, RADIUS_MM), np.zeros_like(z), np.zeros_like(z))
    return Inspection(axis, line, (), T_part_mesh(axis.point_mm, axis.direction), np.empty(0))


def _sight(
    at_mm: float, *, dark: float = 3.0, lit_side: float = 0.0, highlight: float = 0.0, seed: int = 0
) -> Sight:
    """A drum with a dark line beside angle 0, one half of which is lighter by ``lit_side``."""
    rays = _RIG.camera.rays(_RIG.camera.pixel_grid()).reshape(-1, 3)
    part = np.linalg.inv(_CAMERA)
    way, start = rays @ part[:3, :3].T, part[:3, 3]
    a, b = (way[:, :2] ** 2).sum(axis=1), way[:, :2] @ start[:2]
    root = b**2 - a * (start[:2] @ start[:2] - RADIUS_MM**2)
    far = (-b - np.sqrt(np.maximum(root, 0.0))) / a
    points = start + far[:, None] * way
    beside = RADIUS_MM * np.arctan2(points[:, 1], points[:, 0]) - at_mm
    line = np.clip(1.2 - np.abs(beside) / (0.5 * _WIDTH_MM), 0.0, 0.4) / 0.4
    on = np.abs(points[:, 2] - 20.0) < 0.5 * _LENGTH_MM
    change = -np.where(on, line * (dark - lit_side * (beside > 0.0)), 0.0)
    bright = highlight * np.exp(-0.5 * ((beside + at_mm - 4.0) / 8.0) ** 2)
    noise = 0.01 * np.random.default_rng(seed).normal(size=len(points))
    radiance = np.where(root > 0.0, np.exp(change + bright + noise), np.nan)
    shape = _RIG.camera.shape
    unknown = np.full(shape, np.nan, np.float32)
    return Sight(radiance.reshape(shape).astype(np.float32), np.full((*shape, 3), np.nan), _RIG, unknown)


def _pose() -> Floats:
    """The burr in the camera's frame."""
    pose = np.array(burr(0.0).T_mesh_burr)
    pose[:3, 3] = [RADIUS_MM, 0.0, 20.0]
    return np.asarray(_CAMERA @ pose)


def _centre(sight: Sight, *, reach_mm: float = 1.0) -> Value | None:
    """Beside angle 0, as it counts: the burr's y runs against the angle."""
    found = shade_centre(
        sight, _inspection(), _pose(), width_mm=_WIDTH_MM, length_mm=_LENGTH_MM, reach_mm=reach_mm,
        pixel_mm=_PIXEL_MM,
    )  # fmt: skip
    return None if found is None else Value(-found.value, found.sigma)


@some_of("dark", [3.0, -1.0])
def test_the_middle_is_told_to_a_fraction_of_a_pixel(dark: float) -> None:
    errors, stated = [], []
    for seed, at in enumerate(np.linspace(-0.7, 0.7, 15)):
        found = _centre(_sight(float(at), dark=dark, seed=seed))
        assert found is not None
        errors.append(found.value - at)
        stated.append(found.sigma)
    rms = float(np.sqrt(np.mean(np.square(errors))))
    assert rms < 0.05 * _PIXEL_MM
    assert rms < 2.0 * float(np.sqrt(np.mean(np.square(stated)))) + 0.01 * _PIXEL_MM


@pytest.mark.parametrize("at_mm", [-5.0, -3.1, -1.7])
def test_a_line_is_found_as_far_off_as_a_part_may_have_been_moved(at_mm: float) -> None:
    found = _centre(_sight(at_mm, highlight=1.0), reach_mm=6.0)
    assert found is not None
    # beside angle 0 by the arc, here by the chord
    assert found.value == pytest.approx(RADIUS_MM * np.sin(at_mm / RADIUS_MM), abs=0.05)
    assert _centre(_sight(at_mm, highlight=1.0), reach_mm=0.5 * abs(at_mm)) is None


def test_a_highlight_behind_it_does_not_draw_it_aside() -> None:
    found = _centre(_sight(0.3, highlight=1.0))
    assert found is not None
    assert found.value == pytest.approx(0.3, abs=0.03)


@pytest.mark.parametrize("lit_side", [0.5, 1.0, 1.5, 2.0, 2.5, 3.0])
def test_a_line_lit_from_one_side_has_no_middle_or_says_so(lit_side: float) -> None:
    found = _centre(_sight(0.0, lit_side=lit_side))
    assert found is None or abs(found.value) < 3.0 * found.sigma


def test_where_no_line_is_none_is_told() -> None:
    assert _centre(_sight(0.0, dark=0.0)) is None


def test_light_that_is_not_known_tells_nothing() -> None:
    sight = _sight(0.0)
    radiance = np.array(sight.radiance)
    radiance[:, radiance.shape[1] // 2 - 1 : radiance.shape[1] // 2 + 2] = np.nan
    assert _centre(Sight(radiance, sight.points_mm, sight.rig, sight.sigma_mm)) is None
