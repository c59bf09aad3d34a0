"""A flake one vertex wide has its height: what a pixel smears to its sides does not lower it."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.revolution import grid_faces
from burrscan.burrs import burrs_residual
from burrscan.inspection import Axis, Burr, Generatrix

_RADIUS_MM = 30.0


def flake(height_mm: float, seed: int, *, pitch_mm: float) -> tuple[Burr, ...]:
    """A fine mesh of part of a cylinder; one column of vertices stands up over 8 mm, with skirts."""
    rng = np.random.default_rng(seed)
    rows, columns = 160, 200
    z = pitch_mm * (np.arange(rows) - rows / 2)
    angle = pitch_mm / _RADIUS_MM * (np.arange(columns) - columns / 2)
    r = _RADIUS_MM + 0.01 * rng.normal(size=(rows, columns))
    high = np.abs(z) < 4.0
    for off, share in ((-3, 0.1), (-2, 0.15), (-1, 0.25), (0, 1.0), (1, 0.25), (2, 0.15), (3, 0.1)):
        r[high, columns // 2 + off] += share * height_mm  # what a pixel that is wider than the flake smears
    points = np.stack([r * np.cos(angle), r * np.sin(angle), np.broadcast_to(z[:, None], r.shape)], axis=-1)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.zeros((4, 4)), "exact")
    ends = np.array([z[0], z[-1]])
    curve = Generatrix(ends, np.full(2, _RADIUS_MM), np.zeros(2), np.zeros(2))
    faces = grid_faces(rows, columns).astype(np.int32)
    return burrs_residual(points.reshape(-1, 3), faces, axis, curve, sigma_mm=0.01)


@pytest.mark.parametrize("pitch_mm", [0.15, 0.5])
@pytest.mark.parametrize("height_mm", [0.3, 0.6, 1.0])
def test_a_flake_of_one_vertex_has_its_height(height_mm: float, pitch_mm: float) -> None:
    (burr,) = flake(height_mm, 1, pitch_mm=pitch_mm)
    assert burr.side == "protrusion"
    assert burr.height_mm.value == pytest.approx(height_mm, abs=0.04)
    assert abs(burr.height_mm.value - height_mm) < 3.0 * burr.height_mm.sigma + 0.01
