"""A capture of a calibration board, of whichever kind: the white picture, and where each pixel looks."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from burrscan.arrays import Image, freeze
from burrscan.captures.folder import rasters_of, read_capture
from burrscan.captures.gray_folder import decode_gray_capture, is_gray_folder, read_gray_folder
from burrscan.captures.phase_folder import decode_phase_capture, is_phase_folder, read_phase_folder
from burrscan.captures.replay import replay
from burrscan.correspondence import Correspondence
from burrscan.errors import InputError


@dataclass(frozen=True)
class BoardCapture:
    """A board as both devices see it.

    Parameters
    ----------
    white
        (h, w) DN of the board under full light.
    correspondence
        Columns and rows.
    camera, projector
        Width and height of both.

    """

    white: Image
    correspondence: Correspondence
    camera: tuple[int, int]
    projector: tuple[int, int]

    def __post_init__(self) -> None:
        freeze(self, white=self.white)


def read_board_folder(folder: Path, *, gray: tuple[int, int] | None = None) -> BoardCapture:
    """Decode a capture folder that codes columns and rows, or a plain folder of Gray code or phase steps.

    Parameters
    ----------
    folder
        The capture. Of a capture folder the rig is not read, for it is what is sought.
    gray
        The projector's width and height, which a plain Gray-code folder does not say.

    Raises
    ------
    InputError
        When the folder cannot be used, or codes columns alone.

    """
    if not folder.is_dir():
        raise InputError(
            f"{folder}: no such folder; a board is one capture folder for each pose of the chessboard"
        )
    if is_phase_folder(folder):
        return _phase_steps(folder)
    if (folder / "capture.json").exists():
        return _coded(folder)
    if gray is None:
        what = "a plain Gray-code folder" if is_gray_folder(folder) else "no capture.json"
        raise InputError(f"{folder}: {what}; for plain Gray code say the projector's raster: --gray 1024x768")
    capture = read_gray_folder(folder, width=gray[0], height=gray[1])
    height, width = capture.white.shape
    return BoardCapture(capture.white, decode_gray_capture(capture), (width, height), gray)


def _phase_steps(folder: Path) -> BoardCapture:
    capture = read_phase_folder(folder)
    if capture.rows is None:
        raise InputError(f"{folder}: codes columns alone, and rows are not known before the rig; add 'rows'")
    height, width = capture.white.shape
    raster = capture.document.projector
    decoded = decode_phase_capture(capture)
    return BoardCapture(capture.white, decoded, (width, height), (raster.width, raster.height))


def _coded(folder: Path) -> BoardCapture:
    rig = rasters_of(folder)
    recorded = read_capture(folder).scan
    scan, _ = replay(folder, method=None if recorded else "both", rig=rig)
    if scan.correspondence.v_px is None:
        method = recorded.method if recorded else "both"
        raise InputError(
            f"{folder}: its strategy '{method}' codes columns alone, and rows are not known before the rig;"
            " capture boards with the strategy 'both'"
        )
    sizes = [(view.width, view.height) for view in (rig.camera, rig.projector)]
    return BoardCapture(scan.white, scan.correspondence, sizes[0], sizes[1])
