"""What the light that was really projected does to a phase, removed.

An adapted pattern is not quite a sine: its intensity changes across a camera pixel's footprint, it is rounded
to 8 bits, and the projector's black level lifts its dark ends. All of it is known. So each pixel's phase is
computed once more from the projected frames, as its footprint would average them, and the difference between
that phase and the column it was computed at is the bias.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from burrscan.arrays import Floats, Floats32, Levels
from burrscan.devices import ProjectorSheet
from burrscan.scan.stripes import Stripes
from burrscan.scanner import Patterns

_GAUSS = 0.5 / np.sqrt(3.0)
_LONGEST_STEP_PX = 2.0


def light_bias_px(
    u_px: Floats32, v_px: Floats32, shown: Patterns, code: Stripes, *, sheet: ProjectorSheet
) -> Floats32:
    """Error (h, w) of the fused column that the projected frames cause, NaN where u or v is.

    Parameters
    ----------
    u_px, v_px
        (h, w) where each camera pixel looks.
    shown, code
        The levels as projected, and the sequence they stand for.
    sheet
        Gives each level's light.

    Notes
    -----
    The footprint is the camera pixel's square through the local slopes of u and v, sampled at 2×2 Gauss
    points, each interpolated between four projector pixels. Exact for intensities that are linear across the
    footprint. O(pixels · frames · 16).

    """
    levels = np.ascontiguousarray(np.moveaxis(shown.frames, 0, -1))
    bias: Floats32 = _bias(
        u_px.astype(np.float64),
        v_px.astype(np.float64),
        _slopes(u_px),
        _slopes(v_px),
        levels,
        sheet.light,
        2.0 * np.pi * code.per_column,
        2.0 * np.pi * code.per_row,
    )
    return bias


def _slopes(values: Floats | Floats32) -> Floats32:
    """(2, h, w) change per row and per column, 0 where unknown, bounded at jumps."""
    per_row, per_column = np.gradient(values)
    slopes = np.nan_to_num(np.stack([per_row, per_column]).astype(np.float32))
    bounded: Floats32 = np.clip(slopes, -_LONGEST_STEP_PX, _LONGEST_STEP_PX)
    return bounded


@njit(cache=True, parallel=True, nogil=True)
def _bias(
    u_px: Floats,
    v_px: Floats,
    du: Floats32,
    dv: Floats32,
    levels: Levels,
    light: Floats,
    f: Floats,
    g: Floats,
) -> Floats32:
    height, width = u_px.shape
    rows, columns, frames = levels.shape
    steps = frames // len(f)
    out = np.full((height, width), np.nan, np.float32)
    for r in prange(height):
        seen = np.empty(frames)
        for c in range(width):
            u0, v0 = u_px[r, c], v_px[r, c]
            if not (np.isfinite(u0) and np.isfinite(v0)):
                continue
            seen[:] = 0.0
            for dy in (-_GAUSS, _GAUSS):
                for dx in (-_GAUSS, _GAUSS):
                    u = min(max(u0 + dy * du[0, r, c] + dx * du[1, r, c], 0.0), columns - 1.001)
                    v = min(max(v0 + dy * dv[0, r, c] + dx * dv[1, r, c], 0.0), rows - 1.001)
                    x, y = int(u), int(v)
                    s, t = u - x, v - y
                    w00, w01, w10, w11 = (1 - t) * (1 - s), (1 - t) * s, t * (1 - s), t * s
                    for i in range(frames):
                        seen[i] += (
                            w00 * light[levels[y, x, i]]
                            + w01 * light[levels[y, x + 1, i]]
                            + w10 * light[levels[y + 1, x, i]]
                            + w11 * light[levels[y + 1, x + 1, i]]
                        )
            auu, auv, avv, bu, bv = 0.0, 0.0, 0.0, 0.0, 0.0
            for j in range(len(f)):
                a, b = 0.0, 0.0
                turn = f[j] * u0 + g[j] * v0
                for n in range(steps):
                    a += seen[j * steps + n] * np.cos(2.0 * np.pi * n / steps - turn)
                    b += seen[j * steps + n] * np.sin(2.0 * np.pi * n / steps - turn)
                # the same fit of column and row as the reading's
                auu += f[j] * f[j]
                auv += f[j] * g[j]
                avv += g[j] * g[j]
                bu += f[j] * np.arctan2(b, a)
                bv += g[j] * np.arctan2(b, a)
            out[r, c] = (avv * bu - auv * bv) / (auu * avv - auv * auv)
    return out
