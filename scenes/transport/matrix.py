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

from burrscan.arrays import Floats32, freeze
from scenes.transport.rows import SparseRows

_FRAMES = 16
"""Relit together, where every projector pixel has light of its own: a line of the cache for each."""
_BLOCK = 1024
"""Projector pixels that are put in order at a time: with their frames an eighth of a level-two cache."""


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
    indirect_sigma
        (h, w) standard error of the interreflected light under full white, from the tracing.

    """

    camera_shape: tuple[int, int]
    projector_shape: tuple[int, int]
    direct: SparseRows
    indirect: SparseRows
    ambient: Floats32
    u_px: Floats32
    v_px: Floats32
    spread_px: Floats32
    indirect_sigma: Floats32

    def __post_init__(self) -> None:
        freeze(self, ambient=self.ambient, u_px=self.u_px, v_px=self.v_px, spread_px=self.spread_px)
        freeze(self, indirect_sigma=self.indirect_sigma)

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
        flat = np.ascontiguousarray(light[:, 0]) if columns_only else light.reshape(frames, -1)
        together = frames if columns_only else min(_FRAMES, frames)
        room = np.empty(flat.shape[1] * together, np.float32)
        images = np.zeros((frames, int(np.prod(self.camera_shape))), np.float32)
        period = self.projector_shape[1] if columns_only else 0
        for first in range(0, frames, max(together, 1)):
            some = slice(first, first + together)
            table = _transposed(flat[some], room)
            self.direct.add_product(table, period, images[some])
            self.indirect.add_product(table, period, images[some])
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
def _transposed(light: Floats32, room: Floats32) -> Floats32:
    """(P, F) of (F, P), in ``room``; block by block, for frames may share the sets of a cache (2^k bytes)."""
    frames, pixels = light.shape
    table = room[: pixels * frames].reshape(pixels, frames)
    for block in nb.prange((pixels + _BLOCK - 1) // _BLOCK):
        for f in range(frames):
            for p in range(block * _BLOCK, min((block + 1) * _BLOCK, pixels)):
                table[p, f] = light[f, p]
    return table
