"""The adaptive scan's sequence: binary stripes that are all narrow, and sines of several close periods.

Every pattern is of high frequency, so light that arrives by way of other surfaces, which blurs it, hardly
follows the pattern: the binary part is a Gray code whose bits are combined by exclusive or with the finest
one (Gupta, Agrawal, Veeraraghavan, Narasimhan 2011), the sines have close periods (Gupta & Nayar 2012).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Floats32, freeze
from burrscan.codes.gray import gray_bits
from burrscan.codes.phase import encode_phase

_FOOTPRINT_PX = 5


@dataclass(frozen=True)
class Sequence:
    """One round's frames.

    Parameters
    ----------
    light
        (F, width) relative light: each bit and its inverse, then the sines, period by period.
    names
        One per frame.
    bits
        (B, width) -1 .. 1, each bit's course over the columns as seen through a footprint.
    periods_px
        (P,) the sines' periods.
    steps
        Frames per period.

    """

    light: Floats
    names: tuple[str, ...]
    bits: Floats32
    periods_px: tuple[float, ...]
    steps: int

    def __post_init__(self) -> None:
        freeze(self, light=self.light, bits=self.bits)

    def __len__(self) -> int:
        return len(self.names)


def narrow_bits(*, width: int, cell_px: int) -> Bools:
    """(B, width) Gray bits, all but the finest combined with the finest by exclusive or."""
    bits = gray_bits(width=width, cell_px=cell_px)
    bits[:-1] ^= bits[-1]
    return bits


def sequence(*, width: int, periods_px: tuple[float, ...], steps: int, cell_px: int) -> Sequence:
    """Build a round's frames. O(F·width)."""
    bits = narrow_bits(width=width, cell_px=cell_px)
    pairs = np.stack([bits, ~bits], axis=1).reshape(-1, width).astype(float)
    names = [f"narrow-u-{i:02d}{tail}" for i in range(len(bits)) for tail in ("", "-inverse")]
    sines = [encode_phase(width=width, period_px=period, steps=steps) for period in periods_px]
    seen = ndimage.uniform_filter1d(2.0 * bits - 1.0, _FOOTPRINT_PX, axis=1, mode="nearest")
    return Sequence(
        light=np.concatenate([pairs, *(light for light, _ in sines)]),
        names=(*names, *(name for _, some in sines for name in some)),
        bits=seen.astype(np.float32),
        periods_px=periods_px,
        steps=steps,
    )
