"""The adaptive scan's fast inner loops against their plain versions."""

import numpy as np

from burrscan.devices import CameraSheet
from burrscan.scan.matching.matched import _median
from burrscan.scan.matching.phasors import cosine_sine, phasors, phasors_of, row_sums, sheet_of, turns_of

CAMERA = CameraSheet()


def test_cosine_and_sine() -> None:
    angles = np.random.default_rng(0).uniform(-6e3, 6e3, 5000)
    found = np.array([cosine_sine(angle) for angle in angles])
    np.testing.assert_allclose(found, np.stack([np.cos(angles), np.sin(angles)], axis=-1), atol=1e-11)


def test_a_rows_phasors_are_each_pixels() -> None:
    rng = np.random.default_rng(1)
    count, steps = 7, 3
    images = rng.integers(8, CAMERA.saturation_dn + 1, (count * steps, 2, 40)).astype(np.uint16)
    images[:, :, ::4] = np.minimum(images[:, :, ::4], CAMERA.saturation_dn - 1)
    images[4, 1, 3] = CAMERA.saturation_dn
    sheet, turns = sheet_of(CAMERA), turns_of(steps)
    sums = row_sums(images, 1, turns)
    for c in range(images.shape[2]):
        z, variance, plain_z, plain = (np.empty(count, t) for t in (complex, float, complex, float))
        found = phasors_of(sums, c, sheet, steps, z, variance)
        np.testing.assert_allclose(found, phasors(images, 1, c, sheet, turns, plain_z, plain), rtol=1e-6)
        # single precision on 10 bits, noise is 1 DN and more
        np.testing.assert_allclose(z, plain_z, atol=2e-4)
        np.testing.assert_allclose(variance, plain, rtol=1e-6)


def test_median() -> None:
    rng = np.random.default_rng(2)
    for count in (1, 2, 5, 11, 12):
        values = rng.normal(size=count)
        assert _median(values.copy()) == np.median(values)
