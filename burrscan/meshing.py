"""An organised range image becomes a mesh: neighbours are joined unless the depth between them jumps."""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Ints, Ints32
from burrscan.correspondence import Correspondence
from burrscan.footprint import at_centres
from burrscan.rig import Rig
from burrscan.surface import Surface
from burrscan.triangulation import triangulate

_FIT_REACH = 2
"""Pixels to each side: up to 24 neighbours, over which a surface is hardly curved."""
_FIT_LEAST = 6
"""Neighbours: a plane has three unknowns, and as many spare ones say whether it fits."""


def surface(
    correspondence: Correspondence,
    rig: Rig,
    *,
    radiance: Floats32 | None = None,
    grazing_deg: float = 82.0,
    outlier_z: float = 5.0,
    least_pixels: int = 40,
) -> Surface:
    """Triangulate, drop outliers and what the border of the projector's picture crosses, and mesh.

    Parameters
    ----------
    correspondence
        Projector columns per camera pixel.
    rig
        The calibration.
    radiance
        (h, w) light of each pixel under full white, as :class:`burrscan.correspondence.Scan` has it: columns
        are taken to the pixels' centres by it (:func:`burrscan.footprint.at_centres`).
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
    points, sigma = triangulate(at_centres(correspondence, radiance), rig)
    points[~_within_light(points, rig)] = np.nan
    pitch = 0.5 * (1.0 / rig.camera.fx + 1.0 / rig.camera.fy)
    reach = float(np.tan(np.radians(grazing_deg))) * pitch
    depth, variance = _planes(points, sigma)
    keep = _agrees_with_neighbours(depth, variance, reach, outlier_z)
    keep = _large_pieces(depth, variance, keep, reach, least_pixels)
    return _mesh(points, sigma, keep, _faces(depth, variance, _numbers(keep), reach))


def _within_light(points: Floats, rig: Rig) -> Bools:
    """(h, w) which points lie off the border of the projector's picture, by a pixel of either device.

    Of a pixel which that border crosses a part alone is lit, and its column is the mean over that part.
    O(pixels).
    """
    within = np.isfinite(points[..., 2])
    there = points[within]
    seen_px = there[:, 2] / rig.camera.fx * rig.projector.fx / rig.to_projector(there)[:, 2]
    within[within] = rig.within_light_px(there) >= np.maximum(seen_px, 1.0)
    return within


def _mesh(points: Floats, sigma: Floats32, keep: Bools, faces: Ints32) -> Surface:
    pixels = np.argwhere(keep).astype(np.int32)
    _clear(points, sigma, keep)
    rows, columns = pixels.T
    return Surface(
        points_mm=points,
        sigma_mm=sigma,
        mask=keep,
        vertices_mm=points[rows, columns],
        vertex_sigma_mm=sigma[rows, columns].astype(float),
        faces=faces,
        pixels=pixels,
    )


@njit(cache=True, parallel=True, nogil=True)
def _planes(points: Floats, sigma: Floats32) -> tuple[Floats, Floats]:
    """Depth, and the variance along the ray."""
    height, width = sigma.shape
    depth, variance = np.empty((height, width)), np.empty((height, width))
    for r in prange(height):
        for c in range(width):
            depth[r, c] = points[r, c, 2]
            variance[r, c] = float(sigma[r, c]) * float(sigma[r, c])
    return depth, variance


@njit(cache=True, parallel=True, nogil=True)
def _clear(points: Floats, sigma: Floats32, keep: Bools) -> None:
    """NaN where there is no point."""
    height, width = keep.shape
    for r in prange(height):
        for c in range(width):
            if not keep[r, c]:
                points[r, c, 0], points[r, c, 1], points[r, c, 2] = np.nan, np.nan, np.nan
                sigma[r, c] = np.nan


@njit(cache=True, nogil=True)
def _numbers(keep: Bools) -> Ints32:
    """Vertex of each pixel in row-major order, -1 where there is none."""
    height, width = keep.shape
    number = np.empty((height, width), np.int32)
    n = 0
    for r in range(height):
        for c in range(width):
            number[r, c] = n if keep[r, c] else -1
            n += keep[r, c]
    return number


@njit(cache=True, nogil=True, inline="always")
def _joined(z0: float, z1: float, v0: float, v1: float, reach: float) -> bool:
    """Whether two depths, with variances, may be of one surface.

    They may differ by ``reach`` times the depth and three sigmas.
    """
    beyond = abs(z1 - z0) - reach * min(z0, z1)
    near: bool = beyond <= 0.0 or beyond * beyond <= 9.0 * (v0 + v1)
    return near


@njit(cache=True, parallel=True, nogil=True)
def _agrees_with_neighbours(depth: Floats, variance: Floats, reach: float, outlier_z: float) -> Bools:
    height, width = depth.shape
    keep = np.zeros((height, width), np.bool_)
    reaches = np.empty((_FIT_REACH + 1, _FIT_REACH + 1))
    for y in range(_FIT_REACH + 1):
        for x in range(_FIT_REACH + 1):
            reaches[y, x] = reach * np.sqrt(float(x * x + y * y))
    for r in prange(height):
        for c in range(width):
            if np.isfinite(depth[r, c]):
                # the loop's own index is unsigned
                keep[r, c] = _agrees(depth, variance, np.int64(r), c, reaches, outlier_z)
    return keep


@njit(cache=True, nogil=True)
def _agrees(depth: Floats, variance: Floats, r: int, c: int, reaches: Floats, outlier_z: float) -> bool:
    """Whether a point lies on the plane z = a + b x + c y through its neighbours, within so many sigmas."""
    height, width = depth.shape
    z0, v0 = depth[r, c], variance[r, c]
    n, sx, sy, sxx, sxy, syy = 0, 0, 0, 0, 0, 0
    sz, sxz, syz, szz, stated = 0.0, 0.0, 0.0, 0.0, 0.0
    for dy in range(max(-_FIT_REACH, -r), min(_FIT_REACH, height - 1 - r) + 1):
        for dx in range(max(-_FIT_REACH, -c), min(_FIT_REACH, width - 1 - c) + 1):
            z1, v1 = depth[r + dy, c + dx], variance[r + dy, c + dx]
            # a NaN is joined to nothing
            if (dx == 0 and dy == 0) or not _joined(z0, z1, v0, v1, reaches[abs(dy), abs(dx)]):
                continue
            z = z1 - z0
            n, sx, sy = n + 1, sx + dx, sy + dy
            sxx, sxy, syy = sxx + dx * dx, sxy + dx * dy, syy + dy * dy
            sz, sxz, syz, szz = sz + z, sxz + dx * z, syz + dy * z, szz + z * z
            stated += v1
    if n < _FIT_LEAST:
        return False
    # the normal equations' inverse by cofactors, exact whole numbers
    c00, c01, c02 = sxx * syy - sxy * sxy, sxy * sy - sx * syy, sx * sxy - sxx * sy
    c11, c12, c22 = n * syy - sy * sy, sx * sy - n * sxy, n * sxx - sx * sx
    det = n * c00 + sx * c01 + sy * c02
    if det <= 0:
        return False
    at = (c00 * sz + c01 * sxz + c02 * syz) / det
    per_x = (c01 * sz + c11 * sxz + c12 * syz) / det
    per_y = (c02 * sz + c12 * sxz + c22 * syz) / det
    scatter = max(szz - at * sz - per_x * sxz - per_y * syz, 0.0)
    # scatter is noise and curvature alike: either excuses a point
    spread = max(scatter / max(n - 3, 1), stated / n)
    near: bool = at * at <= outlier_z * outlier_z * (v0 + spread * (1.0 + c00 / det))
    return near


@njit(cache=True, nogil=True)
def _join(
    depth: Floats,
    variance: Floats,
    number: Ints32,
    parent: Ints,
    one: tuple[int, int],
    two: tuple[int, int],
    reach: float,
) -> None:
    """Make one piece of two pixels' pieces where the pixels are joined."""
    if _joined(depth[one], depth[two], variance[one], variance[two], reach):
        a, b = _root(parent, number[one]), _root(parent, number[two])
        parent[max(a, b)] = min(a, b)


@njit(cache=True, nogil=True)
def _large_pieces(depth: Floats, variance: Floats, keep: Bools, reach: float, least: int) -> Bools:
    """Keep the pixels of pieces of at least ``least`` joined pixels (union-find, one raster pass)."""
    height, width = depth.shape
    number = _numbers(keep)
    parent = np.arange(1 + number.max())
    for r in range(height):
        for c in range(width):
            if not keep[r, c]:
                continue
            if c > 0 and keep[r, c - 1]:
                _join(depth, variance, number, parent, (r, c), (r, c - 1), reach)
            if r > 0 and keep[r - 1, c]:
                _join(depth, variance, number, parent, (r, c), (r - 1, c), reach)
    size = np.zeros(len(parent), np.int64)
    for i in range(len(parent)):
        parent[i] = _root(parent, i)
        size[parent[i]] += 1
    large = np.zeros((height, width), np.bool_)
    for r in range(height):
        for c in range(width):
            large[r, c] = keep[r, c] and size[parent[number[r, c]]] >= least
    return large


@njit(cache=True)
def _root(parent: Ints, i: int) -> int:
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


# corners of 2×2 pixels in the order top left, bottom left, bottom right, top right: counter-clockwise as seen
_DOWN, _RIGHT = (0, 1, 1, 0), (0, 0, 1, 1)


@njit(cache=True, nogil=True)
def _whole(
    depth: Floats, variance: Floats, at: tuple[int, int], corners: tuple[int, int, int], reach: float
) -> bool:
    """Whether the three corners of a triangle are joined to each other."""
    whole = True
    for e in range(3):
        i, j = corners[e], corners[(e + 1) % 3]
        y0, x0, y1, x1 = at[0] + _DOWN[i], at[1] + _RIGHT[i], at[0] + _DOWN[j], at[1] + _RIGHT[j]
        away = reach * np.sqrt(float((y0 - y1) ** 2 + (x0 - x1) ** 2))
        v0, v1 = variance[y0, x0], variance[y1, x1]
        whole &= _joined(depth[y0, x0], depth[y1, x1], v0, v1, away)
    return whole


@njit(cache=True, nogil=True)
def _add_whole(
    faces: Ints32,
    n: int,
    number: Ints32,
    at: tuple[int, int],
    corners: tuple[int, int, int],
    whole: bool,  # noqa: FBT001 (numba takes no keywords only)
) -> int:
    """Write a triangle as face ``n`` if it is whole; how many faces there are then."""
    if whole:
        for e in range(3):
            i = corners[e]
            faces[n, e] = number[at[0] + _DOWN[i], at[1] + _RIGHT[i]]
    return n + whole


@njit(cache=True, nogil=True)
def _faces(depth: Floats, variance: Floats, number: Ints32, reach: float) -> Ints32:
    """Up to two triangles per 2×2 pixels, split along the diagonal with the smaller step in depth."""
    height, width = depth.shape
    faces = np.empty((2 * height * width, 3), np.int32)
    n = 0
    for r in range(height - 1):
        for c in range(width - 1):
            start = 0
            down = abs(depth[r, c] - depth[r + 1, c + 1])
            up = abs(depth[r + 1, c] - depth[r, c + 1])
            missing = 0
            for i in range(4):
                gone = number[r + _DOWN[i], c + _RIGHT[i]] < 0
                missing += gone
                start = (i + 1) % 4 if gone else start
            if missing > 1:
                continue
            if missing == 0:
                start = 0 if down <= up else 1
            for t in range(2 - missing):
                corners = (start, (start + 1 + t) % 4, (start + 2 + t) % 4)
                whole = _whole(depth, variance, (r, c), corners, reach)
                n = _add_whole(faces, n, number, (r, c), corners, whole)
    return faces[:n].copy()
