"""What a count of so many in so many trials says of the share."""

from __future__ import annotations

from scipy.special import betaincinv


def share_bounds(hits: int, trials: int, *, level: float = 0.95, sides: int = 2) -> tuple[float, float]:
    """Clopper and Pearson's exact bounds of a share.

    One-sided (``sides=1``) each end holds with ``level`` by itself: 29 hits of 29 show 0.902, the rule of
    "29 of 29" by which a90/95 is demonstrated at a single size.
    """
    tail = (1.0 - level) / sides
    low = float(betaincinv(hits, trials - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, trials - hits, 1.0 - tail)) if hits < trials else 1.0
    return low, high
