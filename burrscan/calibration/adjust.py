"""Bundle adjustment of a camera, a projector and board poses, with the covariance of what it finds.

Both devices are cameras to it: the projector is an inverse one whose corners the code carried over (Zhang &
Huang 2006; Moreno & Taubin 2012). Derivatives are OpenCV's analytic ones, chained.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import cv2
import numpy as np
from scipy.optimize import least_squares

from burrscan.arrays import Bools, Floats, freeze
from burrscan.calibration.board import Board, BoardView

_POSE = 6
"""Unknowns of a rigid motion: a rotation vector and a translation."""
_WEIGHT_STEPS = 3
"""Estimates of both devices' noise before outliers go; the variance components settle within two or three."""
_OUTLIER_Z = 5.0
"""Chance alone takes 6e-7 of all coordinates off; a corner that is really wrong is tens of sigma out."""
_MOST_STEPS = 60
"""Ten are enough from the closed forms; views that leave parameters open would take thousands."""


class Start(NamedTuple):
    """Where to start: devices (4 + distortion,), the pose between them (6,), board poses (views, 6)."""

    camera: Floats
    projector: Floats
    stereo: Floats
    boards: Floats


@dataclass(frozen=True)
class Adjusted:
    """What the adjustment found.

    Parameters
    ----------
    camera, projector
        (4 + distortion,) fx, fy, cx, cy and the distortion coefficients.
    stereo
        (6,) rotation vector and translation (mm) of camera to projector.
    covariance
        Of camera, projector and stereo, in that order.
    residuals_px
        (views, 2 devices, corners, 2) observed less computed, NaN where unknown or refused.
    sigma_px
        Standard deviation of a corner's coordinate in camera and projector, from the residuals.
    refused
        Corners set aside as outliers.

    """

    camera: Floats
    projector: Floats
    stereo: Floats
    covariance: Floats
    residuals_px: Floats
    sigma_px: tuple[float, float]
    refused: int

    def __post_init__(self) -> None:
        freeze(self, camera=self.camera, projector=self.projector, stereo=self.stereo)
        freeze(self, covariance=self.covariance, residuals_px=self.residuals_px)


def adjust(views: list[BoardView], board: Board, start: Start) -> Adjusted:
    """Minimise the weighted squares of all corners' residuals.

    A projector's corner that the code carried over has the camera corner's error in it: that part of its
    residual is taken off (``slope``), what is left is its own. Camera and projector corners have weights of
    their own, from their residuals (variance components, Helmert 1907); corners off by more than five
    standard deviations are set aside. Dense normal equations: O((devices + views)² · corners · views).
    """
    observed = np.stack([np.stack([v.camera_px, v.projector_px]) for v in views])
    slope = np.stack([np.zeros((len(v.camera_px), 2, 2)) if v.slope is None else v.slope for v in views])
    used: Bools = np.asarray(np.isfinite(observed).all(axis=-1))
    x = np.concatenate([part.ravel() for part in start])
    sigma = np.ones(2)
    for step in range(_WEIGHT_STEPS + 1):
        residual, jacobian, x = _solved(x, observed, slope, used, sigma, start, board.points_mm)
        scale, inverse = _variances(residual, jacobian, used)
        sigma = sigma * scale
        if step == _WEIGHT_STEPS - 1:
            used = used & ~_outliers(residual, used, scale)
    devices = len(start.camera) + len(start.projector) + _POSE
    off = np.full(observed.shape, np.nan)
    off[used] = residual.reshape(-1, 2)
    off *= (sigma / scale)[None, :, None, None]
    camera, projector, stereo = np.split(x[:devices], [len(start.camera), devices - _POSE])
    return Adjusted(
        camera,
        projector,
        stereo,
        covariance=inverse[:devices, :devices] * float(np.mean(scale**2)),
        residuals_px=off,
        sigma_px=(float(sigma[0]), float(sigma[1])),
        refused=int(np.isfinite(observed).all(axis=-1).sum() - used.sum()),
    )


def _solved(
    x: Floats, observed: Floats, slope: Floats, used: Bools, sigma: Floats, start: Start, points: Floats
) -> tuple[Floats, Floats, Floats]:
    """Weighted residuals (used corners × 2), their Jacobian, and the parameters, at the minimum."""
    weight = np.broadcast_to((1.0 / sigma)[None, :, None, None], observed.shape)[used].ravel()

    def residual(p: Floats) -> Floats:
        off = observed - _seen(p, start, points)[0]
        off[:, 1] -= np.einsum("vnij,vnj->vni", slope, off[:, 0])
        return off[used].ravel() * weight

    def jacobian(p: Floats) -> Floats:
        by = -_seen(p, start, points)[1]
        by[:, 1] -= slope @ by[:, 0]
        return by[used].reshape(-1, len(p)) * weight[:, None]

    found = least_squares(
        residual, x, jac=jacobian, method="lm", x_scale="jac", xtol=1e-12, ftol=1e-12, max_nfev=_MOST_STEPS
    )
    return residual(found.x), jacobian(found.x), found.x


def _seen(p: Floats, start: Start, points: Floats) -> tuple[Floats, Floats]:
    """Computed corners (views, 2, corners, 2) and their derivatives (views, 2, corners, 2, parameters)."""
    nc, np_ = len(start.camera), len(start.projector)
    camera, projector, stereo, boards = np.split(p, np.cumsum([nc, np_, _POSE]))
    views = len(start.boards)
    pixels = np.empty((views, 2, len(points), 2))
    slopes = np.zeros((views, 2, len(points), 2, len(p)))
    for i, board in enumerate(boards.reshape(views, _POSE)):
        own = slice(nc + np_ + _POSE * (i + 1), nc + np_ + _POSE * (i + 2))
        pixels[i, 0], by_pose, by_device = _projected(points, board, camera)
        slopes[i, 0, :, :, own], slopes[i, 0, :, :, :nc] = by_pose, by_device
        pose, by_board, by_stereo = composed(board, stereo)
        pixels[i, 1], by_pose, by_device = _projected(points, pose, projector)
        slopes[i, 1, :, :, nc : nc + np_] = by_device
        slopes[i, 1, :, :, own] = by_pose @ by_board
        slopes[i, 1, :, :, nc + np_ : nc + np_ + _POSE] = by_pose @ by_stereo
    return pixels, slopes


def _projected(points: Floats, pose: Floats, device: Floats) -> tuple[Floats, Floats, Floats]:
    """Pixels (n, 2), derivatives by the pose (n, 2, 6) and by the device (n, 2, 4 + distortion)."""
    fx, fy, cx, cy = device[:4]
    matrix = np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    distortion = np.zeros(5)
    distortion[: len(device) - 4] = device[4:]
    pixels, slopes = cv2.projectPoints(points, pose[:3], pose[3:], matrix, distortion)[:2]
    by = np.asarray(slopes).reshape(len(points), 2, -1)
    return np.asarray(pixels).reshape(-1, 2), by[..., :_POSE], by[..., _POSE : _POSE + len(device)]


def composed(first: Floats, second: Floats) -> tuple[Floats, Floats, Floats]:
    """Motion ``first`` and then ``second`` (6,), and its derivatives (6, 6) by both."""
    parts = (part.reshape(3, 1) for part in (first[:3], first[3:], second[:3], second[3:]))
    r, t, *by = cv2.composeRT(*parts)
    rr1, rt1, rr2, rt2, tr1, tt1, tr2, tt2 = (np.asarray(b) for b in by)
    by_first = np.block([[rr1, rt1], [tr1, tt1]])
    by_second = np.block([[rr2, rt2], [tr2, tt2]])
    return np.concatenate([np.ravel(r), np.ravel(t)]), by_first, by_second


def _variances(residual: Floats, jacobian: Floats, used: Bools) -> tuple[Floats, Floats]:
    """Factor on each device's sigma by its residuals and their redundancy; and the inverse normal matrix."""
    unit = np.sqrt((jacobian**2).sum(axis=0))  # focal lengths and distortions differ by powers of ten
    scaled = jacobian / unit
    inverse = np.linalg.inv(scaled.T @ scaled)
    redundancy = 1.0 - ((scaled @ inverse) * scaled).sum(axis=1)
    device = np.broadcast_to(np.arange(2)[None, :, None, None], (*used.shape, 2))[used].ravel()
    squares = np.bincount(device, residual**2, 2) / np.maximum(np.bincount(device, redundancy, 2), 1.0)
    return np.sqrt(np.maximum(squares, 1e-12)), inverse / np.outer(unit, unit)


def _outliers(residual: Floats, used: Bools, scale: Floats) -> Bools:
    off = np.zeros((*used.shape, 2))
    off[used] = residual.reshape(-1, 2)
    return np.asarray((np.abs(off) > _OUTLIER_Z * scale[None, :, None, None]).any(axis=-1))
