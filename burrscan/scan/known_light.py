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
from burrscan.scan.sequence import Sequence
from burrscan.scanner import Patterns

_GAUSS = 0.5 / np.sqrt(3.0)
_LONGEST_STEP_PX = 2.0


def light_bias_px(
    u_px: Floats32, v_px: Floats, shown: Patterns, code: Sequence, *, sheet: ProjectorSheet
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
    first = 2 * len(code.bits)
    levels = np.ascontiguousarray(np.moveaxis(shown.frames[first:], 0, -1))
    bias: Floats32 = _bias(
        u_px.astype(np.float64),
        v_px,
        _slopes(u_px),
        _slopes(v_px),
        levels,
        sheet.light,
        np.array(code.periods_px),
    )
    return bias


def _slopes(values: Floats | Floats32) -> Floats32:
    """(2, h, w) change per row and per column, 0 where unknown, bounded at jumps."""
    per_row, per_column = np.gradient(values)
    slopes = np.nan_to_num(np.stack([per_row, per_column]).astype(np.float32))
    bounded: Floats32 = np.clip(slopes, -_LONGEST_STEP_PX, _LONGEST_STEP_PX)
    return bounded


@njit(cache=True, parallel=True, nogil=True)
def _bias(  # noqa: PLR0917 (a kernel)
    u_px: Floats,
    v_px: Floats,
    du: Floats32,
    dv: Floats32,
    levels: Levels,
    light: Floats,
    periods: Floats,
) -> Floats32:
    height, width = u_px.shape
    rows, columns, frames = levels.shape
    steps = frames // len(periods)
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
                    for f in range(frames):
                        seen[f] += (
                            w00 * light[levels[y, x, f]]
                            + w01 * light[levels[y, x + 1, f]]
                            + w10 * light[levels[y + 1, x, f]]
                            + w11 * light[levels[y + 1, x + 1, f]]
                        )
            total, weights = 0.0, 0.0
            for j in range(len(periods)):
                a, b = 0.0, 0.0
                turn = 2.0 * np.pi * u0 / periods[j]
                for n in range(steps):
                    a += seen[j * steps + n] * np.cos(2.0 * np.pi * n / steps - turn)
                    b += seen[j * steps + n] * np.sin(2.0 * np.pi * n / steps - turn)
                weight = (a * a + b * b) / periods[j] ** 2
                total += weight * np.arctan2(b, a) * periods[j] / (2.0 * np.pi)
                weights += weight
            out[r, c] = total / weights
    return out
