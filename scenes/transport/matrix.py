"""The traced light transport of one scene, and relighting as a sparse product.

Light is linear: ``image = T · pattern``. Direct and interreflected light are kept apart, so a decoder's
errors can be traced to one or the other, and truth (which projector pixel lit this camera pixel) comes for
free. The unit of light is a perfect white diffuser at the rig's standoff, facing camera and projector, under
full white.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba as nb
import numpy as np

from burrscan.arrays import Floats32, Ints, Ints32, freeze

_BLOCK = 256  # camera pixels relit together: their accumulators stay in the L1 cache


@dataclass(frozen=True)
class SparseRows:
    """A sparse matrix in CSR form: a row per camera pixel, a column per projector pixel.

    Parameters
    ----------
    starts
        (pixels + 1,) first entry of each row.
    columns
        (nnz,) flat projector pixel of each entry.
    values
        (nnz,) light of each entry.

    """

    starts: Ints
    columns: Ints32
    values: Floats32

    def __post_init__(self) -> None:
        freeze(self, starts=self.starts, columns=self.columns, values=self.values)

    def row_sums(self) -> Floats32:
        """Light of each camera pixel under an all-white projector, (pixels,)."""
        sums: Floats32 = _row_sums(self.starts, self.values)
        return sums


@dataclass(frozen=True)
class LightTransport:
    """How light gets from each projector pixel to each camera pixel.

    Parameters
    ----------
    camera_shape, projector_shape
        Rows and columns of both.
    direct, indirect
        Light that met the surface once, and more often.
    ambient
        (h, w) light under a uniform surround of radiance 1 (of the white diffuser), by paths that meet one
        surface fewer than the projector's.
    u_px, v_px
        (h, w) the projector coordinate of each camera pixel, weighted by the direct light of its samples; NaN
        where no direct light arrives.
    spread_px
        (h, w) standard deviation of the projector column over the direct light of each camera pixel: 0.29 for
        a footprint one projector pixel wide, large on depth edges.

    """

    camera_shape: tuple[int, int]
    projector_shape: tuple[int, int]
    direct: SparseRows
    indirect: SparseRows
    ambient: Floats32
    u_px: Floats32
    v_px: Floats32
    spread_px: Floats32

    def __post_init__(self) -> None:
        freeze(self, ambient=self.ambient, u_px=self.u_px, v_px=self.v_px, spread_px=self.spread_px)

    def relight(self, light: Floats32) -> Floats32:
        """Images of the scene under projected light.

        Parameters
        ----------
        light
            (F, H, W) light of each projector pixel relative to full white. An array broadcast along the rows
            (stride 0) is used as it is, and is faster.

        Returns
        -------
        (F, h, w) light per camera pixel. O(F × nnz), split over threads by pixel; the result does not depend
        on their number.

        """
        frames = light.shape[0]
        columns_only = light.strides[1] == 0
        table = np.ascontiguousarray((light[:, 0] if columns_only else light.reshape(frames, -1)).T)
        images = np.zeros((frames, int(np.prod(self.camera_shape))), np.float32)
        period = self.projector_shape[1] if columns_only else 0
        for part in (self.direct, self.indirect):
            _add_product(part.starts, part.columns, part.values, table, period, images)
        return images.reshape(frames, *self.camera_shape)

    @cached_property
    def white_direct(self) -> Floats32:
        """Light of each camera pixel, (h, w), under full white, without interreflections."""
        return self.direct.row_sums().reshape(self.camera_shape)

    @cached_property
    def white_indirect(self) -> Floats32:
        """Interreflected light of each camera pixel, (h, w), under full white."""
        return self.indirect.row_sums().reshape(self.camera_shape)


@nb.njit(cache=True, parallel=True)
def _row_sums(starts: Ints, values: Floats32) -> Floats32:
    sums = np.empty(starts.size - 1, np.float32)
    for p in nb.prange(starts.size - 1):
        total = 0.0
        for k in range(starts[p], starts[p + 1]):
            total += values[k]
        sums[p] = total
    return sums


@nb.njit(cache=True, parallel=True, fastmath={"contract", "nnan", "ninf"})
def _add_product(
    starts: Ints, columns: Ints32, values: Floats32, table: Floats32, period: int, images: Floats32
) -> None:
    """Add rows × table to images; ``period`` > 0 says that the table holds one row of projector columns."""
    pixels = starts.size - 1
    frames = table.shape[1]
    for b in nb.prange((pixels + _BLOCK - 1) // _BLOCK):
        first, last = b * _BLOCK, min((b + 1) * _BLOCK, pixels)
        if starts[last] == starts[first]:
            continue
        sums = np.zeros((last - first, frames), np.float32)
        for p in range(first, last):
            for k in range(starts[p], starts[p + 1]):
                column = columns[k] % period if period else columns[k]
                value = values[k]
                for f in range(frames):
                    sums[p - first, f] += value * table[column, f]
        for f in range(frames):
            for p in range(first, last):
                images[f, p] += sums[p - first, f]
