"""A camera with a response curve: its pictures become those of a linear one, with the right noise."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from burrscan import CameraSheet, InputError
from burrscan.codes.gray_phase import gray_phase
from burrscan.correspondence import Scan
from burrscan.linear import linear, linear_camera, linear_images
from burrscan.scan import METHODS
from burrscan.variants import resolve
from tests.burrscan.instrument import Instrument, small_rig
from tests.tiers import some_of

TOE = 0.004


def bent_camera(*, gamma: float = 0.6, bit_depth: int = 10, black: float = 12.0) -> CameraSheet:
    """Output is light to a power, with a straight start; the curve's inverse is the sheet's response."""
    top = (1 << bit_depth) - 1
    output = (np.arange(top + 1.0) - black) / (top - black)
    toe_output = TOE**gamma
    light = np.where(output < toe_output, output * TOE / toe_output, np.maximum(output, 0.0) ** (1.0 / gamma))
    return CameraSheet(bit_depth=bit_depth, black_level_dn=black, response=(tuple(light.tolist()),))


@lru_cache(maxsize=8)
def scanned(name: str, gamma: float) -> tuple[Scan, Instrument]:
    camera = bent_camera(gamma=gamma) if gamma != 1.0 else CameraSheet(black_level_dn=12.0)
    instrument = Instrument(small_rig(width=200), camera=camera)
    return resolve(name, METHODS, stage="scan")(instrument), instrument


def pulls(name: str, gamma: float) -> tuple[float, float]:
    """Robust deviation of the pulls of inliers, and the share of accepted columns that are wrong."""
    scan, instrument = scanned(name, gamma)
    error = scan.correspondence.u_px - instrument.truth_u
    accepted = scan.correspondence.mask
    right = accepted & (np.abs(error) <= 1.0)
    pull = (error / scan.correspondence.sigma_u_px)[right]
    return 1.4826 * float(np.median(np.abs(pull))), 1.0 - float(right[accepted].mean())


@some_of("name", ["fixed", "adaptive", "multi_exposure"])
def test_pulls_hold_with_a_curve(name: str) -> None:
    deviation, wrong = pulls(name, 0.6)
    assert 0.9 < deviation < 1.1
    assert wrong < 0.002


@some_of("name", [*sorted(set(METHODS) - {"colour", "single_shot"}), "single_shot"], first=len(METHODS) - 2)
def test_every_strategy_measures_as_much_and_as_well_with_a_curve(name: str) -> None:
    bent, straight = scanned(name, 0.6)[0].correspondence, scanned(name, 1.0)[0].correspondence
    assert bent.mask.sum() == pytest.approx(straight.mask.sum(), rel=0.03)
    assert pulls(name, 0.6)[0] == pytest.approx(pulls(name, 1.0)[0], rel=0.05)


def test_a_linear_camera_passes_through() -> None:
    instrument = Instrument(small_rig(width=40))
    assert linear(instrument) is instrument
    images = np.ones((1, 2, 3), np.uint16)
    assert linear_images(images, instrument.camera) is images
    assert linear_camera(instrument.camera) == instrument.camera


@given(gamma=st.floats(0.4, 1.0), bits=st.sampled_from([8, 10, 12]))
def test_the_curve_is_undone(gamma: float, bits: int) -> None:
    camera = bent_camera(gamma=gamma, bit_depth=bits, black=3.0)
    straight = linear_camera(camera)
    dn = np.arange(1 << bits, dtype=np.uint16)
    electrons = straight.electrons_of(linear_images(dn, camera).astype(float))
    scale = camera.full_well_e / straight.full_well_e  # its electrons are as many times larger
    measured = dn < camera.clipped_dn
    assert (electrons * scale)[measured] == pytest.approx(
        camera.electrons_of(dn[measured].astype(float)), abs=0.2
    )
    # what a full well may show by its noise is saturated, and nothing else
    linear_dn = linear_images(dn, camera)
    assert (linear_dn[measured] < straight.saturation_dn).all()
    assert (linear_dn[~measured] == straight.saturation_dn).all()
    lowest = camera.electrons_of(np.array([camera.clipped_dn + 1.0]))[0]
    assert lowest > camera.full_well_e - 4.0 * camera.read_noise_e


@pytest.mark.parametrize("bits", [8, 10])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.1, 0.5, 0.9])
def test_the_linear_cameras_noise_is_what_pictures_have(bits: int, share: float) -> None:
    camera = replace(bent_camera(bit_depth=bits, black=0.06 * (1 << bits)), read_noise_e=12.0)
    straight = linear_camera(camera)
    rng = np.random.default_rng(4)
    electrons = rng.poisson(share * camera.full_well_e, 200_000) + rng.normal(0.0, 12.0, 200_000)
    light = np.asarray(camera.response[0])
    raw = np.rint(np.interp(electrons / camera.full_well_e, light, np.arange(len(light))))
    seen = linear_images(raw.astype(np.uint16), camera).astype(float)
    assert straight.noise_dn(np.array(seen.mean())) == pytest.approx(seen.std(), rel=0.04)
    assert camera.noise_dn(np.array(raw.mean())) == pytest.approx(raw.std(), rel=0.05)


def test_rows_of_channels_are_taken_off_apart() -> None:
    first, second = bent_camera(gamma=0.5), bent_camera(gamma=0.8)
    both = replace(first, response=first.response + second.response)
    raw = np.random.default_rng(0).integers(0, 1024, (2, 3, 4, 2)).astype(np.uint16)
    found = linear_images(raw, both)
    # one black level for all channels: light 0 is the same number everywhere
    black = linear_camera(both).black_level_dn
    for channel, camera in enumerate((first, second)):
        light = camera.electrons_of(raw[..., channel].astype(float)) / camera.full_well_e
        assert (found[..., channel] - black) / (65535.0 - black) == pytest.approx(light, abs=2e-5)
        assert both.channel(channel).response == camera.response


def test_a_code_reads_raw_images_of_a_bent_camera() -> None:
    camera = bent_camera()
    code = gray_phase(width=64)
    light = np.asarray(camera.response[0])
    share = 0.02 + 0.7 * code.light
    raw = np.rint(np.interp(share, light, np.arange(len(light)))).astype(np.uint16)
    found = code.decode(np.broadcast_to(raw[:, None, :], (len(raw), 2, 64)).copy(), camera)
    assert found.mask.mean() > 0.95
    assert np.abs(found.u_px - np.arange(64.0))[found.mask].max() < 0.05


def test_tables_that_are_none_are_refused() -> None:
    with pytest.raises(InputError, match="needs 1024 values"):
        CameraSheet(response=((0.0, 0.5, 1.0),))
    with pytest.raises(InputError, match=r"it has 0$"):
        CameraSheet(response=((),))
    with pytest.raises(InputError, match="not falling"):
        CameraSheet(bit_depth=2, response=((0.0, 0.5, 0.4, 1.0),))
    with pytest.raises(InputError, match="as many rows as columns"):
        CameraSheet(crosstalk=((1.0, 0.1),))
