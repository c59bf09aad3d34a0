"""Geometry everywhere: where decoding failed, columns are filled in smoothly.

Thin-plate splines (Duchon 1977) through block medians, as in the seed's section 2; they only steer light,
so that no measurement rests on them.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage
from scipy.interpolate import RBFInterpolator

from burrscan.arrays import Bools, Floats, Floats32

_NEIGHBOURS = 24
"""Blocks each spline goes through: two rings of a grid around a block; the cost grows with their cube."""


def fill_columns(u_px: Floats32, known: Bools, *, wanted: Bools, block_px: int = 8) -> Floats32:
    """Columns (h, w): as given where known, splined where wanted, NaN elsewhere.

    Parameters
    ----------
    u_px, known
        (h, w) decoded columns and where they may be trusted.
    wanted
        (h, w) where a value is wanted.
    block_px
        Side of the blocks whose medians carry the spline.

    Notes
    -----
    O(pixels + blocks · neighbours³).

    """
    filled = np.where(known, u_px, np.float32(np.nan))
    holes = wanted & ~known
    medians = _block_medians(filled, block_px)
    has = np.isfinite(medians)
    if has.sum() < _NEIGHBOURS or not holes.any():
        return filled
    needs = ndimage.binary_dilation(_any_in_block(holes, block_px), iterations=1)
    centres = np.stack(np.nonzero(has), axis=-1).astype(float)
    splined = medians.copy()
    spline = RBFInterpolator(centres, medians[has], neighbors=_NEIGHBOURS, smoothing=0.1)
    splined[needs] = spline(np.stack(np.nonzero(needs), axis=-1).astype(float))
    rows, columns = np.nonzero(holes)
    at = (np.stack([rows, columns]) + 0.5) / block_px - 0.5
    filled[rows, columns] = ndimage.map_coordinates(np.nan_to_num(splined), at, order=1, mode="nearest")
    return filled


def _blocks(image: Floats32 | Bools, block_px: int) -> Floats:
    height, width = image.shape
    rows, columns = -(-height // block_px), -(-width // block_px)
    padded = np.full((rows * block_px, columns * block_px), np.nan)
    padded[:height, :width] = image
    cut = padded.reshape(rows, block_px, columns, block_px)
    return cut.transpose(0, 2, 1, 3).reshape(rows, columns, -1)


def _block_medians(image: Floats32, block_px: int) -> Floats:
    """Median per block, NaN where fewer than a quarter of the pixels have a value."""
    cut = np.sort(_blocks(image, block_px), axis=-1)
    count = np.isfinite(cut).sum(axis=-1)
    middle = np.take_along_axis(cut, np.maximum(count // 2, 0)[..., None], axis=-1)[..., 0]
    return np.where(4 * count >= cut.shape[-1], middle, np.nan)


def _any_in_block(mask: Bools, block_px: int) -> Bools:
    return np.asarray(np.nanmax(_blocks(mask, block_px), axis=-1) > 0.0)
