"""Plain Gray-code folders: the real capture, the layout, and what is said of folders that are not right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TypedDict

import cv2
import numpy as np
import pytest

from burrscan import CameraSheet, Correspondence, InputError
from burrscan.arrays import Floats, Image, Ints
from burrscan.captures.gray_folder import (
    GrayCapture,
    decode_gray_capture,
    gray_frames,
    is_gray_folder,
    plain_gray_patterns,
    read_gray_folder,
)
from burrscan.captures.opencv import read_opencv_rig
from tests.data import HERE, captures, place


class Raster(TypedDict):
    """A projector's size."""

    width: int
    height: int


SIZE: Raster = {"width": 40, "height": 24}


@pytest.fixture(scope="module", params=captures(), ids=place)
def procam(request: pytest.FixtureRequest) -> GrayCapture:
    return read_gray_folder(request.param / "capture_0", width=1024, height=768)


def by_opencv(pairs: Image, extent: int) -> tuple[Ints, Ints]:
    """OpenCV's ``GrayCodePattern::getProjPixel`` again: codes, and whether every bit differs by 5."""
    on, off = pairs[0::2].astype(int), pairs[1::2].astype(int)
    sure = (np.abs(on - off) >= 5).all(axis=0)
    bits = np.logical_xor.accumulate(on > off, axis=0)  # Gray to binary: each bit adds those above it
    code = (bits * (1 << np.arange(len(bits))[::-1])[:, None, None]).sum(axis=0)
    return code, sure & (code < extent)


def test_the_real_capture_agrees_with_opencvs_rule(procam: GrayCapture) -> None:
    ours = decode_gray_capture(procam)
    assert ours.v_px is not None
    u, u_sure = by_opencv(procam.columns, 1024)
    v, v_sure = by_opencv(procam.rows, 768)
    both = ours.mask & u_sure & v_sure
    off = np.maximum(np.abs(ours.u_px - u), np.abs(ours.v_px - v))[both]
    assert both.mean() > 0.53  # the black squares do not decode
    assert (off <= 0.5).mean() >= 0.99  # half a pixel: a pixel on the border of two columns
    assert ours.mask.mean() > 0.6


def test_the_real_capture_decodes_without_tears(procam: GrayCapture) -> None:
    """Independent of any other decoder: neighbours on one surface see neighbouring projector pixels."""
    ours = decode_gray_capture(procam)
    step = np.abs(np.diff(ours.u_px, axis=1))
    pairs = ours.mask[:, 1:] & ours.mask[:, :-1]
    assert (step[pairs] <= 2.0).mean() > 0.999


def test_opencv_calibrations_are_read() -> None:
    path = HERE / "procam" / "calibration_result.xml"
    rig = read_opencv_rig(path, projector=(1024, 768), camera=(1280, 1024))
    assert rig.camera.fx == pytest.approx(3452.39, abs=0.01)
    assert rig.projector.distortion[4] == pytest.approx(1.69850, abs=1e-4)
    assert np.allclose(
        rig.T_projector_camera[:3, :3] @ rig.T_projector_camera[:3, :3].T, np.eye(3), atol=1e-9
    )
    assert rig.baseline_mm == pytest.approx(np.linalg.norm([85.737, -630.457, -100.844]), abs=0.01)


def test_opencv_calibrations_that_lack_something_say_what(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_opencv_rig(tmp_path / "none.xml", projector=(4, 3), camera=(4, 3))
    (tmp_path / "text.xml").write_text("hello")
    with pytest.raises(InputError, match="FileStorage"):
        read_opencv_rig(tmp_path / "text.xml", projector=(4, 3), camera=(4, 3))
    storage = cv2.FileStorage(str(tmp_path / "part.xml"), cv2.FILE_STORAGE_WRITE)
    storage.write("cam_int", np.eye(3))
    storage.release()
    with pytest.raises(InputError, match="lacks camera distortion"):
        read_opencv_rig(tmp_path / "part.xml", projector=(4, 3), camera=(4, 3))


def write_folder(folder: Path, *, noise: float = 1.0) -> tuple[Floats, Floats]:
    """A board before a 40×24 projector, seen by a camera of 60×50 pixels; returns true columns and rows."""
    rows, columns = np.mgrid[:50, :60].astype(float)
    u, v = 2.0 + 0.6 * columns + 0.02 * rows, 1.0 + 0.4 * rows
    shown = plain_gray_patterns(**SIZE).frames
    rng = np.random.default_rng(0)
    folder.mkdir(exist_ok=True)
    for i, frame in enumerate(shown):
        seen = 10.0 + 150.0 * (frame[np.rint(v).astype(int), np.rint(u).astype(int)] > 0)
        picture = np.clip(np.rint(seen + noise * rng.standard_normal(seen.shape)), 0, 255).astype(np.uint8)
        cv2.imwrite(str(folder / f"graycode_{i:02d}.png"), picture)
    return u, v


def decoded(folder: Path) -> Correspondence:
    return decode_gray_capture(read_gray_folder(folder, **SIZE))


def test_a_written_folder_decodes_to_its_truth(tmp_path: Path) -> None:
    u, v = write_folder(tmp_path)
    assert is_gray_folder(tmp_path)
    found = decoded(tmp_path)
    assert found.v_px is not None
    assert found.mask.all()
    assert np.array_equal(found.u_px, np.rint(u))
    assert np.array_equal(found.v_px, np.rint(v))


def test_the_cameras_noise_is_measured_from_the_pictures(tmp_path: Path) -> None:
    write_folder(tmp_path, noise=4.0)
    camera = read_gray_folder(tmp_path, **SIZE).camera
    assert camera.bit_depth == 8
    assert camera.noise_dn(np.array([80.0]))[0] == pytest.approx(4.0, rel=0.15)


def spoil(folder: Path, number: int, change: object) -> None:
    path = folder / f"graycode_{number:02d}.png"
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    cv2.imwrite(str(path), change(image))  # type: ignore[operator]


def test_a_missing_picture_is_named(tmp_path: Path) -> None:
    write_folder(tmp_path)
    (tmp_path / "graycode_07.png").unlink()
    with pytest.raises(InputError, match=r"picture 7 is missing; a projector of 40×24 takes 24 pictures"):
        decoded(tmp_path)


def test_a_gap_that_was_renumbered_is_noticed(tmp_path: Path) -> None:
    write_folder(tmp_path)
    frames = [tmp_path / f"graycode_{i:02d}.png" for i in range(gray_frames(**SIZE))]
    pictures = [path.read_bytes() for path in frames]
    del pictures[7]
    for path, picture in zip(frames, [*pictures, pictures[-1]], strict=True):
        path.write_bytes(picture)
    with pytest.raises(InputError, match=r"do not differ|not a picture and its inverse"):
        decoded(tmp_path)


def test_sizes_colours_and_depths(tmp_path: Path) -> None:
    write_folder(tmp_path)
    spoil(tmp_path, 3, lambda image: cv2.merge([image] * 3))
    assert decoded(tmp_path).mask.all()  # equal channels are grey
    spoil(tmp_path, 3, lambda image: image * np.array([1, 0, 1], np.uint8))
    with pytest.raises(InputError, match=r"graycode_03\.png: a colour image"):
        decoded(tmp_path)
    write_folder(tmp_path)
    spoil(tmp_path, 4, lambda image: image[:-1])
    with pytest.raises(InputError, match=r"graycode_04.png: 60×49 pixels, but graycode_00.png has 60×50"):
        decoded(tmp_path)
    write_folder(tmp_path)
    for number in range(gray_frames(**SIZE)):
        spoil(tmp_path, number, lambda image: image.astype(np.uint16) * 16)
    assert read_gray_folder(tmp_path, **SIZE).camera.bit_depth == 12
    assert decoded(tmp_path).mask.all()


def test_a_black_capture_says_what_to_check(tmp_path: Path) -> None:
    write_folder(tmp_path)
    for number in range(gray_frames(**SIZE)):
        spoil(tmp_path, number, np.zeros_like)
    with pytest.raises(InputError, match=r"nothing decodes.*lens cap.*projector.*exposure"):
        decoded(tmp_path)


def test_folders_that_hold_no_capture(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such folder"):
        decoded(tmp_path / "none")
    with pytest.raises(InputError, match="no numbered pictures"):
        decoded(tmp_path)


def without(folder: Path, *, ends: bool) -> None:
    """Leave out the inverses, and white and black where ``ends``; number what is left anew."""
    count = gray_frames(**SIZE)
    kept = [*range(0, count - 2, 2), *([] if ends else [count - 2, count - 1])]
    pictures = [(folder / f"graycode_{i:02d}.png").read_bytes() for i in kept]
    for path in folder.iterdir():
        path.unlink()
    for i, picture in enumerate(pictures):
        (folder / f"graycode_{i:02d}.png").write_bytes(picture)


@pytest.mark.parametrize("ends", [False, True])
def test_without_inverses_bits_are_told_by_a_threshold(tmp_path: Path, *, ends: bool) -> None:
    u, v = write_folder(tmp_path, noise=2.0)
    without(tmp_path, ends=ends)
    capture = read_gray_folder(tmp_path, **SIZE)
    assert capture.told_by == ("own range" if ends else "white and black")
    assert capture.camera.noise_dn(np.array([80.0]))[0] == pytest.approx(2.0, rel=0.3)
    found = decode_gray_capture(capture)
    assert found.v_px is not None
    assert found.mask.mean() > 0.99
    assert np.array_equal(found.u_px[found.mask], np.rint(u)[found.mask])
    assert np.array_equal(found.v_px[found.mask], np.rint(v)[found.mask])


def test_a_threshold_is_each_pixels_own(tmp_path: Path) -> None:
    """Half of the board is six times as dark: one threshold for all would read it as zeros."""
    u, _ = write_folder(tmp_path)
    for number in range(gray_frames(**SIZE)):
        spoil(
            tmp_path, number, lambda image: np.where(np.arange(60) < 30, image // 6, image).astype(np.uint8)
        )
    without(tmp_path, ends=False)
    found = decoded(tmp_path)
    assert found.mask[:, :30].mean() > 0.9
    assert np.array_equal(found.u_px[found.mask], np.rint(u)[found.mask])


@pytest.mark.parametrize("inverses", [True, False])
def test_a_pixel_that_hardly_sees_the_projector_is_not_accepted(tmp_path: Path, *, inverses: bool) -> None:
    """Without noise a difference of 5 DN decodes, and is more likely bounced light than the projector."""
    write_folder(tmp_path, noise=0.0)
    for number in range(gray_frames(**SIZE)):
        for columns, gain in ((slice(0, 10), 5.0 / 150.0), (slice(10, 20), 7.0 / 150.0)):

            def dimmer(image: Image, at: slice = columns, by: float = gain) -> Image:
                changed = image.copy()
                changed[:, at] = np.rint(10.0 + by * (image[:, at].astype(float) - 10.0))
                return changed

            spoil(tmp_path, number, dimmer)
    if not inverses:
        without(tmp_path, ends=False)
    camera = CameraSheet(bit_depth=8, full_well_e=1e6, read_noise_e=1.0, black_level_dn=0.0)
    found = decode_gray_capture(read_gray_folder(tmp_path, **SIZE, camera=camera))
    assert not found.mask[:, :10].any()
    assert found.mask[:, 10:].all()


def test_the_real_capture_by_thresholds_agrees_with_itself_by_inverses(procam: GrayCapture) -> None:
    """A bit at the border of two stripes is the one that a threshold may tell another way: one pixel off."""
    by_threshold = replace(
        procam, columns=procam.columns[::2], rows=procam.rows[::2], told_by="white and black"
    )
    ours, theirs = decode_gray_capture(by_threshold), decode_gray_capture(procam)
    both = ours.mask & theirs.mask
    assert both.sum() > 0.8 * theirs.mask.sum()
    assert ours.mask.sum() < 1.05 * theirs.mask.sum()
    assert (np.abs(ours.u_px - theirs.u_px)[both] <= 1.0).mean() > 0.99
