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
    rays = camera_rays(rig.camera)
    depth, rate = depth_along(rays, correspondence.u_px.astype(float), correspondence.mask, rig)
    length = np.sqrt(np.einsum("...i,...i->...", rays, rays))
    sigma = np.abs(rate) * correspondence.sigma_u_px * length
    return rays * depth[..., None], sigma.astype(np.float32)


@lru_cache(maxsize=4)
def camera_rays(view: View) -> Floats:
    """(h, w, 3) rays with z = 1 through a device's pixel centres, read-only; remembered per device."""
    rays = view.rays(view.pixel_grid())
    rays.flags.writeable = False
    return rays


def depth_along(rays: Floats, u_px: Floats, mask: Bools, rig: Rig) -> tuple[Floats, Floats]:
    """Depth z (mm) at which ``rays`` (h, w, 3) meet columns (h, w), and dz/du (mm per px); NaN elsewhere."""
    projector = rig.projector
    intrinsics = np.array([projector.fx, projector.cx, *projector.distortion])
    pose = np.ascontiguousarray(rig.T_projector_camera)
    depth, rate = _depths(rays, u_px, mask, pose, intrinsics)
    return depth, rate


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
    rays = camera_rays(rig.camera)[rows]
    depth, _ = depth_along(rays, np.asarray(u_px, dtype=float), np.isfinite(u_px), rig)
    v: Floats = rig.correspond(rays * depth[..., None])[..., 1]
    return v


@njit(cache=True, inline="always")
def _column(a: Floats, t: Floats, z: float, k: Floats) -> tuple[float, float]:
    """The column of the point at depth z on a ray (a = R ray, t = translation) and its derivative by z."""
    px, py, pz = a[0] * z + t[0], a[1] * z + t[1], a[2] * z + t[2]
    if pz <= 0.0:
        return np.nan, np.nan
    x, y = px / pz, py / pz
    dx, dy = (a[0] - x * a[2]) / pz, (a[1] - y * a[2]) / pz
    r2 = x * x + y * y
    dr2 = 2.0 * (x * dx + y * dy)
    radial = 1.0 + r2 * (k[2] + r2 * (k[3] + r2 * k[6]))
    dradial = dr2 * (k[2] + r2 * (2.0 * k[3] + r2 * 3.0 * k[6]))
    u = x * radial + 2.0 * k[4] * x * y + k[5] * (r2 + 2.0 * x * x)
    du = dx * radial + x * dradial + 2.0 * k[4] * (dx * y + x * dy) + k[5] * (dr2 + 4.0 * x * dx)
    return k[0] * u + k[1], k[0] * du


@njit(cache=True, parallel=True, nogil=True)
def _depths(rays: Floats, u_px: Floats, mask: Bools, pose: Floats, k: Floats) -> tuple[Floats, Floats]:
    height, width = u_px.shape
    depth = np.full((height, width), np.nan)
    rate = np.full((height, width), np.nan)
    t = pose[:3, 3].copy()
    for r in prange(height):
        a = np.empty(3)
        for c in range(width):
            if not mask[r, c]:
                continue
            for i in range(3):
                a[i] = pose[i, 0] * rays[r, c, 0] + pose[i, 1] * rays[r, c, 1] + pose[i, 2] * rays[r, c, 2]
            # the plane of the undistorted column is exact without distortion and a good start with it
            x = (u_px[r, c] - k[1]) / k[0]
            z = (t[0] - x * t[2]) / (x * a[2] - a[0])
            for _ in range(_NEWTON_STEPS):
                u, du = _column(a, t, z, k)
                step = (u_px[r, c] - u) / du
                z += step
                if not abs(step) > 1e-9 * abs(z):
                    break
            _, du = _column(a, t, z, k)
            if z > 0.0 and np.isfinite(du):
                depth[r, c] = z
                rate[r, c] = 1.0 / du
    return depth, rate
