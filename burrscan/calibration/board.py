"""Chessboards: what they are, and where the camera and the projector see their corners."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from burrscan.arrays import Bools, Floats, Image, freeze
from burrscan.calibration.corners import refined
from burrscan.correspondence import Correspondence
from burrscan.errors import InputError
from burrscan.rig import Rig, View

_LEAST_PIXELS = 40
"""Decoded around a corner: eight unknowns of a homography from 80 coordinates, with outliers among them."""
_STEPS = 3
"""Reweightings by depth and by outliers; the first, affine, start is off only by the perspective of one
window."""
_OUTLIER_Z = 4.0
"""In median distances: of normal errors in the plane, whose distances are Rayleigh's, 1.5e-5 are beyond."""


@dataclass(frozen=True)
class Board:
    """A flat chessboard.

    Parameters
    ----------
    columns, rows
        Inner corners, as OpenCV counts them: a board of 11 × 8 squares has 10 × 7.
    square_mm
        Side of a square. It sets the scale of the whole calibration: measure it over many squares.

    """

    columns: int
    rows: int
    square_mm: float

    @property
    def points_mm(self) -> Floats:
        """(corners, 3) the corners in the board's frame, row by row; z = 0."""
        y, x = np.mgrid[: self.rows, : self.columns]
        return np.stack([x.ravel(), y.ravel(), 0.0 * x.ravel()], axis=-1) * self.square_mm


@dataclass(frozen=True)
class BoardView:
    """One pose of a board as both devices see it.

    Parameters
    ----------
    name
        Of the capture.
    camera_px
        (corners, 2) in the camera's image.
    projector_px
        (corners, 2) in the projector's, NaN where too little decodes around a corner.
    slope
        (corners, 2, 2) how ``projector_px`` moves with ``camera_px``: where the code carried a corner over,
        the error of the camera's corner went with it. None for corners measured apart.

    """

    name: str
    camera_px: Floats
    projector_px: Floats
    slope: Floats | None = None

    def __post_init__(self) -> None:
        freeze(self, camera_px=self.camera_px, projector_px=self.projector_px, slope=self.slope)

    @property
    def known(self) -> Bools:
        """(corners,) True where the projector's corner is known."""
        return np.asarray(np.isfinite(self.projector_px).all(axis=-1))


def board_view(
    name: str, white: Image, correspondence: Correspondence, board: Board, *, lenses: Rig | None = None
) -> BoardView:
    """Corners of a board in a capture: found in the white picture, carried over by the code.

    Parameters
    ----------
    name
        Of the capture.
    white
        (h, w) DN.
    correspondence
        Columns and rows of the projector per camera pixel.
    board
        What is shown.
    lenses
        A first calibration. Edges are straight, and a plane's homography is exact, only without distortion:
        with a camera's lens known, corners are some thousandths of a pixel better.

    Raises
    ------
    InputError
        When the board is not found, or no corner can be carried over.

    """
    corners = find_corners(white, board, lens=None if lenses is None else lenses.camera)
    if corners is None:
        raise InputError(
            f"{name}: no board of {board.columns}×{board.rows} inner corners in the white picture; count the "
            "corners where four squares meet, and let the whole board be in sight and evenly lit"
        )
    view = BoardView(name, corners, *projector_corners(corners, correspondence, board, lenses=lenses))
    if not view.known.any():
        raise InputError(f"{name}: the board is found, but no code decodes around its corners")
    return view


def find_corners(white: Image, board: Board, *, lens: View | None = None) -> Floats | None:
    """(corners, 2) corners of a board in a picture (h, w) DN, or None where it is not found whole.

    Found by OpenCV's ``findChessboardCornersSB`` (Duda & Frese 2018), refined by
    :func:`burrscan.calibration.corners.refined`.
    """
    bright = max(float(np.quantile(white, 0.999)), 1.0)
    grey = np.clip(white * (255.0 / bright), 0.0, 255.0).astype(np.uint8)
    flags = cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
    found, corners = cv2.findChessboardCornersSB(grey, (board.columns, board.rows), flags=flags)
    if not found:
        return None
    return refined(white, np.asarray(corners, dtype=float).reshape(-1, 2), rows=board.rows, lens=lens)


def projector_corners(
    corners: Floats, correspondence: Correspondence, board: Board, *, lenses: Rig | None = None
) -> tuple[Floats, Floats]:
    """Corners in the projector's image, by a homography around each (Moreno & Taubin 2012).

    Parameters
    ----------
    corners
        (corners, 2) in the camera's image.
    correspondence
        Columns and rows of the projector per camera pixel.
    board
        Its raster gives the size of the neighbourhoods: half the way to the nearest corners.
    lenses
        Both devices' distortions, as far as known.

    Returns
    -------
    (corners, 2), and (corners, 2, 2) derivatives by the camera's; NaN where fewer than 40 pixels decode.
    O(pixels).

    """
    grid = corners.reshape(board.rows, board.columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=-1).ravel() for axis in (0, 1)]
    reach = 0.5 * float(np.min(np.concatenate(steps)))
    carried = np.stack([_carried(corner, correspondence, reach, lenses) for corner in corners])
    return carried[:, :, 0], carried[:, :, 1:]


def _carried(corner: Floats, correspondence: Correspondence, reach: float, lenses: Rig | None) -> Floats:
    """(2, 3) the corner in the projector, and its derivative by the corner in the camera."""
    height, width = correspondence.mask.shape
    low = np.maximum(np.ceil(corner - reach), 0).astype(int)
    high = np.minimum(np.floor(corner + reach) + 1, (width, height)).astype(int)
    window = slice(low[1], high[1]), slice(low[0], high[0])
    rows, columns = np.nonzero(correspondence.mask[window])
    if len(rows) < _LEAST_PIXELS or correspondence.v_px is None:
        return np.full((2, 3), np.nan)
    at = np.stack([columns + low[0], rows + low[1]], axis=-1).astype(float)
    seen = np.stack([correspondence.u_px[window], correspondence.v_px[window]], axis=-1)
    lit = seen[rows, columns].astype(float)
    if lenses is None:
        return _homography_at_origin((at - corner) / reach, lit) / (1.0, reach, reach)
    camera, projector = lenses.camera, lenses.projector
    middle = camera.straight(corner)
    offset = (camera.straight(at) - middle) / reach
    found = _homography_at_origin(offset, projector.straight(lit)) / (1.0, reach, reach)

    def moved(step: Floats) -> Floats:
        return projector.bent(found[:, 0] + found[:, 1:] @ (camera.straight(corner + step) - middle))

    across, down = (moved(step) - moved(-step) for step in 0.5 * np.eye(2))
    return np.stack([moved(np.zeros(2)), across, down], axis=-1)


def _homography_at_origin(xy: Floats, uv: Floats) -> Floats:
    """(2, 3) image of the origin, and slope there, of the homography that best takes ``xy`` to ``uv`` (n, 2).

    ``uv = (A xy + b) / (1 + c·xy)``: linear in (A, b, c) after multiplying out; dividing the equations by
    the last denominator makes the residuals those of ``uv``. Pixels that decode wrongly drop out.
    """
    centre = uv.mean(axis=0)
    d = uv - centre
    ones, zeros = np.ones((len(xy), 1)), np.zeros((len(xy), 3))
    affine = np.hstack([xy, ones])
    for_u = np.hstack([affine, zeros, -xy * d[:, :1]])
    for_v = np.hstack([zeros, affine, -xy * d[:, 1:]])
    depth, keep = np.ones(len(xy)), np.ones(len(xy), bool)
    h = np.zeros(8)
    for _ in range(_STEPS):
        w = (keep / depth)[:, None]
        system = np.vstack([for_u * w, for_v * w])
        wanted = (d * w).T.ravel()
        h = np.linalg.solve(system.T @ system, system.T @ wanted)
        depth = 1.0 + xy @ h[6:]
        off = np.stack([affine @ h[:3], affine @ h[3:6]], axis=-1) / depth[:, None] - d
        size = np.hypot(off[:, 0], off[:, 1])
        keep = size <= _OUTLIER_Z * np.median(size) + 1e-9
    a, b = np.stack([h[0:2], h[3:5]]), h[[2, 5]]
    return np.column_stack([centre + b, a - np.outer(b, h[6:])])
