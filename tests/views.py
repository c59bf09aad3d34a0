"""What a depth camera sees of a mesh, for the tests of the geometry half."""

from __future__ import annotations

import numba
import numpy as np

from burrscan.arrays import Floats, Ints32


@numba.njit(cache=True)  # type: ignore[untyped-decorator]
def _raster(triangles: Floats, pixels: int, low: Floats, step: float) -> Floats:
    depth = np.full((pixels, pixels), np.inf)
    for t in range(triangles.shape[0]):
        ax, ay, az = (
            (triangles[t, 0, 0] - low[0]) / step,
            (triangles[t, 0, 1] - low[1]) / step,
            triangles[t, 0, 2],
        )
        bx, by, bz = (
            (triangles[t, 1, 0] - low[0]) / step,
            (triangles[t, 1, 1] - low[1]) / step,
            triangles[t, 1, 2],
        )
        cx, cy, cz = (
            (triangles[t, 2, 0] - low[0]) / step,
            (triangles[t, 2, 1] - low[1]) / step,
            triangles[t, 2, 2],
        )
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        for i in range(
            max(0, int(np.ceil(min(ax, bx, cx)))), min(pixels - 1, int(np.floor(max(ax, bx, cx)))) + 1
        ):
            for j in range(
                max(0, int(np.ceil(min(ay, by, cy)))), min(pixels - 1, int(np.floor(max(ay, by, cy)))) + 1
            ):
                u = ((bx - i) * (cy - j) - (by - j) * (cx - i)) / area
                v = ((cx - i) * (ay - j) - (cy - j) * (ax - i)) / area
                if u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                    z = u * az + v * bz + (1.0 - u - v) * cz
                    depth[i, j] = min(depth[i, j], z)
    return depth


def single_view(
    vertices: Floats,
    faces: Ints32,
    view: Floats,
    *,
    pixels: int = 300,
    sigma: float = 0.0,
    seed: int = 0,
) -> tuple[Floats, Ints32]:
    """What an orthographic depth camera looking along ``view`` sees of a mesh: vertices and faces.

    No face spans a step in depth of more than four pixels. Noise is along the viewing ray.
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
    noisy = depth + sigma * rng.normal(size=depth.shape)
    i, j = np.nonzero(seen)
    points = np.stack([low[0] + i * step, low[1] + j * step, noisy[seen]], axis=1) @ axes
    return points, _view_faces(depth, seen, 4.0 * step)


def _view_faces(depth: Floats, seen: np.ndarray[tuple[int, ...], np.dtype[np.bool_]], jump: float) -> Ints32:
    index = np.full(depth.shape, -1, dtype=np.int32)
    index[seen] = np.arange(int(seen.sum()), dtype=np.int32)
    corners = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]], axis=-1)
    level = np.stack([depth[:-1, :-1], depth[:-1, 1:], depth[1:, :-1], depth[1:, 1:]], axis=-1)
    faces = []
    for triple in ([0, 2, 1], [1, 2, 3]):
        whole = np.all(corners[..., triple] >= 0, axis=-1)
        heights = np.where(whole[..., None], level[..., triple], 0.0)
        faces.append(corners[..., triple][whole & (np.ptp(heights, axis=-1) <= jump)])
    return np.concatenate(faces)
