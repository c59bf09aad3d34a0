"""Gauss-Newton on an axis with a free generatrix, eliminated in every step (variable projection).

Golub & Pereyra's idea with Kaufman's Jacobian; the generatrix is pieces of parabolas with normal distances
in the
(z, r) plane, so flat faces, undercuts and several branches are as good as any other shape. Tukey's biweight
lets burrs, spokes and outliers count nothing.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from burrscan.arrays import Bools, Floats, Ints16, Ints32
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.fitting.ridges import GATE, Pieces, find_pieces, meridian_bounds
from burrscan.axis.jit import kernel
from burrscan.axis.points.cloud import REACH
from burrscan.robust import MEDIAN_SIZE

TUKEY = 5.0
"""Residuals beyond this many sigma count nothing: 96.1 % efficient on normal noise, and the gate of inliers,
which count fully in the covariance; :data:`burrscan.robust.TUKEY` would cut those a little tighter."""
FLOOR = 1e-7
"""Least noise, in units of the rms radius."""
THINNED_STEPS = 4
"""Steps on the voxel means first, each far cheaper than one on all points, which then start near the
minimum."""
SETTLED = 0.2
"""A step of less than this many standard deviations of the pose is the last one."""
BINS = 256
"""Of the histogram that the median of |d| is read off: a bin is 3 % of sigma at 8 sigma, and is
interpolated in."""
BLOCK = 128
"""Points handled together: their intermediate values stay in the fastest memory."""
FEWEST = 12.0
"""A piece with less than this weight of points, or less than a fortieth of the mean weight, is left out."""
BEND = 0.2
"""Slope and bend of a piece off its ridge are expected within this many spacings (they are noise beyond)."""


class Curve(NamedTuple):
    """A generatrix as kernels take it: see :class:`burrscan.axis.fitting.ridges.Pieces` and :class:`Fit`."""

    centre: Floats
    normal: Floats
    coefficients: Floats
    labels: Ints16
    origin: Floats
    cell: float
    spacing: float


@dataclass
class Fit:
    """The state of a fit: frame (columns e1, e2, axis), place on the axis, noise, and the generatrix.

    Parameters
    ----------
    coefficients
        (K, 3) offset of each piece off its straight line, for 1, t, t².
    response
        (K, 3, 4) change of those by the pose.
    gram
        (K, 3, 3) inverse of each piece's normal matrix.
    raw_sigma
        Noise before smoothing.
    least
        What the noise is at least.

    """

    frame: Floats
    place: Floats
    sigma: float
    pieces: Pieces
    coefficients: Floats
    response: Floats
    gram: Floats
    raw_sigma: float
    inliers: float
    steps: int
    least: float = FLOOR


@kernel
def meridian(points: Floats, i: int, frame: Floats, place: Floats) -> tuple[float, float, float]:
    """Coordinates (x, y, z) of a point in the axis frame."""
    a, b, c = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
    x = a * frame[0, 0] + b * frame[1, 0] + c * frame[2, 0]
    y = a * frame[0, 1] + b * frame[1, 1] + c * frame[2, 1]
    z = a * frame[0, 2] + b * frame[1, 2] + c * frame[2, 2]
    return x, y, z


@kernel
def piece_of(z: float, r: float, curve: Curve) -> int:
    """The piece a point of the (z, r) plane belongs to, or -1."""
    fz, fr = (z - curve.origin[0]) / curve.cell, (r - curve.origin[1]) / curve.cell
    if not (fz >= 0.0 and fr >= 0.0 and fz < curve.labels.shape[0] and fr < curve.labels.shape[1]):
        return -1
    return int(curve.labels[int(fz), int(fr)])


@kernel
def off_piece(z: float, r: float, k: int, curve: Curve) -> tuple[float, float, float, float]:
    """Place t along piece k, distance d off it, and the piece's normal (z, r) there."""
    nz, nr = curve.normal[k, 0], curve.normal[k, 1]
    dz, dr = z - curve.centre[k, 0], r - curve.centre[k, 1]
    offset, rise, bend = curve.coefficients[k]
    t = (dz * nr - dr * nz) / curve.spacing
    d = dz * nz + dr * nr - offset - t * (rise + t * bend)
    slope = (rise + 2.0 * t * bend) / curve.spacing
    return t, d, nz - slope * nr, nr + slope * nz


@kernel
def _in_frame(
    points: Floats,
    begin: int,
    count: int,
    frame: Floats,
    place: Floats,
    curve: Curve,
    block: Floats,
    at: Ints32,
) -> None:
    """Cosine, sine, z and r of ``count`` points, and their places in the map of pieces (-1 outside).

    Loops without branches, the second over one kind of stride: the compiler makes vector instructions of it.
    """
    fx0, fx1, fx2 = frame[0, 0], frame[0, 1], frame[0, 2]
    fy0, fy1, fy2 = frame[1, 0], frame[1, 1], frame[1, 2]
    fz0, fz1, fz2 = frame[2, 0], frame[2, 1], frame[2, 2]
    p0, p1, p2 = place[0], place[1], place[2]
    low_z, low_r, per = curve.origin[0], curve.origin[1], 1.0 / curve.cell
    rows, columns = curve.labels.shape
    cosine, sine, height, radius = block[0], block[1], block[2], block[3]
    for j in range(count):
        i = begin + j
        a, b, c = points[i, 0] - p0, points[i, 1] - p1, points[i, 2] - p2
        cosine[j] = a * fx0 + b * fy0 + c * fz0
        sine[j] = a * fx1 + b * fy1 + c * fz1
        height[j] = a * fx2 + b * fy2 + c * fz2
    for j in range(count):
        x, y, z = cosine[j], sine[j], height[j]
        r = np.sqrt(x * x + y * y)
        u, v = (z - low_z) * per, (r - low_r) * per
        inside = (u >= 0.0) & (v >= 0.0) & (u < rows) & (v < columns)
        cosine[j], sine[j], radius[j] = x / r, y / r, r
        at[j] = np.int32(u) * columns + np.int32(v) if inside else -1


@kernel
def _on_pieces(count: int, curve: Curve, block: Floats, at: Ints32, which: Ints32) -> int:
    """Move the points that have a piece to the front of the block and return how many.

    Of each: cosine, sine, the derivatives of d by a tilt and by an offset in its meridian, t and d. Its piece
    goes to ``at``, its number in the block to ``which``.
    """
    labels = curve.labels.ravel()
    found = 0
    for j in range(count):
        k = labels[np.uint32(at[j])] if at[j] >= 0 else -1
        if k < 0:
            continue
        z, r = block[2, j], block[3, j]
        t, d, mz, mr = off_piece(z, r, k, curve)
        block[0, found], block[1, found], at[found], which[found] = block[0, j], block[1, j], k, j
        block[2, found], block[3, found], block[4, found], block[5, found] = z * mr - r * mz, mr, t, d
        found += 1
    return found


@kernel
def _add(row: Floats, w: float, t: float, d: float, J: tuple[float, float, float, float]) -> None:
    """Add a point to its piece's sums, see :func:`_accumulate`. Written out: it stays in registers."""
    a, b, c, e = J
    wt, wtt, wd, wa, wb, wc, we = w * t, w * t * t, w * d, w * a, w * b, w * c, w * e
    row[0] += w
    row[1] += wt
    row[2] += wtt
    row[3] += wtt * t
    row[4] += wtt * t * t
    row[5] += wd
    row[6] += wd * t
    row[7] += wd * t * t
    row[8] += wa
    row[9] += wb
    row[10] += wc
    row[11] += we
    row[12] += wa * t
    row[13] += wb * t
    row[14] += wc * t
    row[15] += we * t
    row[16] += wa * t * t
    row[17] += wb * t * t
    row[18] += wc * t * t
    row[19] += we * t * t
    row[20] += wa * a
    row[21] += wa * b
    row[22] += wa * c
    row[23] += wa * e
    row[24] += wb * b
    row[25] += wb * c
    row[26] += wb * e
    row[27] += wc * c
    row[28] += wc * e
    row[29] += we * e
    row[30] += wa * d
    row[31] += wb * d
    row[32] += wc * d
    row[33] += we * d


@kernel
def _accumulate(
    points: Floats,
    weights: Floats,
    frame: Floats,
    place: Floats,
    curve: Curve,
    limit: float,
    top: float,
    sums: Floats,
    spread: Floats,
) -> None:
    """One pass over the points, a block at a time.

    Adds per piece, with t along it and d off it: rows of ``sums`` hold t^0..t^4 (5), d t^0..t^2 (3),
    J t^0..t^2 (12), J Jᵀ (10), d J (4), each times the weight. ``spread`` is a histogram of |d| up to
    ``top``.
    """
    fine, tight = BINS / top, 1.0 / limit
    block, at, which = np.empty((6, BLOCK)), np.empty(BLOCK, np.int32), np.empty(BLOCK, np.int32)
    weighted = weights.shape[0] > 0
    for begin in range(0, points.shape[0], BLOCK):
        count = min(BLOCK, points.shape[0] - begin)
        _in_frame(points, begin, count, frame, place, curve, block, at)
        for j in range(_on_pieces(count, curve, block, at, which)):
            cosine, sine, tilt = block[0, j], block[1, j], block[2, j]
            shift, t, d = block[3, j], block[4, j], block[5, j]
            w, size = 1.0, abs(d)
            if weighted:
                w = weights[begin + which[j]]
                size *= np.sqrt(w)
            if size < top:
                spread[np.uint32(min(int(size * fine), BINS - 1))] += 1.0
            if size < limit:
                w *= (1.0 - (size * tight) ** 2) ** 2
                J = (-tilt * sine, tilt * cosine, shift * cosine, shift * sine)
                _add(sums[np.uint32(at[j])], w, t, d, J)


def inverses(moments: Floats, stiffness: float, some: Bools) -> Floats:
    """(K, 3, 3) inverse of each piece's normal matrix of 1, t, t² with its prior; zero where not ``some``.

    ``moments`` (K, 5) sums t⁰ to t⁴, ``some`` is (K,); ``stiffness`` is the prior's weight of slope and bend.
    """
    matrix = moments[:, [[0, 1, 2], [1, 2, 3], [2, 3, 4]]]
    matrix[:, [1, 2], [1, 2]] += stiffness
    matrix[:, range(3), range(3)] += 1e-9 * moments[:, :1]
    inverse = np.zeros_like(matrix)
    inverse[some] = np.linalg.inv(matrix[some])
    return np.asarray(inverse)


def _eliminated(sums: Floats, stiffness: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Normal equations H, g of the pose without the pieces; each piece's offset, response, inverse matrix."""
    some = sums[:, 0] >= max(FEWEST, 0.025 * float(sums[:, 0].mean()))
    sums = sums * some[:, None]
    inverse = inverses(sums[:, :5], stiffness, some)
    slopes = sums[:, 8:20].reshape(-1, 3, 4)
    offset, response = np.einsum("kij,kj->ki", inverse, sums[:, 5:8]), inverse @ slopes
    H = symmetric(sums[:, 20:30].sum(axis=0)) - np.einsum("kip,kiq->pq", slopes, response)
    g = sums[:, 30:34].sum(axis=0) - np.einsum("kip,ki->p", slopes, offset)
    return H, g, offset, response, inverse


def symmetric(upper: Floats) -> Floats:
    """(4, 4) matrix from the ten entries of its upper triangle, row by row."""
    matrix = np.zeros((4, 4))
    matrix[np.triu_indices(4)] = upper
    return matrix + np.triu(matrix, 1).T


def rotation_by(w: Floats) -> Floats:
    """Rotation by the vector (wx, wy, 0)."""
    return np.asarray(Rotation.from_rotvec([w[0], w[1], 0.0]).as_matrix())


def median_sigma(histogram: Floats, top: float) -> float:
    """Robust standard deviation from a histogram of absolute values up to ``top``."""
    upto = np.cumsum(histogram)
    half = 0.5 * float(upto[-1])
    if half <= 0.0:
        return top
    k = int(np.searchsorted(upto, half))
    share = 1.0 - (float(upto[k]) - half) / float(histogram[k])
    return float(top * (k + share) / len(histogram) / MEDIAN_SIZE)


def frame_of(direction: Floats) -> Floats:
    """Right-handed frame whose third column is the direction."""
    return np.column_stack([perpendicular_basis(direction), direction])


def refine(
    points: Floats,
    weights: Floats,
    direction: Floats,
    place: Floats,
    *,
    blur: float,
    steps: int,
    sigma: float | None = None,
    raw_sigma: float = 0.0,
    thinned: tuple[Floats, Floats] | None = None,
    least: float = FLOOR,
) -> Fit:
    """Gauss-Newton from an axis; the pieces are found once, at the start. O(V) a step.

    Parameters
    ----------
    points, weights
        (V, 3) in the canonical frame and (V,) inverse variances with unit mean, or none.
    direction, place
        The axis to start from.
    blur
        Resolution of the pieces.
    steps
        Most steps with all points.
    sigma
        Noise to start from; without it the pieces are fitted first, and their noise is taken.
    raw_sigma
        Noise of the points before smoothing, if they are smooth.
    thinned
        Fewer points and their weights, that stand for all until the steps are small.
    least
        What the noise is at least: where flat faces are perfect and round ones are facets, the faces alone
        would say.

    """
    frame, place = frame_of(direction), place - direction * (place @ direction)
    bounds = meridian_bounds(points, frame, place, REACH)
    pieces = find_pieces(points, weights, frame, place, blur=blur, bounds=bounds)
    count = len(pieces.centre)
    gate = GATE * pieces.spacing
    fit = Fit(
        frame, place, gate, pieces,
        np.zeros((count, 3)), np.zeros((count, 3, 4)), np.zeros((count, 3, 3)), raw_sigma, 0.0, 0, least,
    )  # fmt: skip
    if sigma is not None:
        fit.sigma = sigma
    elif count:
        _step(points, weights, fit, gate, freedom=0.0)
    if count and thinned is not None:
        for _ in range(THINNED_STEPS):
            _step(thinned[0], thinned[1], fit, gate)
    for _ in range(steps if count else 0):
        if _step(points, weights, fit, gate) < SETTLED:
            break
    return fit


def _step(points: Floats, weights: Floats, fit: Fit, gate: float, *, freedom: float = 1.0) -> float:
    """One Gauss-Newton step, in place; with no freedom the axis stays and only the generatrix is fitted.

    Returns its length in standard deviations of the pose.
    """
    sums, spread = np.zeros((len(fit.coefficients), 34)), np.zeros(BINS)
    top = min(gate, 8 * fit.sigma)
    _accumulate(points, weights, fit.frame, fit.place, curve_of(fit), TUKEY * fit.sigma, top, sums, spread)
    stiffness = (max(fit.sigma, fit.raw_sigma) / (BEND * fit.pieces.spacing)) ** 2
    step, size, offset, fit.response, fit.gram = _solved(sums, stiffness, freedom)
    fit.coefficients = fit.coefficients + offset + fit.response @ step
    fit.frame, fit.place = _moved(step, fit.frame, fit.place)
    fit.sigma = max(median_sigma(spread, top), fit.least)
    fit.inliers, fit.steps = float(sums[:, 0].sum()), fit.steps + 1
    return size / max(fit.sigma, fit.raw_sigma)


def _solved(sums: Floats, stiffness: float, freedom: float) -> tuple[Floats, float, Floats, Floats, Floats]:
    """Step of the pose and its length in units of sigma; each piece's offset, response, inverse matrix."""
    H, g, offset, response, inverse = _eliminated(sums, stiffness)
    step = np.linalg.solve(H + (1e-12 * np.trace(H) + 1e-300) * np.eye(4), -g)
    step = freedom * np.clip(step, -0.2, 0.2)
    return step, float(np.sqrt(np.maximum(step @ H @ step, 0.0))), offset, response, inverse


def _moved(step: Floats, frame: Floats, place: Floats) -> tuple[Floats, Floats]:
    """Frame and place after a step."""
    frame = frame @ rotation_by(step).T
    return frame, place - frame[:, :2] @ step[2:]


def curve_of(fit: Fit) -> Curve:
    """The generatrix of a fit."""
    p = fit.pieces
    return Curve(p.centre, p.normal, fit.coefficients, p.labels, p.origin, p.cell, p.spacing)
