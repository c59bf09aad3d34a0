"""Light that camera pixels share by tiles of 4×4, 8×8 and 16×16: a sparse row per tile, not per pixel."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from burrscan.arrays import Bools, Floats32, Ints, Ints32, freeze
from scenes.transport.rows import SparseRows, empty_rows, stack

SIDES = (4, 8, 16)
TILE = SIDES[-1]


@dataclass(frozen=True)
class TiledRows:
    """A sparse matrix whose rows are tiles of camera pixels.

    Parameters
    ----------
    levels
        For each of :data:`SIDES` the tiles in raster order; their values are what each receiving pixel gets.
    receives
        (h, w) camera pixels that take part.

    """

    levels: tuple[SparseRows, ...]
    receives: Bools

    def __post_init__(self) -> None:
        freeze(self, receives=self.receives)

    def add_product(self, table: Floats32, period: int, images: Floats32) -> None:
        """Add the product with ``table`` (columns, F) to images (F, h·w); O(F·(nnz + pixels))."""
        shapes = [tile_grid(self.receives.shape, side=side) for side in SIDES]
        products = []
        for rows, shape in zip(self.levels, shapes, strict=True):
            product = np.zeros((images.shape[0], shape[0] * shape[1]), np.float32)
            rows.add_product(table, period, product)
            products.append(product.reshape(-1, *shape))
        _add_tiles(_merged(products), self.receives, images)

    def row_sums(self) -> Floats32:
        """Light of each camera pixel under an all-white projector, (h·w,)."""
        sums = np.zeros((1, self.receives.size), np.float32)
        shapes = [tile_grid(self.receives.shape, side=side) for side in SIDES]
        tiles = [rows.row_sums().reshape(1, *shape) for rows, shape in zip(self.levels, shapes, strict=True)]
        _add_tiles(_merged(tiles), self.receives, sums)
        total: Floats32 = sums[0]
        return total


def no_tiles(shape: tuple[int, int]) -> TiledRows:
    """Tiles of an image without shared light."""
    counts = (int(np.prod(tile_grid(shape, side=side))) for side in SIDES)
    return TiledRows(tuple(empty_rows(count) for count in counts), np.zeros(shape, np.bool_))


def stack_tiles(parts: list[TiledRows]) -> TiledRows:
    """Tiles of strips of the image, one below the other; all strips but the last are whole tiles high."""
    levels = tuple(stack([part.levels[level] for part in parts]) for level in range(len(SIDES)))
    return TiledRows(levels, np.concatenate([part.receives for part in parts]))


def tile_grid(shape: tuple[int, ...], *, side: int) -> tuple[int, int]:
    """Rows and columns of tiles that cover an image."""
    return -(-shape[0] // side), -(-shape[1] // side)


def tiles_of(pixel: Ints32, *, width: int, side: int) -> Ints32:
    """Flat tile of each flat pixel."""
    row, column = np.divmod(pixel, width)
    return np.asarray(row // side * -(-width // side) + column // side, np.int32)


def receivers(receives: Bools, *, side: int) -> Ints:
    """How many pixels of each tile take part, (tile rows, tile columns)."""
    rows, columns = tile_grid(receives.shape, side=side)
    padded = np.zeros((rows * side, columns * side), np.bool_)
    padded[: receives.shape[0], : receives.shape[1]] = receives
    return np.asarray(padded.reshape(rows, side, columns, side).sum(axis=(1, 3)))


def _merged(tiles: list[Floats32]) -> Floats32:
    """Light of the smallest tiles (F, rows, columns), with that of the larger ones that they are part of."""
    light = tiles[-1]
    for finer in reversed(tiles[:-1]):
        rows, columns = finer.shape[1:]
        light = finer + light.repeat(2, axis=1)[:, :rows].repeat(2, axis=2)[:, :, :columns]
    return np.ascontiguousarray(light)


@nb.njit(cache=True, parallel=True)
def _add_tiles(tiles: Floats32, receives: Bools, images: Floats32) -> None:
    frames = tiles.shape[0]
    height, width = receives.shape
    for i in nb.prange(height):
        for f in range(frames):
            for j in range(width):
                if receives[i, j]:
                    images[f, i * width + j] += tiles[f, i // 4, j // 4]
