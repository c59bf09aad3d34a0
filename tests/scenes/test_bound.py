"""The Cramér-Rao bound against the closed form of a sine in constant noise."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from burrscan.arrays import Floats, Floats32
from burrscan.scanner import Patterns
from scenes.bound import bounds_of
from scenes.scene import SceneSpec, scene_from
from scenes.shots import Shot
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows

HEIGHT, WIDTH, FRAMES, PERIOD_PX = 8, 64, 8, 16.0


def point_transport() -> LightTransport:
    """Every camera pixel sees the projector pixel of the same number, and nothing else."""
    count = HEIGHT * WIDTH
    rows = SparseRows(np.arange(count + 1), np.arange(count, dtype=np.int32), np.full(count, 0.5, np.float32))
    zero = np.zeros((HEIGHT, WIDTH), np.float32)
    shape = HEIGHT, WIDTH
    return LightTransport(shape, shape, rows, empty_rows(count), zero, zero, zero, zero, zero)


def sines(*, dim: float = 1.0, rows: int = HEIGHT, period_px: float = PERIOD_PX) -> Patterns:
    turns = np.arange(WIDTH) / period_px - np.arange(FRAMES)[:, None] / FRAMES
    levels = np.rint(255 * dim * (0.5 + 0.5 * np.cos(2 * np.pi * turns))).astype(np.uint8)
    frames = np.repeat(levels[:, None, :], rows, axis=1)
    return Patterns(frames, tuple(f"{n}" for n in range(FRAMES)))


def scene(**camera: Any) -> Any:
    tables = {"wheel": "paper", "finish": "matte", "camera": camera, "light": {"ambient": 0.0}}
    return scene_from({**tables, "projector": {"gamma": 1.0, "contrast": 1e6}}, source="test")


def known(world: SceneSpec, shots: list[Shot]) -> Floats32:
    return bounds_of(point_transport(), world, shots, every=1).known_px


def two_paths(*, apart_px: int, strength: float) -> LightTransport:
    """As :func:`point_transport`, and a second path from ``apart_px`` columns to the right."""
    plain = point_transport()
    count = HEIGHT * WIDTH
    row, column = np.divmod(np.arange(count), WIDTH)
    there = (row * WIDTH + np.minimum(column + apart_px, WIDTH - 1)).astype(np.int32)
    second = SparseRows(np.arange(count + 1), there, np.full(count, 0.5 * strength, np.float32))
    return replace(plain, indirect=second)


def test_without_a_second_path_both_bounds_are_one() -> None:
    found = bounds_of(point_transport(), scene(), [Shot(sines(), 10.0)], every=1)
    np.testing.assert_allclose(found.second_path_px, found.known_px, rtol=1e-6)


def test_one_sine_cannot_tell_two_paths_apart_and_two_periods_can() -> None:
    """A sum of two sines of one period is a sine: five unknowns, three numbers. Two periods give five."""
    light = two_paths(apart_px=5, strength=0.5)
    one = bounds_of(light, scene(), [Shot(sines(), 10.0)], every=1)
    inner = np.s_[:, 3:-9]  # levels of 8 bits leave a trace of the difference
    assert (np.nan_to_num(one.second_path_px[inner], nan=np.inf) > 50.0 * one.known_px[inner]).all()
    both = bounds_of(light, scene(), [Shot(sines(), 10.0), Shot(sines(period_px=9.0), 10.0)], every=1)
    assert np.isfinite(both.second_path_px[inner]).all()
    assert (both.second_path_px[inner] > 1.05 * both.known_px[inner]).all()


def test_second_bound_is_the_inverse_of_the_whole_information() -> None:
    """Against a brute-force Fisher matrix of one pixel, by numerical derivatives of the model."""
    apart, strength, exposure = 5, 0.5, 10.0
    world = scene()
    shots = [Shot(sines(), exposure), Shot(sines(period_px=9.0), exposure)]
    found = bounds_of(two_paths(apart_px=apart, strength=strength), world, shots, every=1)
    place = 30
    table = world.projector.sheet.light.astype(float)
    frames = np.concatenate([table[shot.patterns.frames[:, 0]] for shot in shots])
    rate = world.camera.electrons_per_ms * exposure

    def mean(u: float, a: float, b: float, c: float, w: float) -> Floats:
        columns = np.arange(WIDTH)
        lit = CubicSpline(columns, frames, axis=1)
        return np.asarray(rate * (0.5 * a * lit(u) + 0.5 * strength * c * lit(w) + b))

    at = np.array([place, 1.0, 0.0, 1.0, place + apart])
    steps = np.eye(5) * 1e-4
    gradient = np.stack([(mean(*(at + h)) - mean(*(at - h))) / 2e-4 for h in steps])
    level = mean(*at)
    variance = level + world.camera.read_noise_e**2 + world.camera.sheet.rounding_e2(level)
    expected = np.sqrt(np.linalg.inv(gradient / variance @ gradient.T)[0, 0])
    assert found.second_path_px[0, place] == pytest.approx(expected, rel=0.02)


def test_a_sine_in_constant_noise_has_the_textbook_bound() -> None:
    world = scene(read_noise_e=3000.0)
    found = known(world, [Shot(sines(), 10.0)])
    amplitude_e = 0.5 * 0.5 * 10.0 * world.camera.electrons_per_ms
    noise_e = np.hypot(3000.0, np.sqrt(amplitude_e))
    expected = PERIOD_PX / (2 * np.pi) * np.sqrt(2 / FRAMES) * noise_e / amplitude_e
    np.testing.assert_allclose(found[:, 3:-3], expected, rtol=0.02)


def test_twice_the_frames_give_half_the_variance() -> None:
    world = scene()
    once, twice = (known(world, [Shot(sines(), 10.0)] * count) for count in (1, 2))
    np.testing.assert_allclose(once[:, 3:-3] / twice[:, 3:-3], np.sqrt(2.0), rtol=1e-4)


def test_clipped_and_even_frames_tell_nothing() -> None:
    world = scene(white_exposure_ms=10.0)
    even = Patterns(np.full((2, HEIGHT, WIDTH), 255, np.uint8), ("white", "again"))
    assert np.isnan(known(world, [Shot(even, 10.0)])).all()
    clipped = known(world, [Shot(even, 100.0), Shot(sines(), 10.0)])
    alone = known(world, [Shot(sines(), 10.0)])
    np.testing.assert_array_equal(clipped, alone)


def test_rows_are_left_out() -> None:
    found = bounds_of(point_transport(), scene(), [Shot(sines(), 10.0)], every=4).known_px
    assert np.isfinite(found[::4, 3:-3]).all()
    assert np.isnan(found[1::4]).all()
