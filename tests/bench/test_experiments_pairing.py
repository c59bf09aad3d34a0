"""What pairing is worth, on differences of a known variance."""

from __future__ import annotations

import numpy as np
import pytest

from bench.experiments.ab_pairing import real_gain


def test_the_gain_is_the_ratio_of_variances() -> None:
    random = np.random.default_rng(2)
    scene = 2.0 * random.standard_normal(4000)
    base, new = (scene + random.standard_normal(4000) for _ in range(2))
    gain, low, high = real_gain(base, new)  # (5 + 5) / 2
    assert low < 5.0 < high
    assert gain == pytest.approx(5.0, rel=0.1)
    alone, _, _ = real_gain(base, random.permutation(new))
    assert alone == pytest.approx(1.0, rel=0.1)


def test_arms_that_do_not_differ_need_no_scene() -> None:
    values = np.arange(9.0)
    assert real_gain(values, values)[0] == np.inf
