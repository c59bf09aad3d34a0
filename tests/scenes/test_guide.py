"""Guides of light paths: learnt from directions of a known density, and held against it."""

from typing import Any

import drjit as dr
import numpy as np
import pytest

from burrscan.arrays import Floats
from scenes.transport.arrivals import Finds
from scenes.transport.guide import guide_of
from scenes.transport.rows import SparseRows
from scenes.transport.turn import CELLS, STRIPS, Guided, _density, turned

_SHAPE = (3, 5)
"""Pixels of the camera, which two tiles cover."""
_AXIS = np.array([0.48, -0.6, 0.64])


def directions(rng: np.random.Generator, count: int) -> Floats:
    """About an axis, three times as wide one way as the other."""
    one, other = np.array([0.8, 0.0, -0.6]), np.cross(_AXIS, [0.8, 0.0, -0.6])
    away = rng.normal(size=(count, 2)) * (0.3, 0.1)
    rays = _AXIS + away[:, :1] * one + away[:, 1:] * other
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def finds(rays: Floats, light: Floats) -> Finds:
    """All in the first pixel."""
    starts = np.full(_SHAPE[0] * _SHAPE[1] + 1, len(rays))
    starts[0] = 0
    rows = SparseRows(starts, np.arange(len(rays), dtype=np.int32), light.astype(np.float32))
    return Finds(rows, rays.astype(np.float32))


def flat(frame: Floats, rays: Floats) -> Floats:
    """Lambert's azimuthal equal-area map, written anew."""
    middle, side = frame.astype(float)
    angle = np.arccos(np.clip(rays @ middle, -1.0, 1.0))
    across, along = rays @ side, rays @ np.cross(middle, side)
    around = np.arctan2(along, across)
    return np.asarray(2.0 * np.sin(0.5 * angle) * np.stack([np.cos(around), np.sin(around)]))


def test_cells_hold_equal_light_of_what_was_not_learnt_from() -> None:
    rng = np.random.default_rng(0)
    guide = guide_of(np.array([0]), finds(directions(rng, 20000), np.ones(20000)), _SHAPE)
    a, b = flat(guide.frames[0], directions(rng, 20000))
    strip = np.searchsorted(guide.across[0], a) - 1
    inside = (strip >= 0) & (strip < STRIPS)
    assert inside.mean() > 0.98
    held = np.zeros((STRIPS, CELLS))
    for s, place in zip(strip[inside], b[inside], strict=True):
        cell = np.searchsorted(guide.along[0, s], place) - 1
        if 0 <= cell < CELLS:
            held[s, cell] += 1.0 / 20000
    inner = held[1:-1, 1:-1] * STRIPS * CELLS
    assert np.median(inner) == pytest.approx(1.0, abs=0.15)  # 15 % of the guide are even
    assert np.quantile(np.abs(inner - np.median(inner)), 0.9) < 0.4
    turned_by = np.array([[0.8, 0.0, -0.6], np.cross(_AXIS, [0.8, 0.0, -0.6])]) @ guide.frames[0, 1]
    assert abs(turned_by[0]) > 0.99  # the strips are cut across the longer way


def test_bright_paths_count_by_their_light_and_far_pixels_not_at_all() -> None:
    rng = np.random.default_rng(1)
    there, here = directions(rng, 4000), -directions(rng, 4000)
    light = np.concatenate([np.full(4000, 1e-3), np.ones(4000)])
    guide = guide_of(np.array([0, 4]), finds(np.concatenate([there, here]), light), _SHAPE)
    assert guide.tiles.tolist() == [0, 1]
    assert guide.frames[0, 0] @ -_AXIS > 0.99
    nobody = guide_of(np.array([4]), finds(directions(rng, 0), np.zeros(0)), _SHAPE)
    assert not nobody.known.any()


def test_one_path_with_light_makes_a_broad_guide() -> None:
    guide = guide_of(np.array([0]), finds(_AXIS[None], np.ones(1)), _SHAPE)
    middle = np.diff(guide.across[0])[STRIPS // 2]
    many = guide_of(np.array([0]), finds(np.repeat(_AXIS[None], 500, axis=0), np.ones(500)), _SHAPE)
    assert middle > 3.0 * np.diff(many.across[0])[STRIPS // 2]


def test_directions_are_drawn_by_the_density_that_they_are_weighted_by(mi: Any) -> None:
    """A black surface that a guide leaves no choice: weight times density is what it reflects, everywhere.

    The mean over guided directions of 1 / density is the solid angle that the guide reaches.
    """
    rng = np.random.default_rng(2)
    guide = guide_of(np.array([0]), finds(directions(rng, 3000), np.ones(3000)), _SHAPE)
    count = 1 << 18
    tables = [mi.Float(table.ravel()) for table in (guide.across, guide.along)]
    middle, side = (mi.Vector3f(*axis.tolist()) for axis in guide.frames[0])
    number = dr.zeros(mi.UInt32, count)
    guided = Guided(mi.Bool(True), middle, side, number, *tables)
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    lamp = mi.load_dict({"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 1.0}})
    ray = mi.Ray3f(mi.Point3f(0.0, 0.0, 1.0), mi.Vector3f(0.0, 0.0, -1.0))
    scene = mi.load_dict({"type": "scene", "one": lamp})
    si = dr.gather(type(si), scene.ray_intersect(ray), number)
    si.sh_frame = mi.Frame3f(middle)
    si.wi = mi.Vector3f(0.0, 0.0, 1.0)
    numbers = [mi.Float(rng.random(count).astype(np.float32)) for _ in range(3)]
    _, weight = turned(mi, si, guided, numbers[0], mi.Point2f(*numbers[1:]), mi.Bool(True))
    reflected = weight.numpy().astype(float)
    assert reflected.mean() == pytest.approx(1.0, abs=4.0 * reflected.std() / np.sqrt(count))
    assert reflected.max() < 2.0 + 1e-3  # the half that follows the reflection bounds every weight


def test_a_guides_density_is_one_over_all_directions(mi: Any) -> None:
    """Of directions even over a cap that holds the guide whole: to a hundredth, four standard errors."""
    rng, count, reach = np.random.default_rng(3), 1 << 21, 1.1
    guide = guide_of(np.array([0]), finds(directions(rng, 3000), np.ones(3000)), _SHAPE)
    assert np.hypot(np.abs(guide.across[0]).max(), np.abs(guide.along[0]).max()) < reach
    radius, around = reach * np.sqrt(rng.random(count)), 2.0 * np.pi * rng.random(count)
    middle, side = guide.frames[0].astype(float)
    local = (
        np.stack([np.cos(around), np.sin(around)], axis=1) * (radius * np.sqrt(1.0 - radius**2 / 4))[:, None]
    )
    rays = local @ np.stack([side, np.cross(middle, side)]) + (1.0 - radius**2 / 2)[:, None] * middle
    tables = [mi.Float(table.ravel()) for table in (guide.across, guide.along)]
    across, along = (mi.Vector3f(*axis.tolist()) for axis in guide.frames[0])
    guided = Guided(mi.Bool(True), across, along, mi.UInt32(0), *tables)
    density = _density(mi, guided, mi.Vector3f(*np.ascontiguousarray(rays.T.astype(np.float32))))
    shares = np.pi * reach**2 * density.numpy().astype(float)
    error = shares.std() / np.sqrt(count)
    assert error < 0.0025
    assert shares.mean() == pytest.approx(1.0, abs=4.0 * error)
