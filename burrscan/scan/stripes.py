"""The adaptive scan's patterns: fine slanted sine stripes of many frequencies, three steps each.

Every frame is of high frequency in both directions, so interreflected light, which
spreads over many projector pixels, is averaged out before it can follow a pattern; with one frequency only it
would still pull every phase the same way, with many it pulls each in another direction (after Gupta & Nayar
2012, micro phase shifting, whose stripes are upright and of nearly equal period). The slant makes light from
other projector rows differ too: on the epipolar line a column belongs to each row, and light from elsewhere
falls out of step.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from burrscan.arrays import Floats, Floats32, freeze

_TRIES = 128
"""Seeded random spreads, of which the one with the lowest side lobe is taken; more cost time, once per
scanner."""
_MAIN_LOBE_PX = 5.0
"""Half-width of the match's peak, a little over half the mean period (9.2 px): what is farther is another
column. As in matched.py."""
_COARSEST_ROW_SHARE = 0.6
"""Least frequency down a column over the finest: slants differ, so that no row repeats another's pattern."""


@dataclass(frozen=True)
class Stripes:
    """One round's stripes.

    Parameters
    ----------
    per_column, per_row
        (K,) cycles per projector pixel along columns and along rows.
    steps
        Frames per frequency.

    """

    per_column: Floats
    per_row: Floats
    steps: int = 3

    def __post_init__(self) -> None:
        freeze(self, per_column=self.per_column, per_row=self.per_row)

    def __len__(self) -> int:
        return len(self.per_column) * self.steps

    @property
    def names(self) -> tuple[str, ...]:
        """One per frame."""
        count = range(len(self.per_column))
        return tuple(f"stripes-{k:02d}-step-{n}" for k in count for n in range(self.steps))

    def frames(self, shape: tuple[int, int]) -> Iterator[Floats32]:
        """Light (H, W) of each frame, ½ + ½ cos 2π(f u + g v - n / steps)."""
        rows, columns = (np.arange(n, dtype=np.float32) for n in shape)
        for f, g in zip(self.per_column, self.per_row, strict=True):
            across = np.exp(2j * np.pi * f * columns).astype(np.complex64)
            down = np.exp(2j * np.pi * g * rows).astype(np.complex64)
            wave = down[:, None] * across
            for n in range(self.steps):
                turn = 2.0 * np.pi * n / self.steps
                yield 0.5 + 0.5 * (
                    wave.real * np.float32(np.cos(turn)) + wave.imag * np.float32(np.sin(turn))
                )


@lru_cache(maxsize=16)
def stripes(
    count: int, *, width: int, finest_px: float = 6.5, coarsest_px: float = 16.0, row_px: float = 8.0
) -> Stripes:
    """``count`` frequencies whose stripes come into step nowhere else, slanted to either side in turn.

    Parameters
    ----------
    count
        Frequencies; at least four tell a column from its neighbours a few stripes on.
    width
        Columns of the projector.
    finest_px, coarsest_px
        Range of periods along a row.
    row_px
        Finest period down a column.

    Notes
    -----
    Of some hundred seeded random spreads the one with the lowest side lobe is taken. O(tries·width·count).

    """
    low, high = 1.0 / coarsest_px, 1.0 / finest_px
    rng = np.random.default_rng(count)
    edges = np.linspace(0.0, 1.0, count + 1)[:-1]
    tries = low + (high - low) * (edges + rng.uniform(0.0, 1.0 / count, (_TRIES, count)))
    per_column = min(tries, key=lambda one: side_lobe(one, width=width))
    share = rng.permutation(np.linspace(_COARSEST_ROW_SHARE, 1.0, count))
    signs = np.where(np.arange(count) % 2 == 0, 1.0, -1.0)
    return Stripes(per_column, signs * share / row_px)


def side_lobe(per_column: Floats, *, width: int) -> float:
    """How much of a full match the best wrong column reaches, outside the main lobe."""
    apart = np.arange(_MAIN_LOBE_PX, width, 0.5)
    match = np.cos(2.0 * np.pi * apart[:, None] * per_column).mean(axis=1)
    return float(match.max())
