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

from burrscan.arrays import Bools, Floats, Ints16
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
def add_square(total: Floats, w: float, v: Floats) -> None:
    """Add w v vᵀ to a square matrix. Whole rows: they fit a processor's vectors, half of them do not."""
    for i in range(len(v)):
        part = w * v[i]
        for j in range(len(v)):
            total[i, j] += part * v[j]


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
    """One pass over the points.

    ``sums`` (K, 8, 8) adds up w v vᵀ per piece with v = (1, t, t², J, d): the place t
    along it, the distance d off it, and J, what the pose does to d. ``spread`` is a histogram of |d| up to
    ``top``.
    """
    v = np.ones(8)
    for i in range(points.shape[0]):
        x, y, z = meridian(points, i, frame, place)
        r = np.sqrt(x * x + y * y)
        k = piece_of(z, r, curve)
        if k < 0:
            continue
        t, d, mz, mr = off_piece(z, r, k, curve)
        w = weights[i] if weights.shape[0] > 0 else 1.0
        size = abs(d) * np.sqrt(w)
        if size < top:
            spread[min(int(size / top * BINS), BINS - 1)] += 1.0
        if size < limit:
            cosine, sine, tilt = x / r, y / r, z * mr - r * mz
            v[1], v[2], v[7] = t, t * t, d
            v[3], v[4], v[5], v[6] = -tilt * sine, tilt * cosine, mr * cosine, mr * sine
            add_square(sums[k], w * (1.0 - (size / limit) ** 2) ** 2, v)


def inverses(normal: Floats, stiffness: float, some: Bools) -> Floats:
    """(K, 3, 3) inverse of each piece's normal matrix of 1, t, t² with its prior; zero where not ``some``.

    ``normal`` (K, 3, 3), ``some`` is (K,); ``stiffness`` is the prior's weight of slope and bend.
    """
    matrix = normal + np.diag([0.0, stiffness, stiffness]) + 1e-9 * normal[:, :1, :1] * np.eye(3)
    inverse = np.zeros_like(matrix)
    inverse[some] = np.linalg.inv(matrix[some])
    return np.asarray(inverse)


def _eliminated(sums: Floats, stiffness: float) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Normal equations H, g of the pose without the pieces; each piece's offset, response, inverse matrix."""
    some = sums[:, 0, 0] >= max(FEWEST, 0.025 * float(sums[:, 0, 0].mean()))
    sums = sums * some[:, None, None]
    inverse = inverses(sums[:, :3, :3], stiffness, some)
    slopes = sums[:, :3, 3:7]
    offset, response = np.einsum("kij,kj->ki", inverse, sums[:, :3, 7]), inverse @ slopes
    total = sums[:, 3:7, 3:].sum(axis=0)
    H = total[:, :4] - np.einsum("kip,kiq->pq", slopes, response)
    g = total[:, 4] - np.einsum("kip,ki->p", slopes, offset)
    return H, g, offset, response, inverse


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
    sums, spread = np.zeros((len(fit.coefficients), 8, 8)), np.zeros(BINS)
    top = min(gate, 8 * fit.sigma)
    _accumulate(points, weights, fit.frame, fit.place, curve_of(fit), TUKEY * fit.sigma, top, sums, spread)
    stiffness = (max(fit.sigma, fit.raw_sigma) / (BEND * fit.pieces.spacing)) ** 2
    step, size, offset, fit.response, fit.gram = _solved(sums, stiffness, freedom)
    fit.coefficients = fit.coefficients + offset + fit.response @ step
    fit.frame, fit.place = _moved(step, fit.frame, fit.place)
    fit.sigma = max(median_sigma(spread, top), fit.least)
    fit.inliers, fit.steps = float(sums[:, 0, 0].sum()), fit.steps + 1
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
