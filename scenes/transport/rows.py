"""Sparse rows and their product with projected light."""

from __future__ import annotations

from dataclasses import dataclass

import numba as nb
import numpy as np

from burrscan.arrays import Floats, Floats32, Ints, Ints32, freeze

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

    def product(self, columns: Floats32) -> Floats32:
        """Light under some patterns of upright stripes, (frames, pixels); ``columns`` (width, frames)."""
        images = np.zeros((columns.shape[1], self.starts.size - 1), np.float32)
        self.add_product(columns, len(columns), images)
        return images

    def add_product(self, table: Floats32, period: int, images: Floats32) -> None:
        """Add the product with ``table`` (columns, F) to images (F, rows).

        ``period`` > 0 says that the table holds one row of projector columns only.
        """
        _add_product(self.starts, self.columns, self.values, table, period, images)


def empty_rows(count: int) -> SparseRows:
    """Rows without light."""
    return SparseRows(np.zeros(count + 1, np.int64), np.zeros(0, np.int32), np.zeros(0, np.float32))


def scattered(parts: list[tuple[Ints, SparseRows]], count: int) -> SparseRows:
    """Rows of ``count`` pixels from those of some of them; of several for one pixel the last holds.

    ``parts`` are the flat pixels and their rows. O(entries + count).
    """
    part_of = np.full(count, -1)
    for number, (pixels, _) in enumerate(parts):
        part_of[pixels] = number
    return added(
        [
            (pixels, rows, (part_of[pixels] == number).astype(float))
            for number, (pixels, rows) in enumerate(parts)
        ],
        count,
    )


def added(parts: list[tuple[Ints, SparseRows, Floats]], count: int) -> SparseRows:
    """Rows of ``count`` pixels: the sum of those of some, each row multiplied by its share.

    ``parts`` are the flat pixels, their rows and the shares (P,); rows of share 0 leave no entry.
    O(entries + count).
    """
    taken = [(np.flatnonzero(share), np.diff(rows.starts)) for _, rows, share in parts]
    lengths = np.zeros(count, np.int64)
    for (pixels, _, _), (mine, entries) in zip(parts, taken, strict=True):
        lengths[pixels[mine]] += entries[mine]
    starts = np.concatenate([[0], np.cumsum(lengths)])
    columns, values = np.empty(starts[-1], np.int32), np.empty(starts[-1], np.float32)
    free = starts[:-1].copy()
    for (pixels, rows, share), (mine, entries) in zip(parts, taken, strict=True):
        to, by = free[pixels[mine]], share[mine].astype(np.float32)
        _copy_rows(rows.starts, rows.columns, rows.values, mine, to, by, columns, values)
        free[pixels[mine]] += entries[mine]
    return SparseRows(starts, columns, values)


@nb.njit(cache=True)
def _copy_rows(
    starts: Ints,
    columns: Ints32,
    values: Floats32,
    rows: Ints,
    to: Ints,
    by: Floats32,
    out: Ints32,
    light: Floats32,
) -> None:
    for k in range(rows.size):
        first, count = starts[rows[k]], starts[rows[k] + 1] - starts[rows[k]]
        for i in range(count):
            out[to[k] + i] = columns[first + i]
            light[to[k] + i] = values[first + i] * by[k]


@nb.njit(cache=True)
def _row_sums(starts: Ints, values: Floats32) -> Floats32:
    sums = np.empty(starts.size - 1, np.float32)
    for p in range(starts.size - 1):
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
            _add_row(starts[p], starts[p + 1], columns, values, table, period, sums[p - first])
        for f in range(frames):
            for p in range(first, last):
                images[f, p] += sums[p - first, f]


@nb.njit(cache=True, fastmath={"contract", "nnan", "ninf"})
def _add_row(
    first: int, last: int, columns: Ints32, values: Floats32, table: Floats32, period: int, sums: Floats32
) -> None:
    """Add one pixel's entries × table to its sums."""
    for k in range(first, last):
        column = columns[k] % period if period else columns[k]
        value = values[k]
        for f in range(sums.size):
            sums[f] += value * table[column, f]
