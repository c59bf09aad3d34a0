"""The Cramér-Rao bound against the closed form of a sine in constant noise."""

from typing import Any

import numpy as np
from scenes.transport.tiles import no_tiles

from burrscan.scanner import Patterns
from scenes.bound import Shot, bound_px
from scenes.scene import scene_from
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows

HEIGHT, WIDTH, FRAMES, PERIOD_PX = 8, 64, 8, 16.0


def point_transport() -> LightTransport:
    """Every camera pixel sees the projector pixel of the same number, and nothing else."""
    count = HEIGHT * WIDTH
    rows = SparseRows(np.arange(count + 1), np.arange(count, dtype=np.int32), np.full(count, 0.5, np.float32))
    zero = np.zeros((HEIGHT, WIDTH), np.float32)
    shape = HEIGHT, WIDTH
    return LightTransport(shape, shape, rows, no_tiles(shape), zero, zero, zero, zero)


def sines(*, dim: float = 1.0, rows: int = HEIGHT) -> Patterns:
    turns = np.arange(WIDTH) / PERIOD_PX - np.arange(FRAMES)[:, None] / FRAMES
    levels = np.rint(255 * dim * (0.5 + 0.5 * np.cos(2 * np.pi * turns))).astype(np.uint8)
    frames = np.repeat(levels[:, None, :], rows, axis=1)
    return Patterns(frames, tuple(f"{n}" for n in range(FRAMES)))


def scene(**camera: Any) -> Any:
    tables = {"wheel": "paper", "finish": "matte", "camera": camera, "light": {"ambient": 0.0}}
    return scene_from({**tables, "projector": {"gamma": 1.0, "contrast": 1e6}}, source="test")


def test_a_sine_in_constant_noise_has_the_textbook_bound() -> None:
    world = scene(read_noise_e=3000.0)
    found = bound_px(point_transport(), world, [Shot(sines(), 10.0)], every=1)
    amplitude_e = 0.5 * 0.5 * 10.0 * world.camera.electrons_per_ms
    noise_e = np.hypot(3000.0, np.sqrt(amplitude_e))
    expected = PERIOD_PX / (2 * np.pi) * np.sqrt(2 / FRAMES) * noise_e / amplitude_e
    np.testing.assert_allclose(found[:, 3:-3], expected, rtol=0.02)


def test_twice_the_frames_give_half_the_variance() -> None:
    world = scene()
    once, twice = (
        bound_px(point_transport(), world, [Shot(sines(), 10.0)] * count, every=1) for count in (1, 2)
    )
    np.testing.assert_allclose(once[:, 3:-3] / twice[:, 3:-3], np.sqrt(2.0), rtol=1e-4)


def test_clipped_and_even_frames_tell_nothing() -> None:
    world = scene(white_exposure_ms=10.0)
    even = Patterns(np.full((2, HEIGHT, WIDTH), 255, np.uint8), ("white", "again"))
    assert np.isnan(bound_px(point_transport(), world, [Shot(even, 10.0)], every=1)).all()
    clipped = bound_px(point_transport(), world, [Shot(even, 100.0), Shot(sines(), 10.0)], every=1)
    alone = bound_px(point_transport(), world, [Shot(sines(), 10.0)], every=1)
    np.testing.assert_array_equal(clipped, alone)


def test_rows_are_left_out() -> None:
    found = bound_px(point_transport(), scene(), [Shot(sines(), 10.0)], every=4)
    assert np.isfinite(found[::4, 3:-3]).all()
    assert np.isnan(found[1::4]).all()
