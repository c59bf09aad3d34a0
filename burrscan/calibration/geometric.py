"""Camera and projector from captures of a board: closed forms to start, one adjustment of everything."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import cv2
import numpy as np

from burrscan.arrays import Floats, Image, freeze
from burrscan.calibration.adjust import Adjusted, Start, adjust, composed
from burrscan.calibration.board import Board, BoardView, board_view
from burrscan.correspondence import Correspondence
from burrscan.errors import InputError, NoLensError
from burrscan.rig import Rig, View

FEWEST_VIEWS = 3
"""Zhang's closed form has two equations a view and five unknowns of a camera (Zhang 2000)."""
_OPEN = 0.02
"""Relative deviation of a focal length from which on the linear propagation no longer holds."""
_DEVICE = ("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")
_STEREO = ("rx", "ry", "rz", "tx_mm", "ty_mm", "tz_mm")
_FIXED = {
    0: cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    2: cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST,
    4: cv2.CALIB_FIX_K3,
    5: 0,
}
"""How many distortion coefficients are sought, and what OpenCV calls the others."""
_SOUGHT = (4, 2, 0)
"""Where nobody says how many. The sixth power of a normal lens is below the noise, and seeking it spoils the
corners of the field; boards that did not reach those corners leave the fourth power open as well."""


@dataclass(frozen=True)
class Calibration:
    """A calibrated rig and how well it is known.

    Parameters
    ----------
    rig
        The calibration.
    names
        Of the parameters of ``covariance``, such as ``camera.fx``: pixels; ``stereo.r…`` in radians,
        ``stereo.t…_mm``.
    values, covariance
        (p,) and (p, p). The board's own error (flatness, the side of a square) is not in it.
    views
        Names of the captures.
    rms_px
        (views, 2) RMS distance between corner and computed corner in camera and projector.
    corners
        (views,) corners used in both devices.
    sigma_px
        Standard deviation of a corner's coordinate in camera and projector.
    refused
        Corners set aside as outliers.

    """

    rig: Rig
    names: tuple[str, ...]
    values: Floats
    covariance: Floats
    views: tuple[str, ...]
    rms_px: Floats
    corners: tuple[int, ...]
    sigma_px: tuple[float, float]
    refused: int

    def __post_init__(self) -> None:
        freeze(self, values=self.values, covariance=self.covariance, rms_px=self.rms_px)

    @property
    def sigma(self) -> Floats:
        """(p,) standard deviations of the parameters."""
        # Where the views leave a parameter open, rounding can make its variance negative: it is unbounded.
        variance = np.diag(self.covariance)
        return np.where(variance >= 0.0, np.sqrt(np.maximum(variance, 0.0)), np.inf)


def calibrate_captures(
    captures: Sequence[tuple[str, Image, Correspondence]],
    board: Board,
    *,
    camera: tuple[int, int],
    projector: tuple[int, int],
    distortion: int | None = None,
) -> tuple[Calibration, tuple[str, ...]]:
    """Calibrate a rig from captures of a board, twice: the second time the corners know the lenses.

    Parameters
    ----------
    captures
        Name, white picture (h, w) and correspondence with columns and rows, one per pose.
    board
        What they show.
    camera, projector, distortion
        See :func:`calibrate`.

    Returns
    -------
    The calibration, and why captures were left out: one bad one among many is no reason to stop.

    Raises
    ------
    InputError
        As :func:`calibrate`.

    """
    views, usable, left_out = [], [], []
    for name, white, correspondence in captures:
        try:
            views.append(board_view(name, white, correspondence, board))
            usable.append((name, white, correspondence))
        except InputError as error:
            left_out.append(str(error))
    if len(views) < FEWEST_VIEWS:
        raise InputError("\n".join([*(f"left out: {why}" for why in left_out), _too_few(len(views))]))
    fit = partial(calibrate, board=board, camera=camera, projector=projector, distortion=distortion)
    lenses = fit(views).rig
    again = [board_view(*capture, board, lenses=lenses) for capture in usable]
    return fit(again), tuple(left_out)


def _too_few(views: int) -> str:
    return f"{views} view(s) of the board: at least {FEWEST_VIEWS} at different tilts are needed"


def calibrate(
    views: list[BoardView],
    board: Board,
    *,
    camera: tuple[int, int],
    projector: tuple[int, int],
    distortion: int | None = None,
) -> Calibration:
    """Calibrate a rig from views of a board.

    Parameters
    ----------
    views
        At least three poses, tilted by 20 to 45 degrees against each other (Zhang 2000), all over the field.
    board
        What the views show.
    camera, projector
        Width and height of both rasters.
    distortion
        How many of k1, k2, p1, p2, k3 are sought in each device: 0, 2, 4 or 5; the rest are zero. Without it
        four, and fewer where those found would fold a device's picture over.

    Raises
    ------
    InputError
        For too few views, for poses that leave the focal lengths open, and for as many coefficients as
        ``distortion`` says where their lens would fold its picture over.

    """
    if len(views) < FEWEST_VIEWS:
        raise InputError(_too_few(len(views)))
    if distortion not in (None, *_FIXED):
        raise InputError(f"distortion of {distortion} coefficients: known are {', '.join(map(str, _FIXED))}")
    folds = None
    for sought in _SOUGHT if distortion is None else (distortion,):
        try:
            return _calibrated(views, board, camera, projector, sought)
        except NoLensError as error:
            folds = error
    raise InputError(f"{folds}; add views that reach the picture's corners, or seek fewer coefficients")


def _calibrated(
    views: list[BoardView], board: Board, camera: tuple[int, int], projector: tuple[int, int], distortion: int
) -> Calibration:
    start = _start(views, board, camera, projector, distortion)
    found = adjust(views, board, start)
    names = tuple(
        f"{device}.{name}" for device in ("camera", "projector") for name in _DEVICE[: 4 + distortion]
    ) + tuple(f"stereo.{name}" for name in _STEREO)
    calibration = Calibration(
        rig=_rig(found, camera, projector),
        names=names,
        values=np.concatenate([found.camera, found.projector, found.stereo]),
        covariance=found.covariance,
        views=tuple(view.name for view in views),
        rms_px=np.sqrt(np.nanmean((found.residuals_px**2).sum(axis=-1), axis=-1)),
        corners=tuple(int(n) for n in np.isfinite(found.residuals_px[:, :, :, 0]).all(axis=1).sum(axis=-1)),
        sigma_px=found.sigma_px,
        refused=found.refused,
    )
    _refuse_open(calibration)
    return calibration


def _start(
    views: list[BoardView], board: Board, camera: tuple[int, int], projector: tuple[int, int], distortion: int
) -> Start:
    points = board.points_mm.astype(np.float32)
    everywhere = np.ones(len(points), bool)
    c, boards = _device([(points, v.camera_px, everywhere) for v in views], camera, distortion)
    p, lit = _device([(points, v.projector_px, v.known) for v in views], projector, distortion)
    return Start(c, p, _between(boards, lit), boards)


def _device(
    seen: list[tuple[Any, Floats, Any]], size: tuple[int, int], distortion: int
) -> tuple[Floats, Floats]:
    """One device by itself (Zhang 2000): its parameters, and the board's pose (6,) in each view."""
    points = [np.ascontiguousarray(p[known]) for p, _, known in seen]
    pixels = [np.ascontiguousarray(px[known], dtype=np.float32) for _, px, known in seen]
    flags = _FIXED[distortion]
    try:
        _, matrix, k, r, t = cv2.calibrateCamera(points, pixels, size, None, None, flags=flags)
    except cv2.error as error:
        raise InputError(
            f"the views do not determine a device (OpenCV: {error.err}); are the boards tilted differently, "
            "and do at least four corners decode in each?"
        ) from error
    device = np.array([matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *np.ravel(k)[:distortion]])
    return device, np.hstack([np.reshape(r, (-1, 3)), np.reshape(t, (-1, 3))])


def _between(camera: Floats, projector: Floats) -> Floats:
    """The median of the motions (6,) from camera to projector that the views' two board poses give."""
    motions = []
    for c, p in zip(camera, projector, strict=True):
        back = -cv2.Rodrigues(c[:3])[0].T @ c[3:]
        motions.append(composed(np.concatenate([-c[:3], back]), p)[0])
    return np.asarray(np.median(motions, axis=0))


def _rig(found: Adjusted, camera: tuple[int, int], projector: tuple[int, int]) -> Rig:
    pose = np.eye(4)
    pose[:3, :3] = cv2.Rodrigues(np.ascontiguousarray(found.stereo[:3]))[0]
    pose[:3, 3] = found.stereo[3:]
    return Rig(_view(found.camera, camera), _view(found.projector, projector), pose)


def _view(device: Floats, size: tuple[int, int]) -> View:
    fx, fy, cx, cy, *given = (float(value) for value in device)
    k1, k2, p1, p2, k3 = (*given, 0.0, 0.0, 0.0, 0.0, 0.0)[:5]
    return View(size[0], size[1], fx, fy, cx, cy, (k1, k2, p1, p2, k3))


def _refuse_open(calibration: Calibration) -> None:
    share = calibration.sigma / np.maximum(np.abs(calibration.values), 1e-12)
    for name, part in zip(calibration.names, share, strict=True):
        if name.endswith((".fx", ".fy")) and not part < _OPEN:
            raise InputError(
                f"{name} is known to {100.0 * part:.1g} % only: add views with the board tilted by 20 to 45 "
                "degrees, about different axes"
            )
