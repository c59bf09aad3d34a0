"""Camera rays cut with the surfaces of light that projector columns make.

Without lens distortion a projector column is a plane and the cut is closed-form; with distortion it is a
curved surface, and Newton's method along the ray finds the depth at which the rig puts the point on the
column (both devices as in :mod:`burrscan.rig`).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32
from burrscan.correspondence import Correspondence
from burrscan.rig import Rig, View

_NEWTON_STEPS = 10
"""Bounds the search of the depth; digits double with each step, so that three or four do."""
_CONVERGED = 1e-9
"""Relative step of the depth: a micrometre over a kilometre, far below any noise."""


def triangulate(correspondence: Correspondence, rig: Rig) -> tuple[Floats, Floats32]:
    """Points of the accepted pixels, and their uncertainty.

    Parameters
    ----------
    correspondence
        Projector columns per camera pixel; rows are not used.
    rig
        The calibration.

    Returns
    -------
    points_mm
        (h, w, 3) in the camera frame, NaN where masked or where the column meets the ray nowhere in front of
        both devices.
    sigma_mm
        (h, w) standard deviation along the camera ray, by the column's sigma and the local rate of depth.

    Notes
    -----
    O(pixels): three Newton steps as a rule.

    """
    points, sigma = _points(
        camera_rays(rig.camera),
        correspondence.u_px,
        correspondence.sigma_u_px,
        correspondence.mask,
        np.ascontiguousarray(rig.T_projector_camera),
        _intrinsics(rig.projector),
    )
    return points, sigma


@lru_cache(maxsize=4)
def camera_rays(view: View) -> Floats:
    """(h, w, 3) rays with z = 1 through a device's pixel centres, read-only; remembered per device."""
    rays = view.rays(view.pixel_grid())
    rays.flags.writeable = False
    return rays


def _intrinsics(view: View) -> Floats:
    """What the kernels need of a projector: fx, cx, k1, k2, p1, p2, k3, fy, cy."""
    return np.array([view.fx, view.cx, *view.distortion, view.fy, view.cy])


def epipolar_v(u_px: Floats | Floats32, rig: Rig, *, rows: slice = slice(None)) -> Floats:
    """Projector rows (h, w) that follow from columns by the rig: where on the column each ray's point lies.

    Parameters
    ----------
    u_px
        (h, w) columns, NaN where unknown.
    rig
        The calibration.
    rows
        The camera rows that ``u_px`` covers.

    """
    pose = np.ascontiguousarray(rig.T_projector_camera)
    v: Floats = _rows(camera_rays(rig.camera)[rows], u_px, pose, _intrinsics(rig.projector))
    return v


@njit(cache=True, nogil=True, inline="always")
def _column(
    ax: float, ay: float, az: float, t: Floats, z: float, k: Floats
) -> tuple[float, float, float, float]:
    """The column of the point at depth z on a ray (a = R ray, t = translation), its derivative by z, x, y."""
    px, py, pz = ax * z + t[0], ay * z + t[1], az * z + t[2]
    if pz <= 0.0:
        return np.nan, np.nan, np.nan, np.nan
    x, y = px / pz, py / pz
    dx, dy = (ax - x * az) / pz, (ay - y * az) / pz
    r2 = x * x + y * y
    dr2 = 2.0 * (x * dx + y * dy)
    radial = 1.0 + r2 * (k[2] + r2 * (k[3] + r2 * k[6]))
    dradial = dr2 * (k[2] + r2 * (2.0 * k[3] + r2 * 3.0 * k[6]))
    u = x * radial + 2.0 * k[4] * x * y + k[5] * (r2 + 2.0 * x * x)
    du = dx * radial + x * dradial + 2.0 * k[4] * (dx * y + x * dy) + k[5] * (dr2 + 4.0 * x * dx)
    return k[0] * u + k[1], k[0] * du, x, y


@njit(cache=True, nogil=True, error_model="numpy")
def _cut(ray: Floats, u: float, pose: Floats, t: Floats, k: Floats) -> tuple[float, float, float, float]:
    """Depth at which a ray meets column ``u``, du/dz there, and x, y in the projector; NaN where nowhere."""
    ax = pose[0, 0] * ray[0] + pose[0, 1] * ray[1] + pose[0, 2] * ray[2]
    ay = pose[1, 0] * ray[0] + pose[1, 1] * ray[1] + pose[1, 2] * ray[2]
    az = pose[2, 0] * ray[0] + pose[2, 1] * ray[1] + pose[2, 2] * ray[2]
    # the plane of the undistorted column is exact without distortion and a good start with it
    start = (u - k[1]) / k[0]
    z = (t[0] - start * t[2]) / (start * az - ax)
    du, x, y = np.nan, np.nan, np.nan
    for _ in range(_NEWTON_STEPS):
        found, du, x, y = _column(ax, ay, az, t, z, k)
        step = (u - found) / du
        z += step
        if not abs(step) > _CONVERGED * abs(z):
            break
    if z > 0.0 and np.isfinite(du):
        return z, du, x, y
    return np.nan, np.nan, np.nan, np.nan


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def _points(
    rays: Floats, u_px: Floats32, sigma_px: Floats32, mask: Bools, pose: Floats, k: Floats
) -> tuple[Floats, Floats32]:
    height, width = u_px.shape
    points = np.empty((height, width, 3))
    sigma = np.empty((height, width), np.float32)
    t = pose[:3, 3].copy()
    for r in prange(height):
        for c in range(width):
            z, du = np.nan, np.nan
            if mask[r, c]:
                z, du, _, _ = _cut(rays[r, c], u_px[r, c], pose, t, k)
            square = 0.0
            for i in range(3):
                points[r, c, i] = rays[r, c, i] * z
                square += rays[r, c, i] ** 2
            sigma[r, c] = sigma_px[r, c] * np.sqrt(square) / abs(du)
    return points, sigma


@njit(cache=True, parallel=True, nogil=True, error_model="numpy")
def _rows(rays: Floats, u_px: Floats | Floats32, pose: Floats, k: Floats) -> Floats:
    height, width = u_px.shape
    v_px = np.empty((height, width))
    t = pose[:3, 3].copy()
    for r in prange(height):
        for c in range(width):
            v_px[r, c] = np.nan
            if np.isfinite(u_px[r, c]):
                _, _, x, y = _cut(rays[r, c], u_px[r, c], pose, t, k)
                r2 = x * x + y * y
                radial = 1.0 + r2 * (k[2] + r2 * (k[3] + r2 * k[6]))
                v = y * radial + k[4] * (r2 + 2.0 * y * y) + 2.0 * k[5] * x * y
                v_px[r, c] = k[7] * v + k[8]
    return v_px
