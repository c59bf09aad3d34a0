"""Sparse rows and their product with projected light."""

from __future__ import annotations

from dataclasses import dataclass

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

    def add_product(self, table: Floats32, period: int, images: Floats32) -> None:
        """Add the product with ``table`` (columns, F) to images (F, rows).

        ``period`` > 0 says that the table holds one row of projector columns only.
        """
        _add_product(self.starts, self.columns, self.values, table, period, images)


def empty_rows(count: int) -> SparseRows:
    """Rows without light."""
    return SparseRows(np.zeros(count + 1, np.int64), np.zeros(0, np.int32), np.zeros(0, np.float32))


def stack(parts: list[SparseRows]) -> SparseRows:
    """Rows of several parts, one after the other."""
    bases = np.cumsum([0, *(part.starts[-1] for part in parts)])
    starts = [part.starts[:-1] + base for part, base in zip(parts, bases[:-1], strict=True)]
    return SparseRows(
        starts=np.concatenate([*starts, bases[-1:]]),
        columns=np.concatenate([part.columns for part in parts]),
        values=np.concatenate([part.values for part in parts]),
    )


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
