"""What an orthographic depth camera sees of a mesh: no rendering, only what is first along each ray."""

from __future__ import annotations

import numba
import numpy as np
from scipy.ndimage import gaussian_filter

from bench.synthetic.revolution import random_pose
from burrscan.arrays import Bools, Floats, Ints32
from burrscan.pose import placed

_PIXELS = 200
"""Across a posed view: some 10,000 to 30,000 vertices, as a small depth camera gives."""
_JUMP = 4.0
"""Step in depth, in pixels, that no face spans."""


def single_view(
    vertices: Floats,
    faces: Ints32,
    view: Floats,
    *,
    pixels: int = 300,
    sigma: float = 0.0,
    reach_px: float = 0.0,
    seed: int | tuple[int, ...] = 0,
) -> tuple[Floats, Ints32]:
    """Vertices (N, 3) and faces (M, 3) of one view, in the frame of the mesh.

    Parameters
    ----------
    vertices, faces
        (V, 3) and (T, 3), any unit.
    view
        (3,) direction in which the camera looks.
    pixels
        Along the longer side of what it sees.
    sigma
        Noise along the rays, in the unit of the vertices.
    reach_px
        Standard deviation of the Gaussian over which the noise is averaged, 1 or more; 0 for noise of each
        pixel's own. Its size is ``sigma`` either way.
    seed
        Of the noise.

    Notes
    -----
    O(T + pixels²). Faces look at the camera; none spans a step in depth of more than four pixels.

    """
    rng = np.random.default_rng(seed)
    ahead = view / np.linalg.norm(view)
    start = np.eye(3)[np.argmin(np.abs(ahead))]
    right = np.cross(start, ahead)
    right /= np.linalg.norm(right)
    axes = np.stack([right, np.cross(ahead, right), ahead])
    turned = vertices @ axes.T
    low, high = turned.min(axis=0), turned.max(axis=0)
    step = float(np.max(high[:2] - low[:2]) / (pixels - 1))
    low = low - 0.37 * step  # keep pixel centres off the mesh's own symmetric coordinates
    depth = _raster(turned[faces], pixels, low, step)
    seen = np.isfinite(depth)
    noisy = depth + sigma * _noise(depth.shape, reach_px, rng)
    i, j = np.nonzero(seen)
    points = np.stack([low[0] + i * step, low[1] + j * step, noisy[seen]], axis=1) @ axes
    return points, _view_faces(depth, seen, _JUMP * step)


def posed_view(
    vertices: Floats,
    faces: Ints32,
    rng: np.random.Generator,
    *,
    sigma: float,
    reach_px: float = 0.0,
    seed: tuple[int, ...],
) -> tuple[Floats, Ints32, Floats]:
    """A view of 200 pixels from a random direction, in a random pose: vertices, faces and the pose (4, 4).

    Noise as :func:`single_view` takes it.
    """
    points, triangles = single_view(
        vertices, faces, rng.normal(size=3), pixels=_PIXELS, sigma=sigma, reach_px=reach_px, seed=seed
    )
    pose = random_pose(rng)
    return placed(pose, points), triangles, pose


def _noise(shape: tuple[int, ...], reach_px: float, rng: np.random.Generator) -> Floats:
    """Noise of standard deviation 1: averaging leaves 1 / (2 √π reach) of it, which is given back."""
    white = rng.normal(size=shape)
    if reach_px == 0.0:
        return white
    return np.asarray(2.0 * np.sqrt(np.pi) * reach_px * gaussian_filter(white, reach_px, mode="wrap"))


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _raster(triangles: Floats, pixels: int, low: Floats, step: float) -> Floats:
    """(pixels, pixels) least depth along each ray, infinite where it meets nothing."""
    depth = np.full((pixels, pixels), np.inf)
    for t in range(triangles.shape[0]):
        x, y, z = (
            (triangles[t, :, 0] - low[0]) / step,
            (triangles[t, :, 1] - low[1]) / step,
            triangles[t, :, 2],
        )
        area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0])
        if area == 0.0:
            continue
        for i in range(max(0, int(np.ceil(x.min()))), min(pixels - 1, int(np.floor(x.max()))) + 1):
            for j in range(max(0, int(np.ceil(y.min()))), min(pixels - 1, int(np.floor(y.max()))) + 1):
                u = ((x[1] - i) * (y[2] - j) - (y[1] - j) * (x[2] - i)) / area
                v = ((x[2] - i) * (y[0] - j) - (y[2] - j) * (x[0] - i)) / area
                if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                    depth[i, j] = min(depth[i, j], u * z[0] + v * z[1] + (1.0 - u - v) * z[2])
    return depth


def _view_faces(depth: Floats, seen: Bools, jump: float) -> Ints32:
    """Two faces for each four pixels that are all seen, without a step in depth."""
    index = np.full(depth.shape, -1, dtype=np.int32)
    index[seen] = np.arange(int(seen.sum()), dtype=np.int32)
    corners = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]], axis=-1)
    level = np.stack([depth[:-1, :-1], depth[:-1, 1:], depth[1:, :-1], depth[1:, 1:]], axis=-1)
    faces = []
    for triple in ([0, 1, 2], [1, 3, 2]):
        whole = np.all(corners[..., triple] >= 0, axis=-1)
        heights = np.where(whole[..., None], level[..., triple], 0.0)
        faces.append(corners[..., triple][whole & (np.ptp(heights, axis=-1) <= jump)])
    return np.concatenate(faces)
