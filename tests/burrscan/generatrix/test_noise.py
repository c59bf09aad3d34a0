"""How thick the data are is told where bars, lugs and corners fill the cells: the noise that was put on."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.clean_command import drawn
from burrscan.generatrix.profile import Profile
from burrscan.generatrix.tracing import cells
from burrscan.pose import placed

SHAPES_IN_CELLS = (("spokes", 95097), ("spokes", 95144), ("plates", 95107), ("treads", 95004))
"""A step or a corner is as thick as its cell."""
FEW_IN_LARGE_CELLS = (("spokes", 95006), ("spokes", 95059), ("treads", 95049))
"""Cells whose arcs are hardly filled: by their area vertices would lie far apart."""
BARS_IN_MOST_CELLS = (("spokes", 99027), ("spokes", 99104))
OTHERS = tuple((part, number) for part in ("wheels", "vases", "cylinders", "ovals") for number in range(6))


def noise_shares(views: tuple[tuple[str, int], ...]) -> list[float]:
    """Noise found about the true axis, over that put on along the rays: on a slope less of it is across."""
    return [_noise_share(part, number) for part, number in views]


def _noise_share(part: str, number: int) -> float:
    (points, _), pose, sigma = drawn(part, number, noise=0.001)
    points = placed(np.linalg.inv(pose), points)
    x, y, z = points[np.isfinite(points).all(axis=1)].T
    return cells.scale_of(Profile(z.copy(), np.hypot(x, y), np.arctan2(y, x))).noise_mm / sigma


@pytest.mark.study
def test_noise_is_that_of_the_surface() -> None:
    shares = noise_shares(SHAPES_IN_CELLS + FEW_IN_LARGE_CELLS + BARS_IN_MOST_CELLS + OTHERS)
    assert max(shares) < 1.1
    assert 0.4 < np.median(shares) < 0.9


def test_a_step_in_a_cell_is_no_noise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cells, "_SHAPE", 0.0)
    assert min(noise_shares(SHAPES_IN_CELLS)) > 1.5


def test_cells_are_as_large_as_rows_are_apart(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cells, "_TOLD", np.inf)
    assert min(noise_shares(FEW_IN_LARGE_CELLS)) > 1.5


def test_cells_count_by_their_arc(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cells, "arc_bin", lambda angle, _: np.arange(len(angle)) % cells.ARC_BINS)
    monkeypatch.setattr(cells, "_TOLD", np.inf)
    assert min(noise_shares(BARS_IN_MOST_CELLS)) > 1.5
