"""The bracket measures what it reports: a full well read with noise passes for no measurement."""

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.devices import CameraSheet
from burrscan.linear import linear
from burrscan.scan.exposure import bracket, ladder_ms
from tests.burrscan.instrument import Instrument, plane_depth, small_rig

OVER = 5.0
"""How many times the well the light of the rung is that clips."""


def straight() -> CameraSheet:
    return CameraSheet()


def bent(power: float) -> CameraSheet:
    """Output is light to a power: below 1 a top step is many electrons, above 1 the noise is many DN."""
    light = np.linspace(0.0, 1.0, 1024) ** (1.0 / power)
    return CameraSheet(black_level_dn=0.0, response=(tuple(light.tolist()),))


@pytest.mark.parametrize("camera", [straight(), bent(0.7), bent(2.0)], ids=["linear", "flat", "steep"])
@pytest.mark.parametrize("rung", [1, 2, 3])
def test_a_pixel_that_a_rung_clips_is_measured_by_the_next(camera: CameraSheet, rung: int) -> None:
    times = ladder_ms(camera, ratio=12.0)
    per_ms = OVER * camera.full_well_e / times[rung]
    instrument = Instrument(
        small_rig(width=120), plane_depth, decades=0.0, peak_e_per_ms=per_ms, camera=camera, seed=rung
    )
    lit = np.isclose(instrument.response, per_ms)
    found = bracket(linear(instrument))
    pull = (found.white_e_per_ms - per_ms - instrument.ambient_e_per_ms) / _sigma(
        camera, per_ms, times[rung + 1]
    )
    assert lit.sum() > 5000
    assert not found.clipped[lit].any()
    assert np.abs(pull[lit]).max() < 5.0
    assert 0.9 < pull[lit].std() < 1.1
    assert found.radiance[lit] == pytest.approx(per_ms * (1.0 - instrument.projector.light[0]), rel=0.1)


def _sigma(camera: CameraSheet, per_ms: float, exposure_ms: float) -> Floats:
    """Standard deviation, electrons per ms, of one picture of that exposure."""
    electrons = per_ms * exposure_ms
    rounding = camera.rounding_e2(np.asarray(electrons))
    return np.asarray(np.sqrt(electrons + camera.read_noise_e**2 + rounding) / exposure_ms)


def test_what_even_the_shortest_exposure_clips_has_no_radiance() -> None:
    camera = CameraSheet()
    per_ms = OVER * camera.full_well_e / camera.exposure_range_ms[0]
    instrument = Instrument(
        small_rig(width=120), plane_depth, decades=0.0, peak_e_per_ms=per_ms, camera=camera
    )
    lit = np.isclose(instrument.response, per_ms)
    found = bracket(instrument)
    assert found.clipped[lit].all()
    assert np.isnan(found.radiance[lit]).all()


@pytest.mark.parametrize("read_noise_e", [2.0, 6.0, 40.0])
@pytest.mark.parametrize("bit_depth", [8, 10, 12])
def test_a_full_well_is_told_by_its_noise(read_noise_e: float, bit_depth: int) -> None:
    camera = CameraSheet(read_noise_e=read_noise_e, bit_depth=bit_depth)
    read = camera.full_well_e + np.random.default_rng(bit_depth).normal(0.0, read_noise_e, 200_000)
    shown = np.minimum(np.rint(camera.black_level_dn + camera.gain_dn_per_e * read), camera.saturation_dn)
    # 3.2 of 100,000 beyond four sigma: 6 expected, 17 with five standard deviations
    assert (shown < camera.clipped_dn).sum() <= 17
    # and little is given away: 3 DN and six sigma of the noise below the top are measured
    assert camera.clipped_dn >= camera.saturation_dn - 3 - 6.0 * camera.gain_dn_per_e * read_noise_e


@pytest.mark.parametrize("power", [0.7, 2.0, 3.0])
def test_a_full_well_behind_a_response_is_told_too(power: float) -> None:
    camera = bent(power)
    read = 1.0 + np.random.default_rng(9).normal(0.0, camera.read_noise_e / camera.full_well_e, 200_000)
    shown = np.minimum(np.rint(1023.0 * read**power), camera.saturation_dn)
    assert (shown < camera.clipped_dn).sum() <= 17
    # six sigma and two DN below the top are measured
    assert camera.clipped_dn >= 1021.0 * (1.0 - 6.0 * camera.read_noise_e / camera.full_well_e) ** power
