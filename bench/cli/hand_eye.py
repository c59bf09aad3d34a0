"""``burrscan calibrate --hand-eye``."""

from __future__ import annotations

import argparse
from typing import Any

from bench.cli.output import json_beside, note, told


def hand_eye(given: argparse.Namespace) -> int:
    """Find the camera on the flange, print how well, write it."""
    from burrscan.calibration.board import Board
    from burrscan.calibration.hand_eye import calibrate_hand_eye
    from burrscan.captures.folder import read_rig
    from burrscan.captures.hand_eye_folder import hand_eye_document, write_hand_eye
    from burrscan.errors import InputError

    if given.board is None or given.square is None or given.rig is None:
        raise InputError(
            "--hand-eye needs the camera, the board's inner corners and its squares: --rig rig.json "
            "--board 10x7 --square 20"
        )
    board, camera = Board(given.board[0], given.board[1], given.square), read_rig(given.rig).camera
    views, robot = _views(given.folders, board, camera)
    found = calibrate_hand_eye(views, board, camera, robot_mm=robot[0], robot_deg=robot[1])
    with told(given.json):
        _print(found)
    more = {
        "sigma_px": found.sigma_px,
        "robot_factor": found.robot_factor,
        "views": list(found.views),
        "rms_px": found.rms_px.tolist(),
        "off_mm": found.off_mm.tolist(),
        "off_deg": found.off_deg.tolist(),
    }
    with json_beside(given.json, hand_eye_document(found) | more):
        write_hand_eye(given.out, found)
    return 0


def _views(folders: Any, board: Any, camera: Any) -> tuple[list[Any], tuple[float, float]]:
    """The views of all folders, and the repeatability of the arm, which is one arm."""
    from burrscan.captures.hand_eye_folder import hand_eye_view, read_posed_pictures
    from burrscan.errors import InputError

    read = [read_posed_pictures(folder) for folder in folders]
    robots = {(one.repeatability_mm, one.repeatability_deg) for one in read}
    if len(robots) > 1:
        raise InputError("the folders state another repeatability of the arm: calibrate one arm at a time")
    views = []
    for path, pose in (picture for one in read for picture in one.pictures):
        if not path.is_file():
            raise InputError(f"{path}: no such picture, but the poses name it")
        view = hand_eye_view(path, pose, board, camera)
        if view is None:
            note(f"note: left out: {path}: no board of {board.columns}×{board.rows} inner corners, whole")
        else:
            views.append(view)
    return views, robots.pop()


def _print(found: Any) -> None:
    print("RMS px   arm off mm   arm off deg  picture")
    for row in zip(found.rms_px, found.off_mm, found.off_deg, found.views, strict=True):
        print("{:6.3f}{:13.3f}{:14.4f}  {}".format(*row))
    print(
        f"\ncorners known to {found.sigma_px:.3f} px; the arm is {found.robot_factor:.1f} times as far off as"
    )
    print("it repeats\n")
    for axis, place, off, turn in zip(
        "xyz", found.T_flange_camera[:3, 3], found.sigma_mm, found.sigma_deg, strict=True
    ):
        print(
            f"camera on flange {axis}  {place:10.4f} mm ± {off:.4f} mm, ± {turn:.4f} deg about its own {axis}"
        )
