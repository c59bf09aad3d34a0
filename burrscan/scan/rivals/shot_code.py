"""Stripes that a single picture identifies: dark and bright in turn, told apart by the order of their widths.

The widths follow a de Bruijn sequence: any five stripes in a row occur once (Zhang, Curless, Seitz 2002
identify stripes of colours by such a sequence; here widths serve, so that neither colour nor reflectance has
a say).
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Floats, Ints

_WIDTHS = np.array([0.6, 1.0, 1.6])
"""Letters of the code, relative: ratios of about 1.6 between neighbours; nearer ones a window does not tell
apart, wider ones waste resolution."""
_ORDER = 5
"""Stripes that are unique in a row: 3⁵ = 243 words serve any raster of stripes that a camera resolves."""
_DARK = 0.08
"""Light of dark stripes over bright: some light stays, so that the surface between is seen."""
_FINE = 16
"""Samples a column, so that borders between columns come out right to a sixteenth."""
_SOFT = 0.2
"""Blur of the borders in stripes: least squares needs slopes, which a sharp border has none of."""


def stripe_light(*, width: int, stripe_px: float) -> Floats:
    """Light (width,) relative to full white of stripes about ``stripe_px`` columns wide, borders softened.

    O(width). Beyond 259 stripes the sequence begins again.
    """
    rng = np.random.default_rng(_ORDER)  # a sequence has no order of its own: where it begins is free
    widths = np.roll(_WIDTHS[de_bruijn(len(_WIDTHS), _ORDER)], rng.integers(3**_ORDER)) * stripe_px
    borders = np.cumsum(np.resize(widths, int(np.ceil(width / widths.mean() * 1.3)) + 8))
    fine = (np.arange(width * _FINE) + 0.5) / _FINE
    bright = np.searchsorted(borders, fine) % 2 == 0
    light = np.where(bright, 1.0, _DARK)
    soft: Floats = ndimage.gaussian_filter1d(light, _SOFT * stripe_px * _FINE, mode="nearest")
    return np.asarray(soft.reshape(width, _FINE).mean(axis=1))


def de_bruijn(letters: int, order: int) -> Ints:
    """(letters**order,) numbers in which every word of ``order`` letters occurs once, cyclically.

    The Lyndon words whose length divides the order, one after the other (Fredricksen, Maiorana 1978).
    """
    sequence: list[int] = []
    word = [-1]
    while word:
        word[-1] += 1
        if order % len(word) == 0:
            sequence += word
        word = [word[i % len(word)] for i in range(order)]
        while word and word[-1] == letters - 1:
            word.pop()
    return np.array(sequence)
