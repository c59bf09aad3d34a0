"""The adaptive scan's inner loops against plain versions."""

import numpy as np

from burrscan.codes.phase import sheet_of
from burrscan.devices import CameraSheet
from burrscan.scan.matching.phasors import phasors, turns_of

CAMERA = CameraSheet()


def test_phasors_are_the_first_line_of_each_frequencys_spectrum() -> None:
    rng = np.random.default_rng(1)
    count, steps = 7, 3
    images = rng.integers(8, CAMERA.saturation_dn + 1, (count * steps, 2, 40)).astype(np.uint16)
    images[:, :, ::4] = np.minimum(images[:, :, ::4], CAMERA.saturation_dn - 1)
    images[4, 1, 3] = CAMERA.saturation_dn
    row = images.reshape(count, steps, 2, 40)[:, :, 1]
    line = np.conj(np.fft.fft(row, axis=1)[:, 1])
    light = row.mean(axis=1) - CAMERA.black_level_dn
    whole = np.asarray((row < CAMERA.clipped_dn).all(axis=1))
    noise = CAMERA.gain_dn_per_e * np.maximum(light, 0.0) + sheet_of(CAMERA)[2]
    for c in range(images.shape[2]):
        z, variance = np.empty(count, complex), np.empty(count)
        mean, usable = phasors(images, 1, c, sheet_of(CAMERA), turns_of(steps), z, variance)
        np.testing.assert_allclose(z, line[:, c] * 2.0 / steps, atol=1e-9)
        np.testing.assert_allclose(variance, np.where(whole, noise * 2.0 / steps, np.inf)[:, c])
        assert usable == whole[:, c].sum()
        assert np.isclose(mean, light[:, c][whole[:, c]].mean())
