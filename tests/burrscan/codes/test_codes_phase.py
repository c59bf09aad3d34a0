"""The fast phase kernels against plain double precision, and what fusing three periods gains."""

import numpy as np
import pytest

from burrscan.arrays import Image
from burrscan.codes.phase import decode_phase
from burrscan.codes.rivals.heterodyne import beats_px, heterodyne
from burrscan.devices import CameraSheet

CAMERA = CameraSheet()


def noisy(steps: int, *, seed: int = 0) -> Image:
    rng = np.random.default_rng(seed)
    turns, size = rng.uniform(0.0, 1.0, (17, 333)), rng.uniform(0.0, 500.0, (17, 333))
    light = size * (1.0 + np.cos(2.0 * np.pi * (turns - np.arange(steps)[:, None, None] / steps)))
    mean = CAMERA.black_level_dn + light
    noise = CAMERA.noise_dn(mean) * rng.standard_normal(mean.shape)
    return np.clip(np.rint(mean + noise), 0, CAMERA.saturation_dn).astype(np.uint16)


@pytest.mark.parametrize("steps", [3, 4, 5, 8, 16])
def test_phase_equals_the_plain_double_precision_sum(steps: int) -> None:
    images = noisy(steps)
    found = decode_phase(images, camera=CAMERA, period_px=16.0)
    waves = np.exp(2j * np.pi * np.arange(steps) / steps)[:, None, None]
    phasor = (images * waves).sum(axis=0)
    turns = np.angle(phasor) / (2.0 * np.pi)
    apart = (found.offset_px / 16.0 - turns + 0.5) % 1.0 - 0.5
    variance = CAMERA.gain_dn_per_e * np.maximum(images - CAMERA.black_level_dn, 0.0)
    variance += (CAMERA.gain_dn_per_e * CAMERA.read_noise_e) ** 2 + 1.0 / 12.0
    across = (waves * np.conj(phasor) / np.abs(phasor)).imag
    sigma = np.sqrt((variance * across**2).sum(axis=0)) / np.abs(phasor) / (2.0 * np.pi)
    strong = np.abs(phasor) > 20.0 * steps
    assert strong.mean() > 0.9
    assert np.abs(apart / sigma)[strong].max() < 1e-3
    np.testing.assert_allclose(found.sigma_px[strong] / 16.0, sigma[strong], rtol=2e-2)
    np.testing.assert_allclose(found.amplitude_dn, 2.0 * np.abs(phasor) / steps, rtol=1e-5, atol=1e-4)
    np.testing.assert_array_equal(found.clipped, (images >= CAMERA.clipped_dn).any(axis=0))


def test_no_modulation_has_a_vast_sigma() -> None:
    found = decode_phase(np.full((4, 2, 3), 100, np.uint16), camera=CAMERA, period_px=16.0)
    assert (found.sigma_px > 1e6).all()


@pytest.mark.parametrize("signal_dn", [60.0, 900.0])
def test_heterodyne_fuses_all_three_periods(signal_dn: float) -> None:
    width, rows = 640, 64
    code = heterodyne(width=width)
    mean = CAMERA.black_level_dn + signal_dn * np.repeat(code.light[:, None], rows, axis=1)
    noise = CAMERA.noise_dn(mean) * np.random.default_rng(1).standard_normal(mean.shape)
    images = np.clip(np.rint(mean + noise), 0, CAMERA.saturation_dn).astype(np.uint16)
    found = code.decode(images, CAMERA)
    error = (found.u_px - np.arange(width))[found.mask]
    finest = decode_phase(images[:8], camera=CAMERA, period_px=16.0).sigma_px[found.mask]
    f = 1.0 / np.array(beats_px(width=width, finest_px=16.0))
    gain = np.sqrt((f**2).sum()) / f[0]
    assert found.mask.mean() > 0.99
    # 40 000 pixels: the standard error of these ratios is 0.4 %
    assert np.std(error) * gain == pytest.approx(np.sqrt(np.mean(finest**2)), rel=0.03)
    assert np.std(error / found.sigma_u_px[found.mask]) == pytest.approx(1.0, abs=0.03)
