"""How well a burr can be told, against an ideal observer that really looks."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from burrscan.scanner import Patterns
from scenes.detectability import burr_dprimes, dprime_squared, other_side
from scenes.finish import LocalFinish
from scenes.scene import scene_from
from scenes.shots import Shot
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows
from scenes.wheel.spec import AxialRidge, Nick, RimBurr

SIZE = 6, 8
EXPOSURE_MS = 5.0


def lit(values: np.ndarray, sigma: float = 0.0) -> LightTransport:
    """Every camera pixel sees the projector pixel of its number."""
    count = values.size
    rows = SparseRows(
        np.arange(count + 1), np.arange(count, dtype=np.int32), values.ravel().astype(np.float32)
    )
    zero = np.zeros(SIZE, np.float32)
    return LightTransport(
        SIZE, SIZE, rows, empty_rows(count), zero, zero, zero, zero, np.full(SIZE, sigma, np.float32)
    )


def world() -> Any:
    tables = {"wheel": "paper", "finish": "matte", "light": {"ambient": 0.0}}
    return scene_from({**tables, "projector": {"gamma": 1.0, "contrast": 1e6}}, source="test")


def shot(levels: tuple[int, ...] = (255, 90, 0)) -> Shot:
    frames = np.broadcast_to(np.array(levels, np.uint8)[:, None, None], (len(levels), *SIZE))
    return Shot(Patterns(frames, tuple(map(str, levels))), EXPOSURE_MS)


def test_d_prime_is_what_a_matched_filter_reaches() -> None:
    """20,000 noisy pictures of each kind; the filter's own z between both is d' within 4 standard errors."""
    rng = np.random.default_rng(3)
    bare = np.full(SIZE, 0.2)
    burr = bare.copy()
    burr[2:4, 3] += 0.012
    scene, trials = world(), 20_000
    d = float(np.sqrt(dprime_squared(lit(burr), lit(bare), scene, [shot()]).sum()))
    rate = scene.camera.electrons_per_ms * EXPOSURE_MS
    light = scene.projector.sheet.light[[255, 90, 0]]
    means = [rate * light[:, None, None] * image for image in (burr, bare)]
    noise_e2 = scene.camera.read_noise_e**2 + float(scene.camera.sheet.rounding_e2(np.zeros(1)))
    template = (means[0] - means[1]) / (0.5 * (means[0] + means[1]) + noise_e2)

    def score(mean: np.ndarray) -> np.ndarray:
        pictures = rng.poisson(mean, (trials, *mean.shape)) + rng.normal(
            0.0, noise_e2**0.5, (trials, *mean.shape)
        )
        return np.asarray((pictures * template).sum(axis=(1, 2, 3)))

    scores = [score(mean) for mean in means]
    reached = (scores[0].mean() - scores[1].mean()) / np.sqrt(0.5 * (scores[0].var() + scores[1].var()))
    assert abs(reached - d) < 4.0 * np.sqrt(2.0 / trials + d * d / (4.0 * trials))
    assert d > 1.0


def test_what_changes_nothing_is_nothing_and_a_full_well_tells_nothing() -> None:
    plain = np.full(SIZE, 0.2)
    assert dprime_squared(lit(plain), lit(plain), world(), [shot()]).max() == 0.0
    glaring = np.full(SIZE, 4000.0)
    assert dprime_squared(lit(1.5 * glaring), lit(glaring), world(), [shot((255,))]).max() == 0.0


def test_the_error_of_traced_light_is_no_burr() -> None:
    rng = np.random.default_rng(1)
    plain, sigma = np.full(SIZE, 0.2), 0.004
    one, other = (plain + rng.normal(0.0, sigma, SIZE) for _ in range(2))
    naive = dprime_squared(lit(one), lit(other), world(), [shot()]).sum()
    known = dprime_squared(lit(one, sigma), lit(other, sigma), world(), [shot()]).sum()
    assert known < 0.6 * naive


def test_a_pixel_counts_for_the_burr_next_to_it() -> None:
    index = np.full((20, 60), -1)
    index[8:12, 10], index[8:12, 50] = 0, 1
    burr = SimpleNamespace(height_mm=1.0, width_mm=1.0)
    unseen = SimpleNamespace(height_mm=1.0, width_mm=1.0)
    points = np.zeros((20, 60, 3))
    points[..., 2] = 600.0
    truth: Any = SimpleNamespace(
        burr_index=index, points_mm=points, wheel=SimpleNamespace(burrs=(burr, burr, unseen)),
        rig=SimpleNamespace(camera=SimpleNamespace(fx=600.0)),
    )  # fmt: skip
    squared = np.zeros((20, 60))
    squared[9, 12], squared[9, 50], squared[9, 30] = 9.0, 16.0, 100.0  # the last is no burr's
    assert burr_dprimes(truth, squared) == pytest.approx((3.0, 4.0, 0.0))


def test_the_other_side_of_a_burr_is_as_large_and_at_the_same_place() -> None:
    nick = Nick(8.0, 0.7, 1.3, -4.0, 6.0, depth_variation=0.2, seed=5, finish=LocalFinish(alpha=0.3))
    ridge = other_side(nick)
    assert isinstance(ridge, AxialRidge)
    assert (ridge.angle_deg, ridge.height_mm, ridge.width_mm, ridge.z_start_mm) == (8.0, 0.7, 1.3, -4.0)
    assert other_side(ridge) == nick
    assert other_side(RimBurr(0.0, 40.0, 1.0, 1.0, 2)) is None
