"""``burrscan calibrate --hand-eye``: drawn boards and reported poses in, the camera on the flange out."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.cli import main
from burrscan.arrays import Floats
from burrscan.calibration.board import Board, find_corners
from burrscan.captures import hand_eye_folder
from burrscan.captures.folder import write_rig
from burrscan.captures.hand_eye_folder import hand_eye_view, read_hand_eye
from burrscan.captures.png import write_grey
from burrscan.rig import Rig, View
from tests.burrscan.arm import Arm, arm
from tests.burrscan.boards import drawn_board
from tests.tiers import some_of

BOARD = Board(8, 5, 16.0)
CAMERA = View(320, 256, 686.0, 686.0, 159.5, 127.5)
POSES = 7


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Arm]:
    """Seven pictures of 320 × 256 pixels, one of them upside down, as poses.json and as poses.csv."""
    folder = tmp_path_factory.mktemp("arm")
    rng = np.random.default_rng(5)
    one = arm(rng, poses=POSES, board=BOARD, tilt_deg=np.array([25.0, 25.0, 20.0]), upside_down=3)
    write_rig(folder / "rig.json", Rig(CAMERA, CAMERA, np.eye(4)))
    for kind in ("json", "csv"):
        (folder / kind).mkdir()
    rows = []
    for number in range(POSES):
        picture, _ = drawn_board(BOARD, noise=4.0, seed=number, view=CAMERA, pose=one.T_camera_board(number))
        for kind in ("json", "csv"):
            write_grey(folder / kind / f"{number}.png", picture)
        told = one.reported[number]
        turn = Rotation.from_matrix(told[:3, :3]).as_rotvec(degrees=True)
        rows.append([f"{number}.png", *told[:3, 3], *turn])
    poses = [{"image": f"{n}.png", "T_base_flange": told.tolist()} for n, told in enumerate(one.reported)]
    document = {"format": "burrscan-hand-eye-poses", "version": 1, "poses": poses}
    (folder / "json/poses.json").write_text(json.dumps(document))
    with (folder / "csv/poses.csv").open("w", newline="") as file:
        csv.writer(file).writerows([["image", "x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"], *rows])
    return folder, one


def calibrate(folder: Path, kind: str, *more: str, board: str = "8x5") -> int:
    camera = ["--rig", str(folder / "rig.json"), "--board", board, "--square", "16"]
    out = ["--out", str(folder / kind / "hand_eye.json")]
    return main(["calibrate", str(folder / kind), "--hand-eye", *camera, *out, *more])


def twist(found: Floats, true: Floats) -> Floats:
    off = np.linalg.inv(found) @ true
    return np.array([*Rotation.from_matrix(off[:3, :3]).as_rotvec(), *off[:3, 3]])


@some_of("kind", ["json", "csv"])
def test_drawn_boards_give_the_camera_on_the_flange(
    kind: str, drawn: tuple[Path, Arm], capsys: pytest.CaptureFixture[str]
) -> None:
    folder, one = drawn
    assert calibrate(folder, kind, "--json", str(folder / "told.json")) == 0
    found, covariance = read_hand_eye(folder / kind / "hand_eye.json")
    off = twist(found, one.T_flange_camera)
    assert off @ np.linalg.solve(covariance, off) < 27.9  # chi-squared of six: one in ten thousand
    assert np.linalg.norm(off[3:]) < 1.0
    told = json.loads((folder / "told.json").read_text())
    assert told["sigma_px"] < 0.1
    assert len(told["views"]) == POSES
    assert "camera on flange x" in capsys.readouterr().out


def test_what_is_missing_or_wrong_ends_with_2_and_says_what_to_do(
    drawn: tuple[Path, Arm], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = drawn

    def refused(words: str, *arguments: str) -> None:
        out = tmp_path / "out.json"
        given = ["calibrate", *arguments, "--hand-eye", "--out", str(out)]
        assert main(given) == 2
        assert words in capsys.readouterr().err
        assert not out.exists()

    board = ["--board", "8x5", "--square", "16", "--rig", str(folder / "rig.json")]
    refused("--rig rig.json", str(folder / "json"))
    refused("no poses.json and no poses.csv", str(tmp_path), *board)
    refused("looks the same upside down", str(folder / "json"), *board[2:], "--board", "8x6")
    (tmp_path / "poses.csv").write_text("image,x,y\n0.png,1,2\n")
    refused("must name the columns image,x_mm", str(tmp_path), *board)
    (tmp_path / "poses.csv").write_text("image,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg\n0.png,1,2,3,4,5,x\n")
    refused("line 2: not six numbers", str(tmp_path), *board)
    columns = "image,x_mm,y_mm,z_mm,rx_deg,ry_deg,rz_deg"
    (tmp_path / "poses.csv").write_text(f"{columns}\n0.png,1,2,3,4,1e300,6\n")
    refused("line 2: rx_deg and the others are degrees", str(tmp_path), *board)
    (tmp_path / "poses.csv").write_text(f"{columns}\n0.png,1e300,2,3,4,5,6\n")
    refused("line 2: shifts by 1e+300 mm", str(tmp_path), *board)
    (tmp_path / "poses.csv").write_text(f"{columns}\n0.png,1,2,3,4,5,6\n")
    refused("no such picture", str(tmp_path), *board)
    (tmp_path / "poses.json").write_text('{"format": "burrscan-hand-eye-poses", "version": 1, "pose": []}')
    refused("pose: unknown key", str(tmp_path), *board)


def test_a_picture_without_a_board_is_left_out(
    drawn: tuple[Path, Arm], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, one = drawn
    poses = [
        {"image": str(folder / "json" / f"{n}.png") if n else "grey.png", "T_base_flange": told.tolist()}
        for n, told in enumerate(one.reported)
    ]
    document = {"format": "burrscan-hand-eye-poses", "version": 1, "poses": poses}
    (tmp_path / "poses.json").write_text(json.dumps(document))
    write_grey(tmp_path / "grey.png", np.full(CAMERA.shape, 500, np.uint16))
    (tmp_path / "rig.json").write_text((folder / "rig.json").read_text())
    out = tmp_path / "hand_eye.json"
    given = ["calibrate", str(tmp_path), "--hand-eye", "--rig", str(tmp_path / "rig.json"), "--board", "8x5"]
    assert main([*given, "--square", "16", "--out", str(out)]) == 0
    assert "left out" in capsys.readouterr().err
    assert out.exists()


def test_corners_counted_from_the_other_end_are_turned_round(
    drawn: tuple[Path, Arm], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A finder that starts wherever the board's upper left is in the picture."""
    folder, one = drawn
    picture, pose = folder / "json/0.png", one.reported[0]
    straight = hand_eye_view(picture, pose, BOARD, CAMERA)
    find = find_corners

    def backwards(*given: object, **options: object) -> Floats:
        found = find(*given, **options)  # type: ignore[arg-type]
        assert found is not None
        return found[::-1]

    monkeypatch.setattr(hand_eye_folder, "find_corners", backwards)
    turned = hand_eye_view(picture, pose, BOARD, CAMERA)
    assert straight is not None
    assert turned is not None
    np.testing.assert_array_equal(straight.corners_px, turned.corners_px)
