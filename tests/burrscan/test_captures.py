"""What is recorded comes back, and what is damaged is named."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from burrscan import CameraSheet, InputError, Patterns, ProjectorSheet, Rig
from burrscan.arrays import Image
from burrscan.captures import FolderScanner, RecordingScanner
from scenes.rig import RigSpec


class Noise:
    """A scanner that sees nothing but noise."""

    def __init__(self) -> None:
        self.rng = np.random.default_rng(0)
        self.rig: Rig = RigSpec(scale=0.05).rig()
        self.camera = CameraSheet()
        self.projector = ProjectorSheet.gamma()

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        assert exposure_ms > 0.0
        shape = (len(patterns), *self.rig.camera.shape)
        return self.rng.integers(0, 1024, shape).astype(np.uint16)


def shown(*names: str, level: int = 7) -> Patterns:
    frames = np.arange(len(names), dtype=np.uint8)[:, None, None] + np.uint8(level)
    return Patterns(np.broadcast_to(frames, (len(names), *RigSpec(scale=0.05).rig().projector.shape)), names)


@pytest.fixture
def capture(tmp_path: Path) -> tuple[Path, Image, Image]:
    recorder = RecordingScanner(Noise(), tmp_path / "capture")
    first = recorder.capture(shown("a", "b"), 10.0)
    again = recorder.capture(shown("a"), 10.0)
    recorder.close()
    return tmp_path / "capture", first, again


def test_a_replay_is_what_was_recorded(capture: tuple[Path, Image, Image]) -> None:
    folder, first, again = capture
    replay = FolderScanner(folder)
    assert np.array_equal(replay.capture(shown("a", "b"), 10.0), first)
    assert np.array_equal(replay.capture(shown("a"), 10.0), again)
    assert replay.rig.camera == Noise().rig.camera
    assert np.array_equal(replay.rig.T_projector_camera, Noise().rig.T_projector_camera)
    assert replay.camera == Noise().camera
    assert np.array_equal(replay.projector.light, Noise().projector.light)


def test_unrecorded_shots_are_refused(capture: tuple[Path, Image, Image]) -> None:
    folder, *_ = capture
    with pytest.raises(InputError, match="no shot 'c'"):
        FolderScanner(folder).capture(shown("c"), 10.0)
    with pytest.raises(InputError, match="taken at 10, 10 ms"):
        FolderScanner(folder).capture(shown("a"), 11.0)
    with pytest.raises(InputError, match="not the one this scan"):
        FolderScanner(folder).capture(shown("a", level=9), 10.0)


def test_damaged_folders_are_refused_with_a_reason(capture: tuple[Path, Image, Image]) -> None:
    folder, *_ = capture
    image = folder / "images" / "0000.png"
    whole = image.read_bytes()
    cv2.imwrite(str(image), np.zeros((3, 4), np.uint8))
    with pytest.raises(InputError, match=r"4×3 pixels, but rig\.json says 64×51"):
        FolderScanner(folder).capture(shown("a"), 10.0)
    colour = np.zeros((*Noise().rig.camera.shape, 3), np.uint8)
    colour[..., 0] = 9
    cv2.imwrite(str(image), colour)
    with pytest.raises(InputError, match="colour"):
        FolderScanner(folder).capture(shown("a"), 10.0)
    image.write_bytes(whole[:40])
    with pytest.raises(InputError, match="not an image"):
        FolderScanner(folder).capture(shown("a"), 10.0)
    image.unlink()
    with pytest.raises(InputError, match="no such image"):
        FolderScanner(folder).capture(shown("a"), 10.0)


def test_every_error_of_a_rig_file_is_listed(capture: tuple[Path, Image, Image]) -> None:
    folder, *_ = capture
    document = json.loads((folder / "rig.json").read_text())
    del document["camera"]["fx"]
    document["camera"]["height"] = 2**63
    document["projector"]["widht"] = 4
    (folder / "rig.json").write_text(json.dumps(document))
    with pytest.raises(InputError) as caught:
        FolderScanner(folder)
    assert "camera.fx" in str(caught.value)
    assert "camera.height" in str(caught.value)
    assert "did you mean 'width'" in str(caught.value)
