"""The best axis: a free generatrix fitted to all points, eliminated in every Gauss-Newton step.

Variable projection (Golub & Pereyra) with the generatrix as pieces with normal distances in the (z, r) plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.cloud import REACH, Cloud, canonical_cloud, voxel_moments
from burrscan.axis.ridges import GATE, Pieces, density_field, find_pieces, meridian_bounds
from burrscan.axis.smooth import smoothed
from burrscan.axis.starts import candidate_axes
from burrscan.axis.surfels import surfels_of
from burrscan.inspection import Axis

TUKEY = 5.0
"""Residuals beyond this many sigma count nothing (Tukey's biweight; 96 % efficient)."""
BLUR = 0.02
"""Resolution of the generatrix in units of the rms radius, or coarser where the noise is larger."""
BLUR_PER_SIGMA = 1.5
FLOOR = 1e-7
"""Least noise, in units of the rms radius."""
SETTLED = 1e-4
BINS = 256
SECTORS = 64


@njit(cache=True, nogil=True)
def _accumulate(
    points: Floats,
    weights: Floats,
    frame: Floats,
    place: Floats,
    centre: Floats,
    normal: Floats,
    coefficients: Floats,
    labels: Ints32,
    origin: Floats,
    cell: float,
    spacing: float,
    limit: float,
    top: float,
    sums: Floats,
    spread: Floats,
) -> None:  # pragma: no cover
    """One pass over the points.

    Adds per piece, with t along it and d off it: rows of ``sums`` hold t^0..t^4 (5), d t^0..t^2 (3),
    J t^0..t^2 (12), J Jᵀ (10), d J (4), each times the weight. ``spread`` is a histogram of |d| up to ``top``.
    """
    J = np.zeros(4)
    for i in range(points.shape[0]):
        a, b, c = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        x = a * frame[0, 0] + b * frame[1, 0] + c * frame[2, 0]
        y = a * frame[0, 1] + b * frame[1, 1] + c * frame[2, 1]
        z = a * frame[0, 2] + b * frame[1, 2] + c * frame[2, 2]
        r = np.sqrt(x * x + y * y)
        fz, fr = (z - origin[0]) / cell, (r - origin[1]) / cell
        if fz < 0.0 or fr < 0.0 or fz >= labels.shape[0] or fr >= labels.shape[1]:
            continue
        k = labels[int(fz), int(fr)]
        if k < 0:
            continue
        nz, nr = normal[k, 0], normal[k, 1]
        dz, dr = z - centre[k, 0], r - centre[k, 1]
        t = (dz * nr - dr * nz) / spacing
        d = dz * nz + dr * nr - coefficients[k, 0] - t * (coefficients[k, 1] + t * coefficients[k, 2])
        w = 1.0
        scale = 1.0
        if weights.shape[0] > 0:
            w = weights[i]
            scale = np.sqrt(w)
        size = abs(d) * scale
        if size < top:
            spread[int(size / top * BINS)] += 1.0
        if size >= limit:
            continue
        u = 1.0 - (size / limit) ** 2
        w *= u * u
        slope = (coefficients[k, 1] + 2.0 * t * coefficients[k, 2]) / spacing
        mz, mr = nz - slope * nr, nr + slope * nz
        cosine, sine = x / r, y / r
        g = z * mr - r * mz
        J[0], J[1], J[2], J[3] = -g * sine, g * cosine, mr * cosine, mr * sine
        row = sums[k]
        t2 = t * t
        row[0] += w
        row[1] += w * t
        row[2] += w * t2
        row[3] += w * t2 * t
        row[4] += w * t2 * t2
        row[5] += w * d
        row[6] += w * d * t
        row[7] += w * d * t2
        e = 20
        for p in range(4):
            wj = w * J[p]
            row[8 + p] += wj
            row[12 + p] += wj * t
            row[16 + p] += wj * t2
            row[30 + p] += wj * d
            for q in range(p, 4):
                row[e] += wj * J[q]
                e += 1


def _eliminated(sums: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Normal equations of the pose with the pieces eliminated: H, g, and each piece's offset and response."""
    gram = sums[:, [0, 1, 2, 1, 2, 3, 2, 3, 4]].reshape(-1, 3, 3)
    size = np.maximum(sums[:, 0], 1e-300)
    few = sums[:, 0] < 12.0
    gram = gram + size[:, None, None] * np.diag([1e-9, 1e-6, 1e-6])
    gram[few] = np.eye(3)
    cross = sums[:, 8:20].reshape(-1, 3, 4)
    solved = np.linalg.solve(gram, np.concatenate([sums[:, 5:8, None], cross], axis=2))
    offset, response = solved[:, :, 0], solved[:, :, 1:]
    keep = ~few
    upper = sums[keep, 20:30].sum(axis=0)
    H = np.zeros((4, 4))
    H[np.triu_indices(4)] = upper
    H = H + np.triu(H, 1).T - np.einsum("kip,kiq->pq", cross[keep], response[keep])
    g = sums[keep, 30:34].sum(axis=0) - np.einsum("kip,ki->p", cross[keep], offset[keep])
    offset[few], response[few] = 0.0, 0.0
    return H, g, offset, response


def rotation_by(w: Floats) -> Floats:
    """Rodrigues' rotation by the vector (wx, wy, 0)."""
    angle = float(np.hypot(w[0], w[1]))
    K = np.array([[0.0, 0.0, w[1]], [0.0, 0.0, -w[0]], [-w[1], w[0], 0.0]])
    if angle < 1e-12:
        return np.eye(3) + K
    return np.eye(3) + np.sin(angle) / angle * K + (1 - np.cos(angle)) / angle**2 * (K @ K)


@njit(cache=True, nogil=True)
def _scores(
    points: Floats,
    raw: Floats,
    weights: Floats,
    frame: Floats,
    place: Floats,
    centre: Floats,
    normal: Floats,
    coefficients: Floats,
    labels: Ints32,
    origin: Floats,
    cell: float,
    spacing: float,
    limit: float,
    response: Floats,
    scores: Floats,
) -> Floats:  # pragma: no cover
    """Scores of the pose summed per piece and sector of angle, and their derivative by the pose.

    The piece, the Jacobian and the weight of a point come from its smoothed position, its residual from the raw
    one: smoothing correlates neighbours, and what the pose makes of a neighbourhood's noise it hardly changes.
    """
    J = np.zeros(4)
    A = np.zeros((4, 4))
    for i in range(points.shape[0]):
        a, b, c = points[i, 0] - place[0], points[i, 1] - place[1], points[i, 2] - place[2]
        x = a * frame[0, 0] + b * frame[1, 0] + c * frame[2, 0]
        y = a * frame[0, 1] + b * frame[1, 1] + c * frame[2, 1]
        z = a * frame[0, 2] + b * frame[1, 2] + c * frame[2, 2]
        r = np.sqrt(x * x + y * y)
        fz, fr = (z - origin[0]) / cell, (r - origin[1]) / cell
        if fz < 0.0 or fr < 0.0 or fz >= labels.shape[0] or fr >= labels.shape[1]:
            continue
        k = labels[int(fz), int(fr)]
        if k < 0:
            continue
        nz, nr = normal[k, 0], normal[k, 1]
        dz, dr = z - centre[k, 0], r - centre[k, 1]
        t = (dz * nr - dr * nz) / spacing
        d = dz * nz + dr * nr - coefficients[k, 0] - t * (coefficients[k, 1] + t * coefficients[k, 2])
        w = weights[i] if weights.shape[0] > 0 else 1.0
        size = abs(d) * np.sqrt(w)
        if size >= limit:
            continue
        q = (size / limit) ** 2
        slope = (coefficients[k, 1] + 2.0 * t * coefficients[k, 2]) / spacing
        mz, mr = nz - slope * nr, nr + slope * nz
        cosine, sine = x / r, y / r
        g = z * mr - r * mz
        J[0], J[1], J[2], J[3] = -g * sine, g * cosine, mr * cosine, mr * sine
        for p in range(4):
            J[p] -= response[k, 0, p] + t * (response[k, 1, p] + t * response[k, 2, p])
        sector = int((np.arctan2(y, x) / (2.0 * np.pi) + 0.5) * SECTORS) % SECTORS
        w *= (1.0 - q) ** 2
        a, b, c = raw[i, 0] - points[i, 0], raw[i, 1] - points[i, 1], raw[i, 2] - points[i, 2]
        x = a * frame[0, 0] + b * frame[1, 0] + c * frame[2, 0]
        y = a * frame[0, 1] + b * frame[1, 1] + c * frame[2, 1]
        z = a * frame[0, 2] + b * frame[1, 2] + c * frame[2, 2]
        d += z * mz + (x * cosine + y * sine) * mr
        for p in range(4):
            scores[k, sector, p] += w * d * J[p]
            for e in range(p, 4):
                A[p, e] += w * J[p] * J[e]
    for p in range(4):
        for e in range(p):
            A[p, e] = A[e, p]
    return A


@dataclass
class Fit:
    """The state of a fit: frame (columns e1, e2, axis), place on the axis, noise, pieces and their curves."""

    frame: Floats
    place: Floats
    sigma: float
    pieces: Pieces
    coefficients: Floats
    response: Floats
    inliers: float
    steps: int


def _median_sigma(spread: Floats, top: float) -> float:
    """Robust standard deviation from the histogram of |d|."""
    total = np.cumsum(spread)
    if total[-1] <= 0:
        return top
    half = 0.5 * total[-1]
    k = int(np.searchsorted(total, half))
    below = total[k - 1] if k else 0.0
    return float(top * (k + (half - below) / max(spread[k], 1e-300)) / BINS / 0.6745)


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
) -> Fit:
    """Gauss-Newton from an axis; the pieces are found once, at the start. O(V) a step."""
    frame, place = frame_of(direction), place - direction * (place @ direction)
    bounds = meridian_bounds(points, frame, place, REACH)
    pieces = find_pieces(points, weights, frame, place, blur=blur, bounds=bounds)
    count = len(pieces.centre)
    coefficients = np.zeros((count, 3))
    response = np.zeros((count, 3, 4))
    gate = GATE * pieces.spacing
    noise = gate if sigma is None else sigma
    inliers, taken = 0.0, 0
    for _ in range(steps if count else 0):
        sums, spread = np.zeros((count, 34)), np.zeros(BINS)
        top = min(gate, 8 * noise)
        _accumulate(
            points, weights, frame, place, *_curve(pieces, coefficients), TUKEY * noise, top, sums, spread
        )
        H, g, offset, response = _eliminated(sums)
        step = -np.linalg.solve(H + 1e-12 * np.trace(H) * np.eye(4), g)
        turn = rotation_by(np.clip(step[:2], -0.2, 0.2))
        coefficients = coefficients + offset + np.einsum("kip,p->ki", response, step)
        frame = frame @ turn.T
        place = place - frame @ np.array([step[2], step[3], 0.0])
        noise = max(_median_sigma(spread, top), FLOOR)
        inliers, taken = float(sums[:, 0].sum()), taken + 1
        if np.abs(step).max() < SETTLED * noise:
            break
    return Fit(frame, place, noise, pieces, coefficients, response, inliers, taken)


def _curve(pieces: Pieces, coefficients: Floats) -> tuple[Any, ...]:
    """The generatrix as the kernels take it."""
    return (
        pieces.centre, pieces.normal, coefficients, pieces.labels, pieces.origin, pieces.cell, pieces.spacing
    )  # fmt: skip


def pose_covariance(points: Floats, raw: Floats, weights: Floats, fit: Fit) -> Floats:
    """4×4 covariance of (tilt, tilt, offset, offset) in the fit's frame, robust to correlated residuals.

    The sandwich of M-estimation (Huber) with scores summed over patches (Liang & Zeger): neighbours on the
    surface may share errors, patches may not.
    """
    scores = np.zeros((len(fit.pieces.centre), SECTORS, 4))
    A = _scores(
        points, raw, weights, fit.frame, fit.place, *_curve(fit.pieces, fit.coefficients), TUKEY * fit.sigma,
        fit.response, scores,
    )  # fmt: skip
    patches = scores.reshape(-1, 4)
    patches = patches[np.any(patches != 0.0, axis=1)]
    inverse = np.linalg.pinv(A, hermitian=True)
    share = len(patches) / max(len(patches) - 4.0, 1.0)
    return share * inverse @ (patches.T @ patches) @ inverse


def sharpness(points: Floats, weights: Floats, direction: Floats, place: Floats, *, blur: float) -> float:
    """How concentrated the points are in the (z, r) plane: the inverse of the area they fill (Rényi, order 2)."""
    frame, place = frame_of(direction), place - direction * (place @ direction)
    bounds = meridian_bounds(points, frame, place, REACH)
    density = density_field(points, weights, frame, place, blur, bounds)[0][:, :, 0]
    return float((density * density).sum() / max(density.sum(), 1e-300) ** 2)


def find_axis_profile(
    vertices_mm: Floats,
    faces: Ints32 | None,
    *,
    sigma_mm: Floats | None = None,
    seed: int = 0,  # noqa: ARG001 (nothing here is random)
    smoothing: int = 3,
) -> Axis:
    """Find the axis by fitting a free generatrix to all points.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite positions and (T, 3) indices.
    sigma_mm
        (V,) standard deviations; all alike where None.
    smoothing
        Rounds of averaging over neighbours before the fit, on dense meshes.

    Complexity: O(V + T).

    """
    cloud = canonical_cloud(vertices_mm, sigma_mm)
    points = cloud.points
    if faces is not None and len(faces):
        points = smoothed(points, faces, rounds=smoothing)
    cells, rows = voxel_moments(points, cloud.weights)
    candidates, evaluations = candidate_axes(surfels_of(cells, rows))
    means, counts = rows[:, 1:4] / rows[:, :1], rows[:, 0] / rows[:, 0].mean()
    fits = [refine(means, counts, a, c, blur=0.05, steps=3) for a, c, _ in candidates]
    rank = [sharpness(means, counts, f.frame[:, 2], f.place, blur=BLUR) for f in fits]
    fit = fits[int(np.argmax(rank))]
    for data, mass, steps in ((means, counts, 3), (points, cloud.weights, 3)):
        blur = max(BLUR, BLUR_PER_SIGMA * fit.sigma)
        fit = refine(data, mass, fit.frame[:, 2], fit.place, blur=blur, steps=steps, sigma=fit.sigma)
        evaluations += fit.steps
    return axis_of(cloud, fit, pose_covariance(points, cloud.points, cloud.weights, fit), evaluations)


def axis_of(cloud: Cloud, fit: Fit, covariance: Floats, evaluations: int) -> Axis:
    """Turn a fit in the canonical frame into an axis in the frame of the mesh."""
    direction = cloud.rotation @ fit.frame[:, 2]
    direction /= np.linalg.norm(direction) * np.sign(direction[np.argmax(np.abs(direction))])
    along = float(fit.frame[:, 2] @ fit.place)
    point = cloud.mean_mm + cloud.scale_mm * (cloud.rotation @ (fit.place - along * fit.frame[:, 2]))
    change = perpendicular_basis(direction).T @ cloud.rotation @ fit.frame[:, :2]
    move = np.eye(4)
    move[2, 1], move[3, 0] = -along, along  # the offset at the stated point, not at the fit's own
    turn = np.zeros((4, 4))
    turn[:2, :2], turn[2:, 2:] = change, cloud.scale_mm * change
    spread = turn @ move @ covariance @ move.T @ turn.T
    return Axis(point, direction, spread, "profile", evaluations)
