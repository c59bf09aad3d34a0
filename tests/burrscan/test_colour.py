"""Scans in colour: what is mixed is measured, undone, and its noise stated."""

from pathlib import Path

import numpy as np
import pytest

from burrscan import InputError, Patterns
from burrscan.arrays import Floats
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.replay import replay
from burrscan.codes.gray_phase import gray_phase
from burrscan.colour.mixing import Mixing, measured_mixing, mixing_of
from burrscan.colour.packing import packed
from burrscan.colour.scan import scan_colour
from burrscan.colour.scanner import MonoScanner, balanced_projector
from burrscan.correspondence import Scan
from burrscan.devices import ProjectorSheet
from burrscan.scan.adaptive import scan_adaptive
from burrscan.scan.rivals.fixed import scan_fixed
from tests.burrscan.colour_instrument import ColourInstrument, planted
from tests.burrscan.instrument import Instrument, small_rig


def errors(scan: Scan, truth_u: Floats) -> tuple[Floats, Floats]:
    """Errors of the accepted pixels that look at one place, px and in their sigmas."""
    found = scan.correspondence
    seen = found.mask & np.isfinite(truth_u)
    off = (found.u_px - truth_u)[seen]
    near = np.abs(off) < 1.0
    return off[near], (off / found.sigma_u_px[seen])[near]


def robust(values: Floats) -> float:
    return float(1.4826 * np.median(np.abs(values - np.median(values))))


def test_what_is_read_together_shares_a_primary() -> None:
    code = gray_phase(width=256)
    frames = np.rint(255.0 * code.light).astype(np.uint8)
    shown = Patterns(np.broadcast_to(frames[:, None], (len(frames), 4, 256)), code.names)
    places = packed(shown)
    assert sorted(n for one in places for n in one) == list(range(len(shown)))
    assert max(map(len, places)) <= np.ceil(len(shown) / 3) + 2
    where = {shown.names[n]: k for k, one in enumerate(places) for n in one}
    for name, place in where.items():
        if name.endswith("-inverse"):
            assert where[name.removesuffix("-inverse")] == place
    assert len({where[name] for name in where if name.startswith("sine")}) == 1


def test_unmixing_undoes_mixing_and_what_cannot_be_undone_is_refused() -> None:
    mixing = Mixing(planted())
    assert mixing.unmix @ mixing.mixed == pytest.approx(np.eye(3), abs=1e-12)
    assert mixing.mixed.sum(axis=1).max() == pytest.approx(1.0)
    assert np.ptp(np.diag(mixing.mixed)) < 1e-12
    with pytest.raises(InputError, match="told apart"):
        Mixing(np.ones((3, 3)) + 0.01 * np.eye(3))
    with pytest.raises(InputError, match="too little"):
        Mixing(np.diag([1.0, 1.0, 0.01]))


def test_balanced_primaries_give_the_light_that_their_sheet_states() -> None:
    raw = ProjectorSheet(np.stack([ProjectorSheet.gamma(gamma=g).light for g in (2.2, 1.9, 2.4)]))
    mixing = Mixing(planted())
    sheet, tables = balanced_projector(raw, mixing)
    for k in range(3):
        given = np.interp(tables[k], np.arange(256.0), raw.light[k])
        assert given == pytest.approx(mixing.balance[k] * sheet.light, abs=1e-9)
    plain = ProjectorSheet.gamma()
    sheet, tables = balanced_projector(plain, Mixing(np.eye(3)))
    assert sheet.light == pytest.approx(plain.light)
    assert (tables == np.arange(256)).all()


def test_the_mixing_is_measured_on_the_part() -> None:
    mixing, frames = measured_mixing(ColourInstrument())
    want = planted()
    assert frames <= 12
    assert mixing.matrix / mixing.matrix[0, 0] == pytest.approx(want / want[0, 0], abs=0.004)


def test_sheets_and_the_colour_give_the_same_mixing() -> None:
    instrument = ColourInstrument()
    mixing = mixing_of(instrument.camera, instrument.projector, own=np.diag(planted()))
    assert mixing.matrix == pytest.approx(planted(), abs=1e-9)


def test_the_unmixed_camera_states_the_noise_of_its_pictures() -> None:
    """Three even frames under equal light, forty times over: their scatter is the sheet's."""
    instrument = ColourInstrument()
    mono = MonoScanner(instrument, Mixing(planted()))
    repeats, shape = 40, instrument.rig.projector.shape
    frames = np.broadcast_to(np.array([186, 187, 188] * repeats, np.uint8)[:, None, None], (120, *shape))
    names = tuple(f"{'abc'[n % 3]}-{n:03d}" for n in range(120))
    images = mono.capture(Patterns(frames, names), 4.0).astype(float).reshape(repeats, 3, -1)
    assert mono.frames == repeats
    mean, spread = images.mean(axis=0), images.std(axis=0, ddof=1)
    lit = (mean > 6000.0) & (images.max(axis=0) < 65535.0)
    assert lit.sum() > 2000
    ratio = (spread / mono.camera.noise_dn(mean))[lit]
    assert np.sqrt(np.mean(ratio**2)) == pytest.approx(1.0, abs=0.05)


def test_a_fixed_scan_in_colour_is_as_fine_as_it_says() -> None:
    instrument = ColourInstrument()
    scan = scan_colour(instrument, method="fixed")
    assert scan.frames == instrument.frames
    _, pulls = errors(scan, instrument.grey.truth_u)
    assert len(pulls) > 2000
    assert 0.9 < robust(pulls) < 1.1
    sheets = scan_colour(ColourInstrument(), method="fixed", unmix="sheets")
    assert 0.9 < robust(errors(sheets, instrument.grey.truth_u)[1]) < 1.1


def test_crosstalk_that_nobody_undoes_spoils_the_scan() -> None:
    good, bad = ColourInstrument(), ColourInstrument()
    off, _ = errors(scan_colour(good, method="fixed"), good.grey.truth_u)
    spoiled, pulls = errors(scan_colour(bad, method="fixed", unmix="none"), bad.grey.truth_u)
    assert robust(pulls) > 1.5
    assert np.sqrt(np.mean(spoiled**2)) > 1.3 * np.sqrt(np.mean(off**2))


def test_an_adaptive_scan_in_colour_takes_half_the_pictures() -> None:
    colour = ColourInstrument()
    scan = scan_colour(colour)
    grey = Instrument(small_rig(width=120), decades=1.5)
    alone = scan_adaptive(grey)
    assert scan.frames == colour.frames
    assert scan.frames < 0.6 * alone.frames
    off, pulls = errors(scan, colour.grey.truth_u)
    assert 0.85 < robust(pulls) < 1.15
    assert scan.correspondence.mask.sum() > 0.95 * alone.correspondence.mask.sum()
    # a third of the light per picture and crosstalk: the finest that can be hoped for is about 1.5 times
    assert robust(off) < 2.0 * robust(errors(alone, grey.truth_u)[0])


def test_captures_in_colour_are_recorded_and_replayed(tmp_path: Path) -> None:
    recorder = RecordingScanner(ColourInstrument(), tmp_path, scan=ScanDocument("colour"))
    scan = scan_colour(recorder)
    recorder.close()
    again, scanner = replay(tmp_path)
    assert again.frames == scan.frames == len(scanner.shots)
    assert np.array_equal(again.correspondence.u_px, scan.correspondence.u_px, equal_nan=True)
    with pytest.raises(InputError, match=r"no shot|recorded pattern"):
        replay(tmp_path, method="fixed")


def test_unknown_ways_to_unmix_are_refused() -> None:
    with pytest.raises(InputError, match="unmix is"):
        scan_colour(ColourInstrument(), unmix="all")  # type: ignore[arg-type]
    plain = ColourInstrument(mixing=np.eye(3), projector=ProjectorSheet.gamma())
    plain.camera = type(plain.camera)()
    with pytest.raises(InputError, match="no crosstalk"):
        scan_colour(plain, unmix="sheets")


def test_a_grey_scan_of_the_same_light_needs_no_colour() -> None:
    """No crosstalk and a grey part: each primary is the grey scanner."""
    grey = Instrument(small_rig(width=120), decades=1.5)
    colour = ColourInstrument(mixing=np.eye(3))
    mono = MonoScanner(colour, Mixing(np.eye(3)))
    assert mono.camera.full_well_e == pytest.approx(grey.camera.full_well_e)
    one, other = scan_fixed(mono, exposure_ms=5.0), scan_fixed(grey, exposure_ms=5.0)
    assert errors(one, grey.truth_u)[1].std() == pytest.approx(errors(other, grey.truth_u)[1].std(), rel=0.1)
    assert mono.frames == 8 + 1  # eight steps of the sine beside four bits and four bits, and a white picture
