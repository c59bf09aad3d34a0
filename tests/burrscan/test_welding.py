"""Welding against numpy's sort."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from burrscan.arrays import Floats
from burrscan.welding import welded


@given(st.integers(0, 400), st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_each_place_once(count: int, places: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices: Floats = (
        rng.integers(-places, places, (count, 3)).astype(np.float64) * -0.1
    )  # some of the zeros are negative
    faces = rng.integers(0, max(count, 1), (5, 3)).astype(np.int32)[: 5 * (count > 0)]
    sigma = rng.random(count)
    unique, triangles, least, place = welded(vertices, faces, sigma)
    assert len(unique) == len(np.unique(vertices + 0.0, axis=0))
    np.testing.assert_array_equal(unique[place], vertices)
    np.testing.assert_array_equal(unique[triangles], vertices[faces])
    assert least is not None
    assert all(least[i] == sigma[place == i].min() for i in range(len(unique)))


def test_distinct_vertices_pass_as_they_are() -> None:
    vertices = np.random.default_rng(0).normal(size=(1000, 3))
    faces = np.arange(999, dtype=np.int32).reshape(-1, 3)
    same, triangles, sigma, place = welded(vertices, faces, None)
    assert same is vertices
    assert triangles is faces
    assert sigma is None
    np.testing.assert_array_equal(place, np.arange(1000))
