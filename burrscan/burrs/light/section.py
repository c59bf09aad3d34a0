"""What a straight burr would show across itself: the light that comes directly, and that of one more bounce.

The part is cut square to its axis: a circle, and on it a triangle that stands up or is cut in. A burr along
the axis turns no ray out of that plane but by what the ray had of the axis before, so two dimensions are
exact for its light. Depth is told by the projector's columns, which are planes; where the baseline lies
along the burr they are square to it, and only how far light went along the axis moves it over them.
Materials are told by what was measured: the brightness of a parallel over the tilt between its normal and
the half-way direction is the lobe (Torrance & Sparrow 1967), and as shares of one the same lobe spreads
what a facet mirrors.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats

TILTS_DEG = np.arange(-90.0, 91.0)
"""Where a lobe is tabled: every degree, which the kernels count on."""
BOUNCE_TILTS_DEG = np.arange(-40.0, 41.0, 4.0)
"""Tilts of the micro-facets that a mirrored ray is followed for; lobes of metals end before."""
_REFLECTANCE = 0.8
"""Of a metal, for the second bounce: iron 0.6, aluminium 0.9; the logarithm of the light hardly notices."""
_LIGHT_SIGMA = 1.0
"""Error of the model's logarithm of light: flanks are no planes, and third bounces are left out."""
_MOST_LIGHT, _MOST_DEPTH = 4.0, 9.0
"""Squares of deviations are cut off here: what the model cannot show at all says nothing of the side."""
_FAR = 30.0
"""Misfit beyond the best from which one is as good as another: a likelihood of e^-15."""
_OFF_MM = 1e-3
"""A ray starts so far off its surface, not to meet it again."""


@njit(cache=True, nogil=True)
def _first(x: float, y: float, dx: float, dy: float, burr: Floats) -> tuple[float, int]:
    """Distance to what a ray meets first, and which: 0 the circle, 1 and 2 the flanks, -1 nothing.

    ``burr`` holds radius, angle, half the angle of its mouth, and x, y of the flanks' three corners.
    """
    nearest, met = np.inf, -1
    b, c = x * dx + y * dy, x * x + y * y - burr[0] ** 2
    if b * b > c:
        root = np.sqrt(b * b - c)
        for t in (-b - root, -b + root):
            turn = np.arctan2(y + t * dy, x + t * dx) - burr[1]
            if _OFF_MM < t < nearest and abs(_wrapped(turn)) >= burr[2]:
                nearest, met = t, 0
    for flank in (1, 2):
        k = 1 + 2 * flank
        x1, y1, x2, y2 = burr[k], burr[k + 1], burr[k + 2], burr[k + 3]
        det = dy * (x2 - x1) - dx * (y2 - y1)
        if det == 0.0:
            continue
        t = ((y1 - y) * (x2 - x1) - (x1 - x) * (y2 - y1)) / det
        share = (dx * (y1 - y) - dy * (x1 - x)) / det
        if _OFF_MM < t < nearest and 0.0 <= share <= 1.0:
            nearest, met = t, flank
    return nearest, met


@njit(cache=True, nogil=True)
def _wrapped(turn: float) -> float:
    return float((turn + np.pi) % (2.0 * np.pi) - np.pi)


@njit(cache=True, nogil=True)
def _normal(x: float, y: float, met: int, burr: Floats) -> float:
    """Angle of the outward normal."""
    if met == 0:
        return float(np.arctan2(y, x))
    k = 1 + 2 * met
    return float(np.arctan2(burr[k] - burr[k + 2], burr[k + 3] - burr[k + 1]))


@njit(cache=True, nogil=True)
def _shone(
    x: float, y: float, met: int, dx: float, dy: float, burr: Floats, lobes: Floats, projector: Floats
) -> float:
    """Brightness of a point to whom looks along (dx, dy); 0 where the projector does not reach it."""
    normal = _normal(x, y, met, burr)
    nx, ny = np.cos(normal), np.sin(normal)
    lx, ly = projector[0] - x, projector[1] - y
    far = np.hypot(lx, ly)
    lx, ly = lx / far, ly / far
    if lx * nx + ly * ny <= 0.0 or dx * nx + dy * ny >= 0.0:
        return 0.0
    if _first(x + _OFF_MM * nx, y + _OFF_MM * ny, lx, ly, burr)[0] < far:
        return 0.0
    place = 90.0 + np.degrees(_wrapped(normal - np.arctan2(ly - dy, lx - dx)))
    place = min(max(place, 0.0), 180.0)
    k = min(int(place), 179)
    lobe = lobes[min(met, 1)]
    return float(lobe[k] + (place - k) * (lobe[k + 1] - lobe[k]))


@njit(cache=True, nogil=True)
def seen(
    angle: float,
    burr: Floats,
    lobes: Floats,
    bounces: Floats,
    camera: Floats,
    projector: Floats,
    square: Floats,
) -> tuple[float, float, float]:
    """What the pixel that looks at a cell of the bare circle sees.

    Parameters
    ----------
    angle
        Of the cell, radians.
    burr
        (9,) as :func:`shaped` gives it.
    lobes, bounces
        (2, 181) brightness over :data:`TILTS_DEG`, of circle and flanks; (2, 21) shares of what is mirrored
        over :data:`BOUNCE_TILTS_DEG`.
    camera, projector
        (3,) their centres, mm; the burr's row is at z = 0.
    square
        (3, 2) two directions square to the projector's columns and to each other
        (:func:`burrscan.axis.basis.perpendicular_basis`).

    Returns
    -------
    tuple
        Its light; the deviation from the circle, mm, that the mean column of the light shows; and by how much
        that differs where the column is one standard deviation of the light's columns further on.

    """
    bx, by = burr[0] * np.cos(angle), burr[0] * np.sin(angle)
    vx, vy = bx - camera[0], by - camera[1]
    far = np.hypot(vx, vy)
    vx, vy, vz = vx / far, vy / far, -camera[2] / far
    t, met = _first(camera[0], camera[1], vx, vy, burr)
    if met < 0:
        return 0.0, 0.0, 0.0
    x, y, z = camera[0] + t * vx, camera[1] + t * vy, camera[2] + t * vz
    straight = column_of(bx, by, 0.0, projector, square)
    light = _shone(x, y, met, vx, vy, burr, lobes, projector)
    turn = _wrapped(column_of(x, y, z, projector, square) - straight)
    once, twice = light * turn, light * turn * turn
    normal = _normal(x, y, met, burr)
    nx, ny = np.cos(normal), np.sin(normal)
    for k in range(BOUNCE_TILTS_DEG.size):
        facet = normal + np.radians(BOUNCE_TILTS_DEG[k])
        mx, my = np.cos(facet), np.sin(facet)
        along = vx * mx + vy * my
        rx, ry = vx - 2.0 * along * mx, vy - 2.0 * along * my
        if along >= 0.0 or rx * nx + ry * ny <= 0.0:
            continue
        t, other = _first(x + _OFF_MM * nx, y + _OFF_MM * ny, rx, ry, burr)
        if other < 0:
            continue
        sx, sy = x + t * rx, y + t * ry
        more = _REFLECTANCE * bounces[min(met, 1), k] * _shone(sx, sy, other, rx, ry, burr, lobes, projector)
        turn = _wrapped(column_of(sx, sy, z + t * vz, projector, square) - straight)
        light, once, twice = light + more, once + more * turn, twice + more * turn * turn
    if light == 0.0:
        return 0.0, 0.0, 0.0
    mean = once / light
    spread = np.sqrt(max(twice / light - mean * mean, 0.0))
    ray = np.array([vx, vy, vz])
    at = triangulated(camera, ray, projector, square, straight + mean) - burr[0]
    further = triangulated(camera, ray, projector, square, straight + mean + spread) - burr[0]
    return light, at, abs(further - at)


@njit(cache=True, nogil=True)
def column_of(x: float, y: float, z: float, projector: Floats, square: Floats) -> float:
    """Angle of the projector's column through a place, about the line of its centre along the columns."""
    dx, dy, dz = x - projector[0], y - projector[1], z - projector[2]
    along = square[0, 0] * dx + square[1, 0] * dy + square[2, 0] * dz
    across = square[0, 1] * dx + square[1, 1] * dy + square[2, 1] * dz
    return float(np.arctan2(across, along))


@njit(cache=True, nogil=True)
def triangulated(camera: Floats, ray: Floats, projector: Floats, square: Floats, column: float) -> float:
    """Radius at which the camera's ray (3,) meets the projector's column of some angle."""
    over, under = 0.0, 0.0
    for k in range(3):
        normal = np.cos(column) * square[k, 1] - np.sin(column) * square[k, 0]
        over += normal * (projector[k] - camera[k])
        under += normal * ray[k]
    t = over / under
    return float(np.hypot(camera[0] + t * ray[0], camera[1] + t * ray[1]))


@njit(cache=True, nogil=True)
def shaped(radius: float, angle: float, width: float, height: float) -> Floats:
    """A triangle of a width, mm, at an angle of the circle; its height, mm, is below 0 for a nick."""
    half = 0.5 * width / radius
    burr = np.empty(9)
    burr[0], burr[1], burr[2] = radius, angle, half
    for k in range(3):
        r, a = radius + height * (k == 1), angle + (k - 1) * half
        burr[3 + 2 * k], burr[4 + 2 * k] = r * np.cos(a), r * np.sin(a)
    return burr


@njit(cache=True, nogil=True)
def misfits(
    angles: Floats,
    light: Floats,
    deviation: Floats,
    measured: Floats,
    r: float,
    centres: Floats,
    widths: Floats,
    aspects: Floats,
    lobes: Floats,
    bounces: Floats,
    floor: float,
    camera: Floats,
    projector: Floats,
    square: Floats,
    depth_sigma: float,
) -> tuple[Floats, Floats]:
    """Misfits of ridges and nicks, sums of squares in sigmas.

    (2, widths, aspects) at their best centres, and (2, centres) at the best width and aspect.

    Parameters
    ----------
    angles, light, deviation, measured
        (columns,) cells across the burr, the logarithm of their light, their depth, mm, each NaN where it is
        not known, and the share of the rows that know the depth.
    r
        Radius of the circle, mm.
    centres, widths, aspects
        Angles, mm, and heights over widths that are tried.
    lobes, bounces, camera, projector, square
        As of :func:`seen`.
    floor
        Light that is everywhere.
    depth_sigma
        Error of the model's depth, mm.

    Notes
    -----
    In the file of what it calls: numba's cache does not notice when a kernel of another file changes. What is
    beyond all hope of its kind is not followed to its end: it is :data:`_FAR` worse than the best, or more.

    """
    found = np.full((2, widths.size, aspects.size), np.inf)
    there = np.full((2, centres.size), np.inf)
    best = np.full(2, np.inf)
    for c in range(centres.size):
        for i in range(widths.size):
            for k in range(aspects.size):
                for nick in range(2):
                    burr = shaped(r, centres[c], widths[i], (1 - 2 * nick) * aspects[k] * widths[i])
                    limit = min(max(found[nick, i, k], there[nick, c]), best[nick] + _FAR)
                    misfit = 0.0
                    for j in range(angles.size):
                        shone, depth, spread = seen(
                            angles[j], burr, lobes, bounces, camera, projector, square
                        )
                        if np.isfinite(light[j]):
                            z = (np.log(shone + floor) - light[j]) / _LIGHT_SIGMA
                            misfit += min(z * z, _MOST_LIGHT)
                        if measured[j] > 0.0 and shone > 0.0:
                            z = (depth - deviation[j]) / np.hypot(depth_sigma, spread)
                            misfit += measured[j] * min(z * z, _MOST_DEPTH)
                        if misfit >= limit:
                            break
                    found[nick, i, k] = min(found[nick, i, k], misfit)
                    there[nick, c] = min(there[nick, c], misfit)
                    best[nick] = min(best[nick], misfit)
    return found, there
