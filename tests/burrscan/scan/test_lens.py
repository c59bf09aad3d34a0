"""A projector out of focus, against discs counted point by point."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.scan.lens import Lens, _lens, blurred, kept_of, penumbra_sigma_px
from burrscan.scan.stripes import stripes
from tests.burrscan.instrument import small_rig

CODE = stripes(9, width=1024)


def disc(diameter: float, *, count: int = 400_000, seed: int = 0) -> Floats:
    """Points evenly on a disc, (2, count)."""
    rng = np.random.default_rng(seed)
    radius, turn = 0.5 * diameter * np.sqrt(rng.random(count)), rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack([radius * np.cos(turn), radius * np.sin(turn)])


@pytest.mark.parametrize("diameter", [1.0, 3.0, 6.0])
def test_what_stripes_keep_is_the_mean_of_their_wave_over_the_disc(diameter: float) -> None:
    x, y = disc(diameter)
    kept = kept_of(np.array([diameter, 0.0]), CODE, footprint_px2=0.12)
    for number in (0, 4, 8):
        turn = 2.0 * np.pi * (CODE.per_column[number] * x + CODE.per_row[number] * y)
        assert kept[0, number] / kept[1, number] == pytest.approx(np.cos(turn).mean(), abs=0.005)


def test_a_point_of_light_becomes_a_disc_of_its_own_light() -> None:
    levels = np.zeros((41, 41, 2), np.uint8)
    levels[20, 20, 0] = levels[:, :, 1] = 200
    light = (np.arange(256) / 255.0).astype(np.float32) ** 2
    out, table = blurred(levels, light, circle_px=5.0)
    point = table[out[..., 0]]
    assert point.sum() == pytest.approx(light[200], rel=0.01)
    row, column = np.indices(point.shape) - 20
    # a disc's variance along a line is (d / 4)², beside that of the pixels that it is counted on
    assert (point * row**2).sum() / point.sum() == pytest.approx(25.0 / 16.0, rel=0.06)
    assert np.all(point[np.hypot(row, column) > 3.5] == 0.0)
    assert table[out[..., 1]] == pytest.approx(float(light[200]), rel=1e-4)


def test_a_lens_is_found_from_circles_to_both_sides_of_its_focus() -> None:
    inverse = np.linspace(1.0 / 260.0, 1.0 / 200.0, 12)
    circles = 6800.0 * np.abs(inverse - 1.0 / 240.0)
    rng = np.random.default_rng(3)
    seen = np.maximum(circles + 0.1 * rng.normal(size=12), 0.0)
    seen[circles < 0.8] = 0.0  # a pixel's own footprint hides them
    lens = _lens(inverse, seen)
    assert lens.per_inverse == pytest.approx(6800.0, rel=0.06)
    assert 1.0 / lens.focus == pytest.approx(240.0, rel=0.01)


def test_what_is_sharp_has_no_lens() -> None:
    inverse = np.linspace(0.004, 0.005, 12)
    assert _lens(inverse, np.full(12, 0.9)) == Lens()
    assert _lens(inverse, np.where(np.arange(12) < 2, 3.0, 0.0)) == Lens()  # a corner that mirrors
    assert _lens(inverse, np.where(np.arange(12) < 3, 3.0, 0.0)) != Lens()
    rig = small_rig(width=160)
    assert not Lens().circles_px(np.full(rig.camera.shape, 60.0, np.float32), rig).any()


@pytest.mark.parametrize("share", [0.1, 0.3, 0.5, 0.8])
def test_a_hidden_part_of_the_lens_moves_its_middle_as_far_as_stated(share: float) -> None:
    """A border that leaves a share of the light: the sigma is the shift, less what shading may be."""
    x, _ = disc(4.0)
    smoothed = 0.866 * share + 0.067  # over one pixel to both sides of three with that share
    shift = abs(x[x <= np.quantile(x, smoothed)].mean())
    radiance = np.ones((40, 160), np.float32)
    radiance[:, 80:83], radiance[:, 83:] = share, 0.0
    circles = np.full(radiance.shape, 4.0, np.float32)
    stated = penumbra_sigma_px(radiance, known=radiance > 0.0, circles_px=circles)
    assert stated[20, 81] == pytest.approx(shift - 0.1 * 0.85 * 2.0, abs=0.12)
    assert stated[20, 40] == 0.0


def test_a_lobe_of_metal_hides_no_lens() -> None:
    radiance = np.exp(-0.5 * ((np.arange(160) - 80.0) / 12.0) ** 2).astype(np.float32)
    image = np.tile(radiance, (40, 1))[:, 50:110]
    circles = np.full(image.shape, 4.0, np.float32)
    assert not penumbra_sigma_px(image, known=np.zeros(image.shape, bool), circles_px=circles).any()


def test_paint_hides_no_lens_where_columns_are_known() -> None:
    radiance = np.ones((40, 60), np.float32)
    radiance[:, 30:] = 0.05
    circles = np.full(radiance.shape, 4.0, np.float32)
    known = np.ones(radiance.shape, bool)
    assert not penumbra_sigma_px(radiance, known=known, circles_px=circles).any()
    assert penumbra_sigma_px(radiance, known=radiance > 0.5, circles_px=circles)[20, 30] > 0.5
