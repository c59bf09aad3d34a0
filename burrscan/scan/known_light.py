"""What the light that was really projected does to a phase, removed.

An adapted pattern is not quite a sine: its intensity changes across a camera pixel's footprint, it is rounded
to 8 bits, and the projector's black level lifts its dark ends. All of it is known. So each pixel's phase is
computed once more from the projected frames, as its footprint would average them, and the difference between
that phase and that of even light is the bias.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Floats, Floats32, Levels
from burrscan.devices import ProjectorSheet
from burrscan.scan.lens import blurred
from burrscan.scan.matching.phasors import turns_of
from burrscan.scan.stripes import Stripes
from burrscan.scanner import Patterns

_GAUSS = 0.5 * np.sqrt(0.6)
"""Outer node of the three-point Gauss rule on -½ .. ½: beside a lobe light changes twofold in a pixel."""
_RULE = ((-_GAUSS, 5.0 / 18.0), (0.0, 8.0 / 18.0), (_GAUSS, 5.0 / 18.0))
"""Its nodes and weights."""
_NODES = tuple((dy, dx, wy * wx) for dy, wy in _RULE for dx, wx in _RULE)
"""Down, across, and weight."""
_STEEPEST = 2.0
"""Projector px, or log radiance, per camera px: what changes more is a jump, and no slope of a footprint."""


def light_bias_px(
    u_px: Floats32,
    v_px: Floats32,
    radiance: Floats32,
    shown: Patterns,
    code: Stripes,
    *,
    sheet: ProjectorSheet,
    circles_px: Floats32,
) -> Floats32:
    """Error (h, w) of the fused column that the projected frames cause, NaN where u or v is.

    Parameters
    ----------
    u_px, v_px
        (h, w) where each camera pixel looks.
    radiance
        (h, w) what each camera pixel sees of white light: metal that shines more at one side of a footprint
        weighs more there.
    shown, code
        The levels as projected, and the sequence they stand for.
    sheet
        Gives each level's light.
    circles_px
        (h, w) diameters of the blur circles of a projector out of focus, 0 in focus. They are taken to the
        next whole pixel.

    Notes
    -----
    The footprint is the camera pixel's square through the local slopes of u and v, sampled at 3×3 Gauss
    points, each interpolated between four projector pixels, on metal whose brightness changes exponentially.
    The column that even light would have been read at is the centre of that brightness: no bias.
    O(pixels · frames · 36), as often as there are circles.

    """
    levels = np.ascontiguousarray(np.moveaxis(shown.frames, 0, -1))
    log_gain = np.log(np.maximum(radiance, np.float32(1e-12)))
    light, f, g = sheet.light.astype(np.float32), 2.0 * np.pi * code.per_column, 2.0 * np.pi * code.per_row
    whole = np.rint(circles_px)
    bias: Floats32 = _bias(u_px, v_px, log_gain, levels, light, f, g)
    for circle in np.unique(whole[whole > 0.0]):
        through = _bias(u_px, v_px, log_gain, *blurred(levels, light, circle_px=float(circle)), f, g)
        bias = np.where(whole == circle, through, bias)
    return bias


@njit(cache=True, nogil=True)
def _slope(values: Floats32, r: int, c: int, dr: int, dc: int) -> float:
    """Change per row (dr, dc = 1, 0) or column (0, 1) at a known pixel, by the neighbours that are known.

    0 where none is, bounded at jumps.
    """
    height, width = values.shape
    r0, c0 = max(r - dr, 0), max(c - dc, 0)
    r1, c1 = min(r + dr, height - 1), min(c + dc, width - 1)
    if not np.isfinite(values[r0, c0]):
        r0, c0 = r, c
    if not np.isfinite(values[r1, c1]):
        r1, c1 = r, c
    slope: float = (values[r1, c1] - values[r0, c0]) / max(r1 - r0 + c1 - c0, 1)
    bounded: float = min(max(slope, -_STEEPEST), _STEEPEST)
    return bounded


@njit(cache=True, parallel=True, nogil=True)
def _bias(
    u_px: Floats32,
    v_px: Floats32,
    log_gain: Floats32,
    levels: Levels,
    light: Floats32,
    f: Floats,
    g: Floats,
) -> Floats32:
    height, width = u_px.shape
    rows, columns, frames = levels.shape
    turns = turns_of(frames // len(f))
    out = np.full((height, width), np.nan, np.float32)
    for r in prange(height):
        seen = np.empty(frames, np.float32)
        for c in range(width):
            u0, v0 = float(u_px[r, c]), float(v_px[r, c])
            if not (np.isfinite(u0) and np.isfinite(v0)):
                continue
            # the loop's own index is unsigned
            y, x = np.int64(r), np.int64(c)
            du_down, du_across = _slope(u_px, y, x, 1, 0), _slope(u_px, y, x, 0, 1)
            dv_down, dv_across = _slope(v_px, y, x, 1, 0), _slope(v_px, y, x, 0, 1)
            dg_down, dg_across = _slope(log_gain, y, x, 1, 0), _slope(log_gain, y, x, 0, 1)
            seen[:] = np.float32(0.0)
            total, aside = 0.0, 0.0
            for dy, dx, weight in _NODES:
                u = min(max(u0 + dy * du_down + dx * du_across, 0.0), columns - 1.001)
                v = min(max(v0 + dy * dv_down + dx * dv_across, 0.0), rows - 1.001)
                gain = weight * np.exp(dy * dg_down + dx * dg_across)
                _add_light(levels, light, u, v, gain, seen)
                total += gain
                aside += gain * (u - u0)
            out[r, c] = _shift(seen, turns, f, g, u0, v0) - aside / total
    return out


@njit(cache=True, nogil=True, inline="always")
def _add_light(levels: Levels, light: Floats32, u: float, v: float, weight: float, seen: Floats32) -> None:
    """Add each frame's light at a point, interpolated between four projector pixels."""
    x, y = int(u), int(v)
    s, t = np.float32(u - x), np.float32(v - y)
    one, w = np.float32(1.0), np.float32(weight)
    w00, w01, w10, w11 = w * (one - t) * (one - s), w * (one - t) * s, w * t * (one - s), w * t * s
    for i in range(len(seen)):
        upper = w00 * light[levels[y, x, i]] + w01 * light[levels[y, x + 1, i]]
        lower = w10 * light[levels[y + 1, x, i]] + w11 * light[levels[y + 1, x + 1, i]]
        seen[i] += upper + lower


@njit(cache=True, nogil=True)
def _shift(seen: Floats32, turns: Floats, f: Floats, g: Floats, u: float, v: float) -> float:
    """Column at which the light was seen, less ``u``, by the same fit of column and row as the reading's."""
    steps = turns.shape[1]
    auu, auv, avv, bu, bv = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(len(f)):
        a, b = 0.0, 0.0
        for n in range(steps):
            a += seen[j * steps + n] * turns[0, n]
            b += seen[j * steps + n] * turns[1, n]
        turn = f[j] * u + g[j] * v
        cosine, sine = np.cos(turn), np.sin(turn)
        apart = np.arctan2(b * cosine - a * sine, a * cosine + b * sine)
        auu += f[j] * f[j]
        auv += f[j] * g[j]
        avv += g[j] * g[j]
        bu += f[j] * apart
        bv += g[j] * apart
    return (avv * bu - auv * bv) / (auu * avv - auv * auv)
