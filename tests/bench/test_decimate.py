"""Meshes small enough to be kept: cells of space become vertices, and what stands out keeps its shape."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bench.run import decimate
from bench.synthetic.revolution import grid_faces


@given(seed=st.integers(0, 10_000), count=st.integers(1, 60), low=st.integers(-5, 0), high=st.integers(0, 4))
def test_rows_are_numbered_in_their_lexical_order(seed: int, count: int, low: int, high: int) -> None:
    keys = np.random.default_rng(seed).integers(low, high + 1, (count, 4)).astype(float)
    expected = np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1)
    assert np.array_equal(decimate._numbered(keys), expected)


def test_a_plane_with_a_bump_keeps_its_area_and_the_bump() -> None:
    """A fifth of the vertices are left, no face twice, none folded; the bump is as high as it was."""
    x, y = (grid.ravel() for grid in np.meshgrid(np.linspace(0.0, 40.0, 160), np.linspace(0.0, 40.0, 160)))
    bump = np.maximum(1.0 - np.hypot(x - 20.0, y - 20.0) / 3.0, 0.0)
    mesh = decimate.decimated_mesh(
        np.stack([x, y, bump], axis=1), grid_faces(160, 160).astype(np.int32), bump
    )
    assert 3000 < len(mesh.vertices_mm) <= 5000
    assert len(np.unique(np.sort(mesh.faces, axis=1), axis=0)) == len(mesh.faces)
    a, b, c = mesh.vertices_mm[mesh.faces].astype(float).transpose(1, 0, 2)
    across = np.cross(b - a, c - a)
    assert (across[:, 2] > 0.0).all() or (across[:, 2] < 0.0).all()
    assert abs(across[:, 2].sum()) / 2.0 > 0.95 * 40.0**2
    assert float(mesh.values.max()) > 0.85
    assert float(mesh.vertices_mm[:, 2].max()) > 0.85


def test_what_is_nowhere_is_left_out() -> None:
    places = np.array([[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0], [np.nan, 0.0, 0.0]])
    mesh = decimate.decimated_mesh(places, np.array([[0, 1, 2], [1, 2, 3]], np.int32), np.arange(4.0))
    assert len(mesh.faces) == 1
    assert sorted(mesh.values.tolist()) == [0.0, 1.0, 2.0]
    none = decimate.decimated_mesh(places, np.array([[1, 2, 3]], np.int32), np.arange(4.0))
    assert len(none.faces) == 0
