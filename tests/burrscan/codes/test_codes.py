"""Encode and decode are inverses; sigma tells the truth; doubt is masked."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from burrscan.arrays import Floats, Image
from burrscan.codes import METHODS
from burrscan.codes.code import Code, light_of, patterns
from burrscan.codes.gray import cells_of, decode_gray, encode_gray, gray_bits
from burrscan.codes.phase import decode_phase, encode_phase
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.rig import View
from burrscan.variants import resolve

CAMERA = CameraSheet()
FAMILIES = sorted(METHODS)
SINES = [name for name in FAMILIES if name not in {"binary", "gray"}]


def pictures(light: Floats, *, signal_dn: float, dark_dn: float, rng: np.random.Generator | None) -> Image:
    """Every column of the code as one camera pixel, in several identical rows."""
    mean = CAMERA.black_level_dn + dark_dn + signal_dn * light[:, None, :].repeat(20, axis=1)
    if rng is not None:
        mean = mean + rng.normal(size=mean.shape) * CAMERA.noise_dn(mean)
    return np.clip(np.rint(mean), 0, CAMERA.saturation_dn).astype(np.uint16)


def build(name: str, **parameters: float) -> Code:
    code = resolve(name, METHODS, stage="code")(**parameters)
    assert isinstance(code, Code)
    return code


@pytest.mark.parametrize("name", FAMILIES)
@settings(max_examples=12, deadline=None)
@given(width=st.integers(64, 1100), signal_dn=st.floats(300.0, 1000.0), dark_dn=st.floats(0.0, 10.0))
def test_decode_inverts_encode(name: str, width: int, signal_dn: float, dark_dn: float) -> None:
    code = build(name, width=width)
    assert code.light.shape == (len(code.names), width)
    assert code.light.min() >= 0.0
    assert code.light.max() <= 1.0
    assert len(set(code.names)) == len(code.names)
    found = code.decode(pictures(code.light, signal_dn=signal_dn, dark_dn=dark_dn, rng=None), CAMERA)
    error = np.abs(found.u_px - np.arange(width))[found.mask]
    assert found.mask.mean() > 0.97
    assert error.max() < 0.1


@pytest.mark.parametrize("name", SINES)
@pytest.mark.parametrize("signal_dn", [40.0, 900.0])
def test_stated_sigma_is_the_error(name: str, signal_dn: float) -> None:
    rng = np.random.default_rng(5)
    code = build(name, width=512)
    found = code.decode(pictures(code.light, signal_dn=signal_dn, dark_dn=2.0, rng=rng), CAMERA)
    pulls = ((found.u_px - np.arange(512)) / found.sigma_u_px)[found.mask]
    assert len(pulls) > 5000
    # the standard error of a standard deviation of 5000 values is 1 %
    assert 0.95 < 1.4826 * np.median(np.abs(pulls)) < 1.05


@pytest.mark.parametrize("name", FAMILIES)
def test_nothing_seen_is_nothing_accepted(name: str) -> None:
    rng = np.random.default_rng(6)
    code = build(name, width=512)
    found = code.decode(pictures(code.light, signal_dn=0.0, dark_dn=5.0, rng=rng), CAMERA)
    assert found.mask.mean() < 1e-3


@pytest.mark.parametrize("name", sorted(set(SINES) - {"complementary"}))
def test_clipped_pixels_are_masked(name: str) -> None:
    code = build(name, width=512)
    found = code.decode(pictures(code.light, signal_dn=3000.0, dark_dn=0.0, rng=None), CAMERA)
    assert not found.mask.any()


@pytest.mark.parametrize("signal_dn", [1100.0, 1800.0, 3000.0, 4000.0])
def test_complementary_phase_reads_what_saturates(signal_dn: float) -> None:
    rng = np.random.default_rng(7)
    code = build("complementary", width=512)
    found = code.decode(pictures(code.light, signal_dn=signal_dn, dark_dn=2.0, rng=rng), CAMERA)
    pulls = ((found.u_px - np.arange(512)) / found.sigma_u_px)[found.mask]
    assert found.mask.mean() > 0.99
    assert 0.95 < 1.4826 * np.median(np.abs(pulls)) < 1.05
    # what is left of the bias of choosing steps: within four standard errors and 3 % of a sigma
    assert abs(pulls.mean()) < 4.0 / np.sqrt(len(pulls)) + 0.03


def test_complementary_phase_needs_three_clear_steps() -> None:
    code = build("complementary", width=512)
    found = code.decode(pictures(code.light, signal_dn=60_000.0, dark_dn=0.0, rng=None), CAMERA)
    assert not found.mask.any()
    with pytest.raises(InputError, match="odd"):
        build("complementary", width=512, steps=4)


@given(width=st.integers(2, 2000), cell_px=st.integers(1, 16))
def test_gray_neighbours_differ_in_one_bit(width: int, cell_px: int) -> None:
    bits = gray_bits(width=width, cell_px=cell_px)
    changes = (bits[:, 1:] != bits[:, :-1]).sum(axis=0)
    assert set(np.unique(changes)) <= {0, 1}
    code = (bits * (1 << np.arange(len(bits) - 1, -1, -1)[:, None])).sum(axis=0)
    np.testing.assert_array_equal(cells_of(code), np.arange(width) // cell_px)


def test_a_doubtful_gray_bit_offers_both_sides_of_the_border() -> None:
    light, _ = encode_gray(width=64, cell_px=8)
    image = pictures(light, signal_dn=500.0, dark_dn=0.0, rng=None)
    image[:, :, 8] = (image[:, :, 7].astype(int) + image[:, :, 8]) // 2
    cell, other = decode_gray(image, camera=CAMERA)
    assert {int(cell[0, 8]), int(other[0, 8])} == {0, 1}
    assert cell[0, 9] == other[0, 9] == 1


def test_phase_reads_amplitude_and_mean() -> None:
    light, _ = encode_phase(width=256, period_px=16.0, steps=5)
    phase = decode_phase(
        pictures(light, signal_dn=400.0, dark_dn=30.0, rng=None), camera=CAMERA, period_px=16.0
    )
    np.testing.assert_allclose(phase.amplitude_dn, 200.0, atol=1.0)
    np.testing.assert_allclose(phase.mean_dn, CAMERA.black_level_dn + 230.0, atol=0.6)


def test_dimmed_patterns_carry_the_wanted_light() -> None:
    sheet = ProjectorSheet.gamma()
    view = View(64, 48, 100.0, 100.0, 31.5, 23.5)
    light, names = encode_phase(width=64, period_px=16.0, steps=4)
    intensity = np.full(view.shape, 0.05)
    shown = patterns(light, names, view=view, sheet=sheet, intensity=intensity)
    given_light = light_of(shown.frames, sheet).mean(axis=1)
    wanted = np.maximum(0.05 * light, sheet.light[0])
    np.testing.assert_allclose(given_light, wanted, atol=0.05 * 0.012)
