"""Curves and crosstalk come back from noisy ramps, and the stated deviations cover what is left."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan import InputError
from burrscan.calibration.photometric import Photometry, calibrate_photometry
from burrscan.calibration.ramps import ExposureRamp, LevelRamp, ramp_exposures_ms, tiles_of
from tests.burrscan.ramp_bench import RampBench

CAMERA_MIX = np.array([[1.0, 0.12, 0.03], [0.08, 1.0, 0.10], [0.02, 0.15, 1.0]])
PROJECTOR_MIX = np.array([[1.0, 0.06, 0.01], [0.10, 1.0, 0.07], [0.02, 0.09, 1.0]])
GREY = np.ones((1, 1))
SHAPE = (48, 64)
LEVELS = np.arange(0, 256, 15)
LEVEL_EXPOSURES_MS = (8.0, 25.0, 200.0)
OFF_DIAGONAL = ~np.eye(3, dtype=bool)


def colour_bench(seed: int = 0) -> RampBench:
    return RampBench(
        CAMERA_MIX,
        PROJECTOR_MIX,
        responses=("srgb", "s", "linear"),
        gammas=(2.2, 1.8, 2.5),
        shape=SHAPE,
        seed=seed,
    )


def calibrated(bench: RampBench, longest_ms: float, tint: tuple[float, ...] = (1.0,) * 3) -> Photometry:
    bands = bench.camera_mix.shape[1]
    lamps = [
        bench.lamp_ramp(band, ramp_exposures_ms(longest_ms), power=1.0 / tint[band]) for band in range(bands)
    ]
    ramp = bench.level_ramp(LEVELS, LEVEL_EXPOSURES_MS)
    return calibrate_photometry(lamps, ramp, bit_depth=bench.bit_depth)


@pytest.fixture(scope="module")
def colour() -> Photometry:
    return calibrated(colour_bench(), 28.0)


def curve_errors(found: Photometry, bench: RampBench) -> list[float]:
    return [
        float(np.nanmax(np.abs(curve.light - bench.true_curve(channel))))
        for channel, curve in enumerate(found.camera)
    ]


def test_colour_curves_are_within_one_percent(colour: Photometry) -> None:
    bench = colour_bench()
    assert max(curve_errors(colour, bench)) < 0.01
    for primary, sheet in enumerate(colour.projector.sheets):
        assert np.abs(sheet.light - bench.light(primary)).max() < 0.01


def test_both_crosstalk_matrices_are_within_002(colour: Photometry) -> None:
    for found, sigma, truth in (
        (colour.camera_mix, colour.camera_mix_sigma, CAMERA_MIX),
        (colour.projector_mix, colour.projector_mix_sigma, PROJECTOR_MIX),
    ):
        assert np.abs(found - truth).max() < 0.02
        assert np.array_equal(np.diag(found), np.ones(3))
        assert np.all(np.abs(found - truth)[OFF_DIAGONAL] < 4.0 * sigma[OFF_DIAGONAL])
        assert sigma.max() < 0.02


@pytest.mark.parametrize("response", ["linear", "srgb", "s"])
def test_a_grey_camera_of_any_response(response: str) -> None:
    bench = RampBench(GREY, GREY, responses=(response,), seed=3)
    found = calibrated(bench, 24.0)
    (curve,), (sheet,) = found.camera, found.projector.sheets
    assert curve_errors(found, bench)[0] < 0.01
    assert abs(curve.light_of(np.array(bench.black_dn))) < 1e-3
    error = sheet.light - bench.light(0)
    assert np.abs(error).max() < 0.01
    assert abs(sheet.light[0] * bench.contrast - 1.0) < 0.1
    pulls = (error / np.maximum(found.projector.sigma[0], 1e-12))[LEVELS[1:-1]]
    assert np.sqrt(np.mean(pulls**2)) < 2.0


def test_a_flickering_lamp_is_stated() -> None:
    steady, flickering = (
        calibrated(RampBench(GREY, GREY, responses=("linear",), flicker=flicker, seed=4), 24.0).camera[0]
        for flicker in (0.0, 0.01)
    )
    middle = slice(300, 700)
    assert np.median(flickering.sigma[middle]) > 3.0 * np.median(steady.sigma[middle])


def test_the_gauge_is_a_boards_reflectance() -> None:
    """A tinted board changes P by its reflectances' ratios, as the module says, and C not at all."""
    tint = (1.0, 0.7, 0.5)
    bench = RampBench(
        CAMERA_MIX,
        PROJECTOR_MIX,
        responses=("linear",) * 3,
        gammas=(2.2,) * 3,
        board=tint,
        shape=SHAPE,
        seed=2,
    )
    found = calibrated(bench, 28.0, tint)
    g = np.array(tint)
    assert np.abs(found.camera_mix - CAMERA_MIX).max() < 0.02
    assert np.abs(found.projector_mix - g[:, None] * PROJECTOR_MIX / g).max() < 0.02


def test_noise_of_tiles_is_that_of_their_means() -> None:
    rng = np.random.default_rng(0)
    for noise in (0.0, 0.2, 3.0):  # far below one DN the rounding no longer averages out
        offset = rng.uniform(0.0, 1.0, (400, 1, 1))
        images = np.rint(100.0 + offset + noise * rng.standard_normal((400, 48, 48))).astype(np.uint16)
        tiles = tiles_of(images, saturation_dn=1023)
        pulls = (tiles.dn[..., 0] - 100.0 - offset[:, :, 0]) / tiles.sigma_dn[..., 0]
        assert 0.6 < np.sqrt(np.mean(pulls**2)) < 1.3


def test_ramps_that_cannot_be_used_say_why() -> None:
    images = np.full((3, 24, 24), 50, np.uint16)
    times = np.array([1.0, 2.0, 3.0])
    with pytest.raises(InputError, match="one exposure and one mark per picture"):
        ExposureRamp(images, times[:2], np.ones(3, bool))
    with pytest.raises(InputError, match="above zero"):
        ExposureRamp(images, times - 1.0, np.ones(3, bool))
    few = ExposureRamp(images, times, np.ones(3, bool))
    levels = LevelRamp(images, times, np.array([[0], [128], [255]]))
    with pytest.raises(InputError, match="ramp from the dark until it clips"):
        calibrate_photometry([few], levels, bit_depth=8)
    with pytest.raises(InputError, match="as many of each"):
        calibrate_photometry([few, few], levels, bit_depth=8)


def test_a_ramp_without_full_white_is_refused() -> None:
    bench = RampBench(GREY, GREY, seed=5)
    lamp = bench.lamp_ramp(0, ramp_exposures_ms(24.0))
    with pytest.raises(InputError, match="no unclipped picture at level 255"):
        calibrate_photometry([lamp], bench.level_ramp(np.arange(0, 200, 20), (8.0,)), bit_depth=10)
