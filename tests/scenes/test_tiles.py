"""Shared interreflected light: nothing is lost, and the product is that of the dense matrix."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.transport.rows import SparseRows
from scenes.transport.sharing import receiving, share
from scenes.transport.splat import group_by_pixel
from scenes.transport.tiles import SIDES, TiledRows, stack_tiles, tile_grid, tiles_of


def tiled(rng: np.random.Generator, shape: tuple[int, int], columns: int) -> TiledRows:
    levels = []
    for side in SIDES:
        rows = int(np.prod(tile_grid(shape, side=side)))
        starts = np.concatenate([[0], np.cumsum(rng.integers(0, 4, rows))])
        place = rng.integers(0, columns, starts[-1]).astype(np.int32)
        levels.append(SparseRows(starts, place, rng.random(starts[-1]).astype(np.float32)))
    return TiledRows(tuple(levels), rng.random(shape) > 0.3)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), height=st.integers(1, 40), width=st.integers(1, 40))
def test_product_is_the_dense_one(seed: int, height: int, width: int) -> None:
    rng = np.random.default_rng(seed)
    rows = tiled(rng, (height, width), 6)
    table = rng.random((6, 3)).astype(np.float32)
    got = np.zeros((3, height * width), np.float32)
    rows.add_product(table, 0, got)
    want = np.zeros((height, width, 3))
    for side, level in zip(SIDES, rows.levels, strict=True):
        for i, j in np.ndindex(height, width):
            t = i // side * (-(-width // side)) + j // side
            for k in range(level.starts[t], level.starts[t + 1]):
                want[i, j] += level.values[k] * table[level.columns[k]] * rows.receives[i, j]
    np.testing.assert_allclose(got, want.reshape(-1, 3).T, rtol=1e-5, atol=1e-6)
    white = np.zeros((1, height * width), np.float32)
    rows.add_product(np.ones((6, 1), np.float32), 0, white)
    np.testing.assert_allclose(rows.row_sums(), white[0], rtol=1e-5)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), height=st.integers(1, 50), width=st.integers(1, 50))
def test_sharing_keeps_all_light_within_its_large_tile(seed: int, height: int, width: int) -> None:
    rng = np.random.default_rng(seed)
    direct = (rng.random((height, width)) * (rng.random((height, width)) > 0.8)).astype(np.float32)
    count = 300
    pixel = rng.integers(0, height * width, count).astype(np.int32)
    weight = (10.0 ** rng.uniform(-3.0, 3.0, count)).astype(np.float32)
    place = np.zeros(count, np.float32)
    receives = receiving(direct)
    levels = []
    for side, one in zip(
        SIDES, share(pixel, place, place, weight, direct=direct, receives=receives), strict=True
    ):
        _, _, values, starts = group_by_pixel([one], int(np.prod(tile_grid(direct.shape, side=side))))
        levels.append(SparseRows(starts, np.zeros(values.size, np.int32), values))
    got = TiledRows(tuple(levels), receives).row_sums()
    every = np.arange(height * width, dtype=np.int32)
    tile = tiles_of(every, width=width, side=SIDES[-1])
    want = np.bincount(tile[pixel], weights=weight, minlength=tile.max() + 1)
    np.testing.assert_allclose(np.bincount(tile, weights=got), want, rtol=1e-4, atol=1e-6)


def test_strips_stack_to_the_whole() -> None:
    rng = np.random.default_rng(3)
    top, bottom = tiled(rng, (32, 24), 5), tiled(rng, (21, 24), 5)
    whole = stack_tiles([top, bottom])
    np.testing.assert_array_equal(whole.row_sums(), np.concatenate([top.row_sums(), bottom.row_sums()]))
