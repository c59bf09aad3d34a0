"""The camera's statistics against Poisson's and the data sheet's, at z = 4."""

from dataclasses import replace

import numba as nb
import numpy as np
import pytest

from burrscan import InputError
from burrscan.arrays import Floats, Image
from burrscan.linear import linear_camera, linear_images
from scenes.electronics.response import ResponseSpec, linear_logarithmic, power_with_toe
from scenes.electronics.sensor import expose
from scenes.electronics.spec import CameraSpec, ProjectorSpec
from scenes.streams import stream_key

CAMERA = CameraSpec(bit_depth=12, full_well_e=10_000.0, read_noise_e=4.0, black_level_dn=64.0)
Z = 4.0


def electrons(mean_e: float, *, identity: tuple[int, ...] = (1,)) -> Floats:
    light = np.full((6, 200, 250), mean_e / CAMERA.full_well_e, np.float32)
    images = expose(
        light, camera=CAMERA, exposure_ms=CAMERA.white_exposure_ms, identity=identity, first_frame=0
    )
    return (images.astype(float) - CAMERA.black_level_dn) / CAMERA.sheet.gain_dn_per_e


@pytest.mark.parametrize("mean", [0.0, 0.5, 5.0, 29.9, 30.1, 200.0, 6000.0])
def test_mean_and_variance_follow_the_data_sheet(mean: float) -> None:
    got = electrons(mean)
    quantum = 1.0 / (12.0 * CAMERA.sheet.gain_dn_per_e**2)
    variance = mean + CAMERA.read_noise_e**2 + quantum
    n = got.size
    assert got.mean() == pytest.approx(mean, abs=Z * np.sqrt(variance / n))
    kurtosis = 3.0 + mean / variance**2
    assert got.var() == pytest.approx(variance, abs=Z * variance * np.sqrt((kurtosis - 1.0) / n))
    dn = mean * CAMERA.sheet.gain_dn_per_e + CAMERA.black_level_dn
    assert CAMERA.sheet.noise_dn(np.array(dn)) / CAMERA.sheet.gain_dn_per_e == pytest.approx(variance**0.5)


def test_light_beyond_the_well_saturates() -> None:
    light = np.full((1, 4, 4), 3.0, np.float32)
    camera = CameraSpec(read_noise_e=0.0)
    images = expose(light, camera=camera, exposure_ms=20.0, identity=(1,), first_frame=0)
    assert np.all(images == CameraSpec().sheet.saturation_dn)


def test_noise_is_fixed_by_the_case_and_the_picture_alone() -> None:
    light = np.random.default_rng(0).random((4, 60, 70)).astype(np.float32)

    def take(frames: slice, first: int, identity: tuple[int, ...] = (3, 1)) -> Image:
        return expose(light[frames], camera=CAMERA, exposure_ms=9.0, identity=identity, first_frame=first)

    whole = take(slice(None), 0)
    assert np.array_equal(whole, np.concatenate([take(slice(0, 1), 0), take(slice(1, 4), 1)]))
    threads = nb.get_num_threads()
    nb.set_num_threads(1)
    assert np.array_equal(whole, take(slice(None), 0))
    nb.set_num_threads(threads)
    assert not np.array_equal(whole, take(slice(None), 0, identity=(3, 2)))


def test_streams_of_sources_and_pictures_are_uncorrelated() -> None:
    assert stream_key((1,), "shot noise") != stream_key((1,), "read noise")
    got = electrons(500.0)
    a, b = got[0].ravel(), got[1].ravel()
    assert np.corrcoef(a, b)[0, 1] == pytest.approx(0.0, abs=Z / np.sqrt(a.size))
    assert np.corrcoef(a[1:], a[:-1])[0, 1] == pytest.approx(0.0, abs=Z / np.sqrt(a.size))


def test_projector_light_has_the_stated_contrast_and_inverts() -> None:
    sheet = ProjectorSpec(gamma=2.0, contrast=500.0).sheet
    assert sheet.light[0] == pytest.approx(1.0 / 500.0)
    assert sheet.light[-1] == pytest.approx(1.0)
    assert sheet.levels(sheet.light) == pytest.approx(np.arange(256.0), abs=1e-6)


def test_the_power_law_is_bt709s() -> None:
    """ITU-R BT.709-6: 4.5 L below 0.018, 1.099 L^0.45 - 0.099 above, to the digits that it prints."""
    light = np.linspace(0.0, 1.0, 501)
    published = np.where(light < 0.018, 4.5 * light, 1.099 * light**0.45 - 0.099)
    assert power_with_toe(light, gamma=0.45, slope=4.5) == pytest.approx(published, abs=5e-4)


def test_the_knee_is_logarithmic_and_smooth() -> None:
    light = np.linspace(0.0, 1.0, 100_001)
    bent = linear_logarithmic(light, 0.25)
    slope = np.gradient(bent, light)
    assert bent[-1] == pytest.approx(1.0)
    assert slope[:24_000] == pytest.approx(slope[0])
    assert slope[30_000:-1] * light[30_000:-1] == pytest.approx(0.25 * slope[0], rel=1e-3)
    assert np.abs(np.diff(slope[1:-1])).max() < 1e-3 * slope[0]


@pytest.mark.parametrize(
    "response",
    [
        ResponseSpec(gamma=0.6),
        ResponseSpec(knee=0.2),
        ResponseSpec(gamma=0.8, knee=0.5, toe_slope=3.0),
        ResponseSpec(table=(0.0, 0.4, 0.7, 0.9, 1.0)),
    ],
)
def test_a_curve_bends_the_values_and_the_sheet_undoes_it(response: ResponseSpec) -> None:
    """The sheet's linear camera finds the light and its noise in the pictures of the bent one (z = 4)."""
    camera = replace(CAMERA, response=response)
    straight = linear_camera(camera.sheet)
    for share in (0.0, 0.003, 0.1, 0.5, 0.9):
        light = np.full((4, 100, 100), share, np.float32)
        raw = expose(light, camera=camera, exposure_ms=camera.white_exposure_ms, identity=(5,), first_frame=0)
        seen = camera.sheet.electrons_of(raw.astype(float))
        sigma = np.sqrt(share * camera.full_well_e + camera.read_noise_e**2)
        assert seen.mean() == pytest.approx(
            share * camera.full_well_e, abs=0.05 + Z * sigma / np.sqrt(seen.size)
        )
        linear_dn = linear_images(raw, camera.sheet).astype(float)
        stated = straight.noise_dn(np.array(linear_dn.mean()))
        assert linear_dn.std() == pytest.approx(stated, rel=0.02 + Z / np.sqrt(2.0 * seen.size))


def test_a_table_must_rise() -> None:
    with pytest.raises(InputError, match="must rise from 0 to 1"):
        ResponseSpec(table=(0.0, 0.6, 0.5, 1.0))
    assert ResponseSpec().linear
    assert CameraSpec().sheet.response == ()
