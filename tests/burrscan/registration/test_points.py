"""What a point counts where those beside it err with it."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.registration.joined.points import SECTORS, shares_of

PIECES = 400
SEEN = np.arange(SECTORS) < SECTORS // 2
"""A view shows half of a turn."""


def drawn(seed: int, *, shared_mm: float, count: int = 50, sigma_mm: float = 0.02) -> tuple[Floats, Floats]:
    """Weights and pulls of pieces whose sectors hold so many points, and err by an amount of their own."""
    rng = np.random.default_rng(seed)
    weight = np.where(SEEN, count / sigma_mm**2, 0.0) * np.ones((PIECES, 1))
    own = rng.normal(size=weight.shape) * np.hypot(sigma_mm / np.sqrt(count), shared_mm)
    return weight, weight * own


def mean_share(shares: Floats, some: Bools = SEEN) -> float:
    return float(shares[:, some].mean())


def test_points_that_err_by_themselves_count_nearly_fully() -> None:
    """Half of the pieces scatter by more than expected, by chance: a sector's variance by 2 / 32 / 0.37."""
    shares = shares_of(*drawn(0, shared_mm=0.0))
    assert 0.8 < mean_share(shares) <= 1.0
    assert 0.4 < float((shares[:, 0] == 1.0).mean()) < 0.7


@pytest.mark.parametrize("shared_mm", [0.01, 0.05])
def test_a_sector_whose_points_err_together_counts_as_its_error_says(shared_mm: float) -> None:
    weight, pull = drawn(1, shared_mm=shared_mm)
    expected = 1.0 / (1.0 + weight[0, 0] * shared_mm**2)
    assert float(np.median(shares_of(weight, pull)[:, 0])) == pytest.approx(expected, rel=0.15)


def test_only_the_scatter_counts_not_where_a_piece_lies() -> None:
    weight, pull = drawn(2, shared_mm=0.01)
    assert shares_of(weight, pull + 0.3 * weight) == pytest.approx(shares_of(weight, pull))


def test_a_burr_in_a_few_sectors_costs_the_others_little() -> None:
    """A tenth of the sectors make the median the 55 % point, 12 % up, and a mean square 80 times larger."""
    weight, pull = drawn(3, shared_mm=0.0)
    burr = np.zeros(SECTORS, np.bool_)
    burr[5:8] = True
    shares = shares_of(weight, pull + np.where(burr, 0.08, 0.0) * weight)
    assert mean_share(shares) > 0.85 * mean_share(shares_of(weight, pull))


def test_three_sectors_say_nothing_of_their_scatter() -> None:
    weight, pull = drawn(4, shared_mm=0.05)
    few = np.arange(SECTORS) < 3
    assert (shares_of(weight * few, pull * few) == 1.0).all()
    four = np.arange(SECTORS) < 4
    assert (shares_of(weight * four, pull * four) < 1.0).any()
