"""Scanning a folder gives what the scanner gave, and bad folders their message."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import cv2
import numpy as np
import pytest

from burrscan import InputError
from burrscan.captures import FolderScanner, RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.replay import replay
from burrscan.correspondence import Scan
from burrscan.scan.rivals.fixed import scan_fixed
from tests.burrscan.instrument import Instrument, small_rig

PARAMETERS = {"exposure_ms": 2.0, "parameters": {"steps": 6}}


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Scan]:
    folder = tmp_path_factory.mktemp("captures") / "one"
    scanner = Instrument(small_rig(width=96), decades=1.0)
    recorder = RecordingScanner(scanner, folder, scan=ScanDocument("fixed", PARAMETERS))
    scan = scan_fixed(recorder, exposure_ms=2.0, parameters={"steps": 6})
    recorder.close()
    return folder, scan


@pytest.fixture
def folder(recorded: tuple[Path, Scan], tmp_path: Path) -> Path:
    return Path(shutil.copytree(recorded[0], tmp_path / "capture"))


def edit(folder: Path, name: str, **changes: object) -> None:
    document = json.loads((folder / name).read_text())
    for key, value in changes.items():
        if value is None:
            document.pop(key)
        else:
            document[key] = value
    (folder / name).write_text(json.dumps(document))


def test_a_folder_is_scanned_as_it_was_recorded(recorded: tuple[Path, Scan]) -> None:
    scan, scanner = replay(recorded[0])
    assert scanner.scan is not None
    assert (scanner.scan.method, dict(scanner.scan.parameters)) == ("fixed", PARAMETERS)
    assert np.array_equal(scan.correspondence.u_px, recorded[1].correspondence.u_px, equal_nan=True)
    assert scanner.replayed == len(scanner.shots)


def test_a_folder_without_a_strategy_is_still_version_1(folder: Path) -> None:
    edit(folder, "capture.json", scan=None)
    assert FolderScanner(folder).scan is None
    with pytest.raises(InputError, match="no shot"):
        replay(folder, method="fixed")  # by default it brackets, which nobody recorded here


def test_a_strategy_is_found_by_its_shots(tmp_path: Path) -> None:
    recorder = RecordingScanner(Instrument(small_rig(width=96), decades=1.0), tmp_path)
    scan = scan_fixed(recorder)
    recorder.close()
    found, _ = replay(tmp_path)
    assert np.array_equal(found.correspondence.u_px, scan.correspondence.u_px, equal_nan=True)


def test_a_missing_picture_and_a_missing_shot_are_named(folder: Path) -> None:
    (folder / "images" / "0005.png").unlink()
    with pytest.raises(InputError, match=r"0005\.png: no such image; the capture is incomplete"):
        replay(folder)
    shots = json.loads((folder / "capture.json").read_text())["shots"]
    edit(folder, "capture.json", shots=shots[:3] + shots[4:])
    with pytest.raises(InputError):
        replay(folder)


def test_a_wrong_size_is_told_against_the_rig(folder: Path) -> None:
    cv2.imwrite(str(folder / "images" / "0002.png"), np.zeros((5, 7), np.uint8))
    with pytest.raises(InputError, match=r"0002\.png: 7×5 pixels, but rig\.json says 96×76"):
        replay(folder)


def test_depth_and_colour(folder: Path) -> None:
    path = folder / "images" / "0001.png"
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    assert image is not None
    cv2.imwrite(str(path), cv2.merge([image, image, image]))
    replay(folder)  # equal channels are grey
    cv2.imwrite(str(path), image * 64)
    with pytest.raises(InputError, match=r"10 bits.*shifted left: divide them by 64"):
        replay(folder)
    cv2.imwrite(str(path), image + np.uint16(3000))
    with pytest.raises(InputError, match=r"10 bits \(0 to 1023\); state a bit_depth of 12"):
        replay(folder)
    cv2.imwrite(str(path), cv2.merge([image, image, image // 2]))
    with pytest.raises(InputError, match="colour"):
        replay(folder)


def test_a_rig_without_a_field(folder: Path) -> None:
    rig = json.loads((folder / "rig.json").read_text())
    del rig["projector"]["fy"]
    edit(folder, "rig.json", **rig)
    with pytest.raises(InputError, match=r"rig\.json: 1 problem\(s\)\n  projector\.fy: field required"):
        replay(folder)


def test_a_black_capture_says_what_to_check(folder: Path) -> None:
    for path in (folder / "images").iterdir():
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert image is not None
        cv2.imwrite(str(path), np.full_like(image, 8))
    with pytest.raises(InputError, match=r"nothing decodes.*black.*8 of 1023 DN.*lens cap.*exposure"):
        replay(folder)


def test_pictures_that_belong_to_nothing(folder: Path) -> None:
    rng = np.random.default_rng(0)
    for path in (folder / "images").iterdir():
        image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
        assert image is not None
        cv2.imwrite(str(path), np.full_like(image, 400 + int(rng.integers(2))))
    with pytest.raises(InputError, match="no pixel decodes, though the pictures are not dark"):
        replay(folder)


def noiseless_sheet(folder: Path, *names: str) -> None:
    camera = json.loads((folder / "capture.json").read_text())["camera"]
    for name in names:
        del camera[name]
    edit(folder, "capture.json", camera=camera)


def test_noise_that_is_not_stated_is_measured_from_the_pictures(
    recorded: tuple[Path, Scan], folder: Path
) -> None:
    true = FolderScanner(folder).camera
    noiseless_sheet(folder, "full_well_e", "read_noise_e")
    scan, scanner = replay(folder)
    for value in (100.0, 300.0, 800.0):
        assert scanner.camera.noise_dn(np.array(value)) == pytest.approx(
            true.noise_dn(np.array(value)), rel=0.1
        )
    ours, theirs = scan.correspondence, recorded[1].correspondence
    both = ours.mask & theirs.mask
    assert both.sum() > 0.97 * theirs.mask.sum()
    assert np.median(ours.sigma_u_px[both] / theirs.sigma_u_px[both]) == pytest.approx(1.0, abs=0.1)


def test_one_value_that_is_stated_stays(folder: Path) -> None:
    true = FolderScanner(folder).camera
    noiseless_sheet(folder, "read_noise_e")
    camera = FolderScanner(folder).camera
    assert camera.full_well_e == true.full_well_e
    assert 0.0 < camera.read_noise_e < 10.0 * true.read_noise_e


def test_noise_that_no_picture_tells_must_be_stated(folder: Path) -> None:
    shots = json.loads((folder / "capture.json").read_text())["shots"]
    edit(folder, "capture.json", shots=[shot for shot in shots if shot["name"].startswith("even")])
    noiseless_sheet(folder, "full_well_e")
    with pytest.raises(InputError, match=r"camera\.full_well_e and camera\.read_noise_e: state them"):
        FolderScanner(folder)


def test_the_even_shot_that_is_missing_is_explained(folder: Path) -> None:
    shots = json.loads((folder / "capture.json").read_text())["shots"]
    edit(folder, "capture.json", shots=[shot for shot in shots if not shot["name"].startswith("even")])
    with pytest.raises(InputError, match="no shot 'even-255', the whole projector at level 255 of 255"):
        replay(folder)


def test_the_documents_name_the_even_shot() -> None:
    page = (Path(__file__).parents[2] / "burrscan" / "captures" / "README.md").read_text("utf-8")
    assert "`even-255`: the whole projector at level 255" in page
