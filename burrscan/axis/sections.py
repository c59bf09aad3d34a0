"""Planar sections of a mesh and circles through them, as section 3.2 of the seed paper makes them."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.jit import kernel


def ransac_rounds(rejected: float, *, confidence: float = 0.99, sample: int = 3) -> float:
    """Samples needed so that one of them is free of outliers with the given confidence (section 3.2).

    N = log(1 - p) / log(1 - (1 - ε)^s), infinite where everything is rejected.
    """
    clean = (1.0 - rejected) ** sample
    if clean >= 1.0:
        return 0.0
    return float(np.log(1.0 - confidence) / np.log(1.0 - clean)) if clean > 0.0 else np.inf


def turned_to_z(theta: float, phi: float) -> Floats:
    """Rotation by -θ about z, then by -φ about y: takes the direction (θ, φ) to +z."""
    ct, st, cp, sp = np.cos(theta), np.sin(theta), np.cos(phi), np.sin(phi)
    return np.array([[cp * ct, cp * st, -sp], [-st, ct, 0.0], [sp * ct, sp * st, cp]])


@kernel
def _bags(
    vertices: Floats,
    faces: Ints32,
    turn: Floats,
    planes: int,
    every: bool,  # noqa: FBT001
) -> tuple[Floats, Ints]:
    """Average corners (x, y, z turned) of the triangles that a plane intersects, and the index of the plane.

    ``every`` keeps triangles whose corners' layers differ although their mean is an integer.
    """
    count = vertices.shape[0]
    height = np.empty(count)
    low, high = np.inf, -np.inf
    for i in range(count):
        d = turn[2, 0] * vertices[i, 0] + turn[2, 1] * vertices[i, 1] + turn[2, 2] * vertices[i, 2]
        height[i] = d
        low, high = min(low, d), max(high, d)
    step = (high - low) / planes
    layer = np.empty(count, dtype=np.int32)
    for i in range(count):
        layer[i] = int((height[i] - low) / step) if step > 0.0 else 0
    points = np.empty((faces.shape[0], 3))
    index = np.empty(faces.shape[0], dtype=np.int64)
    found = 0
    for t in range(faces.shape[0]):
        a, b, c = faces[t, 0], faces[t, 1], faces[t, 2]
        total = layer[a] + layer[b] + layer[c]
        apart = layer[a] != layer[b] or layer[b] != layer[c]
        if total % 3 == 0 and not (every and apart):
            continue
        plane = total // 3 + (1 if total % 3 else 0)
        if plane < 1 or plane > planes - 1:
            continue
        for k in range(3):
            s = 0.0
            for e in range(3):
                s += turn[k, e] * (vertices[a, e] + vertices[b, e] + vertices[c, e])
            points[found, k] = s / 3.0
        index[found] = plane
        found += 1
    return points[:found], index[:found]


@kernel
def kasa_circle(x: Floats, y: Floats) -> tuple[float, float, float]:
    """Least-squares circle without iteration: minimise Σ (x² + y² + Bx + Cy + D)² (Kåsa)."""
    n = x.shape[0]
    mx, my = x.mean(), y.mean()
    uu, uv, vv, uw, vw, w = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        u, v = x[i] - mx, y[i] - my
        q = u * u + v * v
        uu += u * u
        uv += u * v
        vv += v * v
        uw += u * q
        vw += v * q
        w += q
    det = 2.0 * (uu * vv - uv * uv)
    if not det > 1e-12 * (uu + vv) ** 2:
        return np.nan, np.nan, np.nan
    a, b = (uw * vv - vw * uv) / det, (vw * uu - uw * uv) / det
    return a + mx, b + my, np.sqrt(a * a + b * b + w / n)


@kernel
def taubin_circle(x: Floats, y: Floats) -> tuple[float, float, float]:
    """Taubin's circle by Newton's method (Chernov): hardly biased towards small circles on short arcs."""
    n = x.shape[0]
    mx, my = x.mean(), y.mean()
    xx, yy, xy, xz, yz, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(n):
        u, v = x[i] - mx, y[i] - my
        q = u * u + v * v
        xx += u * u / n
        yy += v * v / n
        xy += u * v / n
        xz += u * q / n
        yz += v * q / n
        zz += q * q / n
    z = xx + yy
    cov = xx * yy - xy * xy
    if not cov > 1e-14 * z * z:
        return np.nan, np.nan, np.nan
    var = zz - z * z
    a3 = 4.0 * z
    a2 = -3.0 * z * z - zz
    a1 = var * z + 4.0 * cov * z - xz * xz - yz * yz
    a0 = xz * (xz * yy - yz * xy) + yz * (yz * xx - xz * xy) - var * cov
    root = 0.0
    for _ in range(20):
        slope = a1 + root * (2.0 * a2 + 3.0 * a3 * root)
        fresh = root - (a0 + root * (a1 + root * (a2 + root * a3))) / slope
        if not abs(fresh - root) > 1e-12 * z:
            break
        root = fresh
    det = 2.0 * (root * root - root * z + cov)
    a, b = (xz * (yy - root) - yz * xy) / det, (yz * (xx - root) - xz * xy) / det
    return a + mx, b + my, np.sqrt(a * a + b * b + z)


@kernel
def _random(state: Ints) -> float:
    """Uniform in [0, 1): a 31-bit Lehmer generator, so that a section costs no generator object."""
    state[0] = (state[0] * 48271) % 2147483647
    return float(state[0] / 2147483647.0)


@kernel
def robust_circle(  # noqa: C901
    x: Floats,
    y: Floats,
    tolerance: float,
    rounds: int,
    best_so_far: bool,  # noqa: FBT001
    taubin: bool,  # noqa: FBT001
    state: Ints,
) -> tuple[float, float, float, float, float]:
    """Circle by RANSAC, then by least squares without the outliers.

    ``rounds`` > 0 is a fixed number of samples; 0 lets each sample's share of outliers set it (section 3.2),
    or with ``best_so_far`` the least share yet. Returns centre, radius, share rejected, samples taken.
    """
    n = x.shape[0]
    needed = float(rounds) if rounds > 0 else np.inf
    best, ba, bb, br = -1, 0.0, 0.0, 0.0
    least = 1.0
    taken = 0
    while taken < needed and taken < 100:
        i, j, k = int(n * _random(state)), int(n * _random(state)), int(n * _random(state))
        taken += 1
        pick = np.array([i, j, k])
        a, b, r = kasa_circle(x[pick], y[pick])
        if not np.isfinite(r):
            continue
        inside = 0
        for m in range(n):
            if abs(np.sqrt((x[m] - a) ** 2 + (y[m] - b) ** 2) - r) <= tolerance:
                inside += 1
        if inside > best:
            best, ba, bb, br = inside, a, b, r
        rejected = 1.0 - inside / n
        least = min(least, rejected)
        if rounds == 0:
            clean = (1.0 - (least if best_so_far else rejected)) ** 3
            if clean >= 1.0:
                needed = 0.0
            elif clean > 0.0:
                needed = np.log(0.01) / np.log(1.0 - clean)
    if best < 3:
        return np.nan, np.nan, np.nan, 1.0, float(taken)
    keep = np.abs(np.sqrt((x - ba) ** 2 + (y - bb) ** 2) - br) <= tolerance
    if taubin:
        a, b, r = taubin_circle(x[keep], y[keep])
    else:
        a, b, r = kasa_circle(x[keep], y[keep])
    return a, b, r, 1.0 - best / n, float(taken)


@kernel
def fit_circles(
    points: Floats,
    index: Ints,
    planes: int,
    tolerance: float,
    rounds: int,
    best_so_far: bool,  # noqa: FBT001
    taubin: bool,  # noqa: FBT001
    state: Ints,
) -> Floats:
    """A circle per plane: rows (x, y, height, radius, mean distance, capped mean distance, points, rejected).

    NaN where a plane meets fewer than four triangles. The capped mean counts no distance beyond the
    tolerance.
    """
    circles = np.full((planes + 1, 8), np.nan)
    for plane in range(1, planes):
        bag = np.nonzero(index == plane)[0]
        if bag.shape[0] < 4:
            continue
        x, y = points[bag, 0], points[bag, 1]
        a, b, r, rejected, _ = robust_circle(x, y, tolerance, rounds, best_so_far, taubin, state)
        if not np.isfinite(r):
            continue
        mean, capped = 0.0, 0.0
        for m in range(x.shape[0]):
            d = abs(np.sqrt((x[m] - a) ** 2 + (y[m] - b) ** 2) - r)
            mean += d
            capped += min(d, tolerance)
        n = x.shape[0]
        circles[plane, 0], circles[plane, 1], circles[plane, 2] = a, b, points[bag, 2].mean()
        circles[plane, 3], circles[plane, 4], circles[plane, 5] = r, mean / n, capped / n
        circles[plane, 6], circles[plane, 7] = n, rejected
    return circles


def sections(
    vertices_mm: Floats, faces: Ints32, turn: Floats, *, planes: int, every: bool = False
) -> tuple[Floats, Ints]:
    """The intersection points of P + 1 parallel planes with a mesh by the layer trick (section 3.2).

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) and (T, 3).
    turn
        (3, 3) rotation that takes the direction of the planes' normals to +z.
    planes
        P; the planes are spread evenly over the extent, the first and the last one meet one vertex only.
    every
        Mends the paper's test (mean layer not an integer), which misses triangles that span three layers
        evenly.

    Returns
    -------
    (M, 3) mean corners of the intersected triangles in the turned frame, and (M,) the plane, 1 to P - 1. O(V
    + T).

    """
    points, index = _bags(vertices_mm, faces, turn, planes, every)
    return points, index
