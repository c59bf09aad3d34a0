"""Camera and projector as calibrated devices: where a pixel looks, and where a point is seen.

Conventions are OpenCV's: right-handed frames, +x right, +y down, +z forward, integer coordinates at pixel
centres, distortion coefficients ``k1, k2, p1, p2, k3``. All lengths are millimetres.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Floats, freeze
from burrscan.errors import NoLensError

NO_DISTORTION = (0.0, 0.0, 0.0, 0.0, 0.0)
"""k1, k2, p1, p2, k3 of a lens that does not distort (OpenCV's order)."""
UNDISTORT_STEPS = 12
"""Fixed-point steps: each shrinks the error by about 3 |k1| r², to 1e-9 where that is below a sixth."""
_LOOKED_AT = 9
"""Places along each side of a raster where a new lens is tried; bending is strongest in the corners."""
_ASTRAY_PX = 0.5
"""A pixel whose ray leads that far from it has none: no lens folds its picture over."""


@dataclass(frozen=True)
class View:
    """A camera or a projector: a pinhole with a distorting lens (Brown 1966, as OpenCV writes it).

    Parameters
    ----------
    width, height
        Size in pixels.
    fx, fy, cx, cy
        Focal lengths and principal point, pixels; ``cx = (width - 1) / 2`` is the middle of the sensor.
    distortion
        ``k1, k2, p1, p2, k3``.

    Raises
    ------
    NoLensError
        For coefficients that leave some pixels without a ray, as no lens does.

    """

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = NO_DISTORTION

    def __post_init__(self) -> None:
        if self.distortion == NO_DISTORTION:
            return
        sides = (np.linspace(0.0, side - 1.0, _LOOKED_AT) for side in (self.width, self.height))
        pixels = np.stack(np.meshgrid(*sides), axis=-1)
        with np.errstate(over="ignore", invalid="ignore"):
            astray = np.abs(self.project(self.rays(pixels)) - pixels).max()
        if not astray < _ASTRAY_PX:
            raise NoLensError(
                f"distortion {', '.join(f'{k:g}' for k in self.distortion)} (k1, k2, p1, p2, k3, as OpenCV "
                f"writes them) is no lens of {self.width}×{self.height} px: some pixels would look nowhere"
            )

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns of its images."""
        return self.height, self.width

    @property
    def matrix(self) -> Floats:
        """The 3×3 intrinsic matrix."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def distort(self, xy: Floats) -> Floats:
        """Ideal to distorted normalised coordinates, shape (..., 2). O(n)."""
        if self.distortion == NO_DISTORTION:
            return xy
        k1, k2, p1, p2, k3 = self.distortion
        x, y = xy[..., 0], xy[..., 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        return np.stack(
            [
                x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ],
            axis=-1,
        )

    def undistort(self, xy: Floats) -> Floats:
        """Distorted to ideal normalised coordinates, shape (..., 2), by fixed-point iteration. O(n)."""
        if self.distortion == NO_DISTORTION:
            return xy
        ideal = xy
        for _ in range(UNDISTORT_STEPS):
            ideal = ideal - (self.distort(ideal) - xy)
        return ideal

    def straight(self, pixels: Floats) -> Floats:
        """Pixel coordinates (..., 2) as they were if the lens did not distort."""
        return self.undistort((pixels - (self.cx, self.cy)) / (self.fx, self.fy)) * (self.fx, self.fy) + (
            self.cx,
            self.cy,
        )

    def bent(self, pixels: Floats) -> Floats:
        """The inverse of :meth:`straight`."""
        return self.distort((pixels - (self.cx, self.cy)) / (self.fx, self.fy)) * (self.fx, self.fy) + (
            self.cx,
            self.cy,
        )

    def project(self, points_mm: Floats) -> Floats:
        """Pixel coordinates (..., 2) of points (..., 3) in this device's frame; NaN behind it."""
        z = points_mm[..., 2]
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = self.distort(points_mm[..., :2] / np.where(z > 0.0, z, np.nan)[..., None])
        return xy * (self.fx, self.fy) + (self.cx, self.cy)

    def rays(self, pixels: Floats) -> Floats:
        """Directions (..., 3) with z = 1 of pixel coordinates (..., 2), in this device's frame."""
        xy = self.undistort((pixels - (self.cx, self.cy)) / (self.fx, self.fy))
        return np.concatenate([xy, np.ones_like(xy[..., :1])], axis=-1)

    def pixel_grid(self) -> Floats:
        """Coordinates (height, width, 2) of every pixel centre, as (column, row)."""
        columns, rows = np.meshgrid(np.arange(self.width, dtype=float), np.arange(self.height, dtype=float))
        return np.stack([columns, rows], axis=-1)


@dataclass(frozen=True)
class Rig:
    """A calibrated camera and projector pair.

    Parameters
    ----------
    camera, projector
        The two devices.
    T_projector_camera
        4×4 rigid motion that takes camera coordinates (mm) to projector coordinates.

    """

    camera: View
    projector: View
    T_projector_camera: Floats

    def __post_init__(self) -> None:
        freeze(self, T_projector_camera=np.asarray(self.T_projector_camera, dtype=float))

    @property
    def projector_centre_mm(self) -> Floats:
        """The projector's centre of projection in the camera frame, (3,)."""
        return -self.T_projector_camera[:3, :3].T @ self.T_projector_camera[:3, 3]

    def centres_mm(self, T_target_camera: NDArray[np.floating]) -> Floats:
        """(2, 3) centres of camera and projector, in the frame that a (4, 4) pose takes the camera's to."""
        turn, camera = T_target_camera[:3, :3], T_target_camera[:3, 3]
        return np.stack([camera, turn @ self.projector_centre_mm + camera])

    @property
    def baseline_mm(self) -> float:
        """Distance between the two centres of projection."""
        return float(np.linalg.norm(self.projector_centre_mm))

    def to_projector(self, points_mm: Floats) -> Floats:
        """Camera-frame points (..., 3) in the projector frame."""
        return points_mm @ self.T_projector_camera[:3, :3].T + self.T_projector_camera[:3, 3]

    def correspond(self, points_mm: Floats) -> Floats:
        """Projector pixels (..., 2) that light camera-frame points (..., 3)."""
        return self.projector.project(self.to_projector(points_mm))

    def within_light_px(self, points_mm: Floats) -> Floats:
        """How far camera-frame points (..., 3) are within the border of the projector's picture, its pixels.

        Negative beyond it, NaN behind the projector.
        """
        x, y = np.moveaxis(self.correspond(points_mm), -1, 0)
        height, width = self.projector.shape
        off: Floats = np.minimum(np.minimum(x, width - 1.0 - x), np.minimum(y, height - 1.0 - y)) + 0.5
        return off
