"""Where the samples of a pixel's footprint go, and of the lenses through which it is seen and lit.

Independent samples would let the mean of a footprint wander by ``1 / sqrt(12 n)`` pixels (0.07 at 16
samples), and that of a blur circle by a quarter of its width over ``sqrt(n)`` (0.3 pixels where it is five
wide): more than the accuracy that is to be measured. Here every set is half of an Owen-scrambled Sobol net
and its mirror image through the centre: each point is still uniform, so every integral stays unbiased, but
the mean of a set is the centre exactly.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from burrscan.arrays import Floats32
from burrscan.errors import InputError


@lru_cache(maxsize=64)  # scipy takes longer to set up hundreds of nets than to draw their points
def sample_sets(*, sets: int, samples: int, seed: int, dimensions: int = 2) -> Floats32:
    """Sets of mirrored net points on the unit cube, (sets, samples, dimensions), read-only.

    O(sets × samples).

    Parameters
    ----------
    sets
        How many different sets to make; pixels draw one each.
    samples
        Points per set, an even power of two times one: 2, 4, 8, 16, ...
    seed
        Of the scrambling.
    dimensions
        Two for a pixel, and two more for each lens.

    Raises
    ------
    InputError
        When ``samples`` is not a power of two of at least 2.

    """
    if samples < 2 or samples & (samples - 1):
        raise InputError(f"samples per pixel must be a power of two of at least 2, not {samples}")
    from scipy.stats import qmc  # noqa: PLC0415 (a third of a second)

    rng = np.random.default_rng(seed)
    halves = np.stack(
        [qmc.Sobol(dimensions, scramble=True, rng=rng).random(samples // 2) for _ in range(sets)]
    )
    points = np.concatenate([halves, 1.0 - halves], axis=1).astype(np.float32)
    points.flags.writeable = False
    return points
