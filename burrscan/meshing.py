"""An organised range image becomes a mesh: neighbours are joined unless the depth between them jumps."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Ints, Ints32
from burrscan.correspondence import Correspondence
from burrscan.rig import Rig
from burrscan.surface import Surface
from burrscan.triangulation import triangulate

_FIT_REACH = 2
_FIT_LEAST = 6


def surface(
    correspondence: Correspondence,
    rig: Rig,
    *,
    grazing_deg: float = 82.0,
    outlier_z: float = 5.0,
    least_pixels: int = 40,
) -> Surface:
    """Triangulate, drop outliers, and mesh.

    Parameters
    ----------
    correspondence
        Projector columns per camera pixel.
    rig
        The calibration.
    grazing_deg
        Neighbouring pixels are joined as long as the surface between them could be seen at up to this angle
        off its normal; a steeper one is a jump in depth. Noise widens the limit by three sigmas.
    outlier_z
        A point is dropped when it is off the plane through its neighbours by more than this many standard
        deviations of point, plane and neighbours' own scatter together.
    least_pixels
        Connected pieces smaller than this are specks and dropped.

    Notes
    -----
    O(pixels). The criteria hold no length: they follow the rig's footprint at the point's depth.

    """
    points, sigma = triangulate(correspondence, rig)
    steep = float(np.tan(np.radians(grazing_deg)))
    pitch = 0.5 * (1.0 / rig.camera.fx + 1.0 / rig.camera.fy)
    depth = np.ascontiguousarray(points[..., 2])
    keep = _agrees_with_neighbours(depth, sigma, pitch * steep, outlier_z)
    keep = _large_pieces(depth, sigma, keep, pitch * steep, least_pixels)
    return _mesh(np.where(keep[..., None], points, np.nan), sigma, keep, pitch * steep)


def _mesh(points: Floats, sigma: Floats32, keep: Bools, reach: float) -> Surface:
    depth = np.ascontiguousarray(points[..., 2])
    number = np.full(keep.shape, -1, np.int32)
    rows, columns = np.nonzero(keep)
    number[rows, columns] = np.arange(len(rows), dtype=np.int32)
    faces = _faces(depth, sigma, number, reach)
    return Surface(
        points_mm=points,
        sigma_mm=np.where(keep, sigma, np.float32(np.nan)),
        mask=keep,
        vertices_mm=points[rows, columns],
        vertex_sigma_mm=sigma[rows, columns].astype(float),
        faces=faces,
        pixels=np.stack([rows, columns], axis=-1).astype(np.int32),
    )


@njit(cache=True, inline="always")
def _joined(z0: float, z1: float, s0: float, s1: float, reach: float, pixels: float) -> bool:
    """Whether two depths ``pixels`` apart may belong to one surface."""
    near: bool = abs(z1 - z0) <= reach * pixels * min(z0, z1) + 3.0 * np.sqrt(s0 * s0 + s1 * s1)
    return near


@njit(cache=True, parallel=True, nogil=True)
def _agrees_with_neighbours(depth: Floats, sigma: Floats32, reach: float, outlier_z: float) -> Bools:
    height, width = depth.shape
    keep = np.zeros((height, width), np.bool_)
    for r in prange(height):
        zs, dx, dy, ws = np.empty(25), np.empty(25), np.empty(25), np.empty(25)
        for c in range(width):
            z0, s0 = depth[r, c], float(sigma[r, c])
            if not np.isfinite(z0):
                continue
            n = 0
            for y in range(max(0, r - _FIT_REACH), min(height, r + _FIT_REACH + 1)):
                for x in range(max(0, c - _FIT_REACH), min(width, c + _FIT_REACH + 1)):
                    if (y == r and x == c) or not np.isfinite(depth[y, x]):
                        continue
                    away = np.sqrt(float((y - r) * (y - r) + (x - c) * (x - c)))
                    if _joined(z0, depth[y, x], s0, float(sigma[y, x]), reach, away):
                        zs[n], dx[n], dy[n] = depth[y, x] - z0, x - c, y - r
                        ws[n] = float(sigma[y, x]) ** 2
                        n += 1
            keep[r, c] = n >= _FIT_LEAST and _on_plane(zs, dx, dy, ws, n, s0, outlier_z)
    return keep


@njit(cache=True)
def _on_plane(z: Floats, x: Floats, y: Floats, variance: Floats, n: int, s0: float, outlier_z: float) -> bool:
    """Whether 0 lies on the plane z = a + b x + c y through the neighbours, within ``outlier_z`` sigmas."""
    m = np.zeros((3, 3))
    v = np.zeros(3)
    stated = 0.0
    for i in range(n):
        row = (1.0, x[i], y[i])
        for j in range(3):
            v[j] += row[j] * z[i]
            for k in range(3):
                m[j, k] += row[j] * row[k]
        stated += variance[i]
    det = (
        m[0, 0] * (m[1, 1] * m[2, 2] - m[1, 2] * m[2, 1])
        - m[0, 1] * (m[1, 0] * m[2, 2] - m[1, 2] * m[2, 0])
        + m[0, 2] * (m[1, 0] * m[2, 1] - m[1, 1] * m[2, 0])
    )
    if det < 1e-9:
        return False
    inverse = np.linalg.inv(m)
    plane = inverse @ v
    scatter = 0.0
    for i in range(n):
        scatter += (z[i] - plane[0] - plane[1] * x[i] - plane[2] * y[i]) ** 2
    # scatter is noise and curvature alike: either excuses a point
    spread = max(scatter / max(n - 3, 1), stated / n)
    near: bool = plane[0] ** 2 <= outlier_z * outlier_z * (s0 * s0 + spread * (1.0 + inverse[0, 0]))
    return near


@njit(cache=True, nogil=True)
def _large_pieces(depth: Floats, sigma: Floats32, keep: Bools, reach: float, least: int) -> Bools:
    """Keep the pixels of pieces of at least ``least`` joined pixels (union-find, one raster pass)."""
    height, width = depth.shape
    parent = np.arange(height * width)
    for r in range(height):
        for c in range(width):
            if not keep[r, c]:
                continue
            for y, x in ((r, c - 1), (r - 1, c)):
                if y >= 0 and x >= 0 and keep[y, x]:
                    s0, s1 = float(sigma[r, c]), float(sigma[y, x])
                    if _joined(depth[r, c], depth[y, x], s0, s1, reach, 1.0):
                        a, b = _root(parent, r * width + c), _root(parent, y * width + x)
                        parent[max(a, b)] = min(a, b)
    size = np.zeros(height * width, np.int64)
    for i in range(height * width):
        size[_root(parent, i)] += 1
    large = np.zeros((height, width), np.bool_)
    for r in range(height):
        for c in range(width):
            large[r, c] = keep[r, c] and size[_root(parent, r * width + c)] >= least
    return large


@njit(cache=True)
def _root(parent: Ints, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def _faces(  # noqa: C901 (a kernel)
    depth: Floats, sigma: Floats32, number: Ints32, reach: float
) -> Ints32:
    """Up to two triangles per 2×2 pixels, split along the diagonal with the smaller step in depth."""
    height, width = depth.shape
    faces = np.empty((2 * height * width, 3), np.int32)
    n = 0
    # corners in the order top left, bottom left, bottom right, top right: counter-clockwise as seen
    rows, columns = (0, 1, 1, 0), (0, 0, 1, 1)
    for r in range(height - 1):
        for c in range(width - 1):
            start = 0
            down = abs(depth[r, c] - depth[r + 1, c + 1])
            up = abs(depth[r + 1, c] - depth[r, c + 1])
            missing = 0
            for i in range(4):
                if number[r + rows[i], c + columns[i]] < 0:
                    missing += 1
                    start = (i + 1) % 4
            if missing > 1:
                continue
            if missing == 0:
                start = 0 if down <= up else 1
            for t in range(2 - missing):
                corners = (start, (start + 1 + t) % 4, (start + 2 + t) % 4)
                whole = True
                for e in range(3):
                    i, j = corners[e], corners[(e + 1) % 3]
                    y0, x0, y1, x1 = r + rows[i], c + columns[i], r + rows[j], c + columns[j]
                    away = np.sqrt(float((y0 - y1) ** 2 + (x0 - x1) ** 2))
                    s0, s1 = float(sigma[y0, x0]), float(sigma[y1, x1])
                    whole &= _joined(depth[y0, x0], depth[y1, x1], s0, s1, reach, away)
                if whole:
                    for e in range(3):
                        i = corners[e]
                        faces[n, e] = number[r + rows[i], c + columns[i]]
                    n += 1
    return faces[:n].copy()
