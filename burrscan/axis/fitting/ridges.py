"""The generatrix as short pieces: ridges of the density of points in the (z, r) plane of an assumed axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints, Ints16
from burrscan.axis.jit import kernel

CELLS_PER_BLUR = 1.5
"""A Gaussian blur of this many cells is sampled without loss: its spectrum at the grid's limit is 1.5e-5."""
FINER = 4
"""Cells of the map of pieces per cell of the density. Its staircase borders must be finer than the noise: a
border
aslant to the curve would choose points by their noise."""
SPACING = 2.5
"""Distance of neighbouring pieces, in blurs."""
GATE = 1.6
"""Points further than this many spacings from every piece belong to none."""
HALF = 0.4
"""Half length, in spacings, of the line a point's nearest piece is told by: long lines would overlap, and
the nearer of
two overlapping ones depends on the very noise that is to be averaged."""
MAX_CELLS = 1 << 20
"""Of the map; six moments of 8 bytes each then take 50 MB. Larger maps get coarser cells."""


@dataclass(frozen=True)
class Pieces:
    """K straight pieces and the map that says which piece a point of the (z, r) plane belongs to.

    Parameters
    ----------
    centre, normal
        (K, 2) in (z, r).
    labels
        (nz, nr) piece of each cell, -1 where there is none.
    origin
        (2,) corner of the map.
    cell
        Side of a cell.
    spacing
        Distance of neighbouring pieces: the unit of a piece's own coordinate.

    """

    centre: Floats
    normal: Floats
    labels: Ints16
    origin: Floats
    cell: float
    spacing: float


def meridian_bounds(points: Floats, frame: Floats, place: Floats, reach: float) -> Floats:
    """Least and greatest z and r of the points within reach."""
    z, r = _meridian(points[(np.abs(points) < reach).all(axis=1)], frame, place)
    return np.array([z.min(), z.max(), r.min(), r.max()])


def _meridian(points: Floats, frame: Floats, place: Floats) -> tuple[Floats, Floats]:
    """(V,) z and r of points in the frame of an axis."""
    x, y, z = np.einsum("vi,ij->jv", points - place, frame)
    return z, np.hypot(x, y)


def _histogram(z: Floats, r: Floats, weights: Floats, cell: float, shape: tuple[int, int]) -> Floats:
    """(*shape, 6) sums of 1, z, r, zz, zr, rr per cell; a point outside counts in none."""
    inside = (z >= 0.0) & (r >= 0.0) & (z < shape[0] * cell) & (r < shape[1] * cell)
    z, r, w = z[inside], r[inside], weights[inside] if len(weights) else np.ones(np.count_nonzero(inside))
    flat = np.minimum((z / cell).astype(np.int64), shape[0] - 1) * shape[1]
    flat += np.minimum((r / cell).astype(np.int64), shape[1] - 1)
    terms = (w, w * z, w * r, w * z * z, w * z * r, w * r * r)
    size = shape[0] * shape[1]
    sums: Floats = np.stack([np.bincount(flat, term, size) for term in terms], axis=1)
    return sums.reshape(*shape, 6)


@kernel
def _smear(line: Floats, at: int, values: Floats, kernel: Floats) -> None:
    """Add a cell's values (C,), spread by the kernel, to the cells (N, C) of its row or column."""
    half = kernel.shape[0] // 2
    for s in range(max(-half, -at), min(half, line.shape[0] - 1 - at) + 1):
        for c in range(line.shape[1]):
            line[at + s, c] += kernel[s + half] * values[c]


@kernel
def _blurred(field: Floats, kernel: Floats) -> Floats:
    """Separable blur; only non-empty cells cost anything."""
    rows, columns, _ = field.shape
    once = np.zeros_like(field)
    for j in range(rows):
        for k in range(columns):
            if field[j, k, 0] > 0.0:
                _smear(once[:, k], j, field[j, k], kernel)
    twice = np.zeros_like(field)
    for j in range(rows):
        for k in range(columns):
            if once[j, k, 0] > 0.0:
                _smear(twice[j], k, once[j, k], kernel)
    return twice


def _ridge_cells(field: Floats, cell: float, least: float) -> Floats:
    """Cells whose density is greatest across the local normal: rows (z, r, nz, nr, density, flatness)."""
    density = field[:, :, 0]
    j, k = (index + 1 for index in np.nonzero(density[1:-1, 1:-1] >= least))
    n = density[j, k]
    mz, mr, zz, zr, rr = (field[j, k, 1:] / n[:, None]).T
    zz, zr, rr = zz - mz * mz, zr - mz * mr, rr - mr * mr
    half, mid = 0.5 * (zz - rr), 0.5 * (zz + rr)
    root = np.sqrt(half * half + zr * zr)
    turn = 0.5 * np.arctan2(zr, half)  # of the major axis: the tangent
    nz, nr = -np.sin(turn), np.cos(turn)
    # against the two neighbours the normal points to, bilinear between cells
    sj, sk = np.where(nz > 0.0, 1, -1), np.where(nr > 0.0, 1, -1)
    wz, wr = np.abs(nz), np.abs(nr)
    q = np.minimum(wz, wr) / np.maximum(wz, wr)
    ej, ek = np.where(wr >= wz, 0, sj), np.where(wr >= wz, sk, 0)
    ahead = (1.0 - q) * density[j + ej, k + ek] + q * density[j + sj, k + sk]
    behind = (1.0 - q) * density[j - ej, k - ek] + q * density[j - sj, k - sk]
    z, r = (j + 0.5) * cell, (k + 0.5) * cell
    shift = nz * (mz - z) + nr * (mr - r)
    flat = (mid - root) / (mid + root + 1e-300)
    rows = np.stack([z + nz * shift, r + nr * shift, nz, nr, n, flat], axis=1)
    return np.asarray(rows[(n >= ahead) & (n >= behind)])


@kernel
def _spread_out(ridges: Floats, order: Ints, spacing: float) -> Ints:
    """Greedy choice in the given order, no two closer than the spacing."""
    chosen = np.empty(order.shape[0], dtype=np.int64)
    count = 0
    for m in order:
        free = True
        for s in range(count):
            dz, dr = ridges[m, 0] - ridges[chosen[s], 0], ridges[m, 1] - ridges[chosen[s], 1]
            if dz * dz + dr * dr < spacing * spacing:
                free = False
                break
        if free:
            chosen[count] = m
            count += 1
    return chosen[:count]


@kernel
def _label_map(
    centre: Floats, normal: Floats, shape: tuple[int, int], cell: float, spacing: float, gate: float
) -> Ints16:
    """Piece nearest to each cell, as the distance to a short line segment."""
    labels = np.full(shape, -1, dtype=np.int16)
    best = np.full(shape, gate * gate)
    reach = int(np.ceil((gate + HALF * spacing) / cell))
    for m in range(centre.shape[0]):
        j0, k0 = int(centre[m, 0] / cell), int(centre[m, 1] / cell)
        for j in range(max(0, j0 - reach), min(shape[0] - 1, j0 + reach) + 1):
            for k in range(max(0, k0 - reach), min(shape[1] - 1, k0 + reach) + 1):
                dz, dr = (j + 0.5) * cell - centre[m, 0], (k + 0.5) * cell - centre[m, 1]
                across = dz * normal[m, 0] + dr * normal[m, 1]
                along = max(0.0, abs(dr * normal[m, 0] - dz * normal[m, 1]) - HALF * spacing)
                distance = across * across + along * along
                nearer = distance < best[j, k]
                labels[j, k] = m if nearer else labels[j, k]
                best[j, k] = distance if nearer else best[j, k]
    return labels


def density_field(
    points: Floats, weights: Floats, frame: Floats, place: Floats, blur: float, bounds: Floats
) -> tuple[Floats, Floats, float]:
    """Blurred moments over the (z, r) plane, the corner of the map and its cell side."""
    cell = blur / CELLS_PER_BLUR
    area = (bounds[1] - bounds[0] + 8 * blur) * (bounds[3] - bounds[2] + 8 * blur)
    cell = max(cell, float(np.sqrt(area / MAX_CELLS)))
    origin = np.array([np.floor(bounds[0] / cell) * cell, np.floor(bounds[2] / cell) * cell]) - 4 * cell
    shape = int((bounds[1] - origin[0]) / cell) + 6, int((bounds[3] - origin[1]) / cell) + 6
    z, r = _meridian(points, frame, place)
    field = _histogram(z - origin[0], r - origin[1], weights, cell, shape)
    half = int(np.ceil(2.5 * CELLS_PER_BLUR))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / CELLS_PER_BLUR) ** 2)
    return _blurred(field, kernel / kernel.sum()), origin, cell


def find_pieces(
    points: Floats, weights: Floats, frame: Floats, place: Floats, *, blur: float, bounds: Floats
) -> Pieces:
    """Pieces of the generatrix at the resolution ``blur``. O(V) for the histogram, then O(cells)."""
    field, origin, cell = density_field(points, weights, frame, place, blur, bounds)
    density = field[:, :, 0]
    typical = float((density * density).sum() / max(density.sum(), 1e-300))
    ridges = _ridge_cells(field, cell, 0.03 * typical)
    spacing = SPACING * cell * CELLS_PER_BLUR
    order = np.argsort(ridges[:, 5] - 1e-3 * ridges[:, 4] / typical, kind="stable")
    chosen = ridges[_spread_out(ridges, order, spacing)]
    centre, normal = np.ascontiguousarray(chosen[:, :2]), np.ascontiguousarray(chosen[:, 2:4])
    fine = cell / FINER
    shape = (density.shape[0] * FINER, density.shape[1] * FINER)
    labels = _label_map(centre, normal, shape, fine, spacing, GATE * spacing)
    return Pieces(centre + origin, normal, labels, origin, fine, spacing)
