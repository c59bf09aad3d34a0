"""Lines that no single cell tells, in made-up light and depth: what is found, and what alone must not be."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.burrs.light import lines as module

SHAPE = (120, 200)
ROWS = slice(50, 80)
NONE: Bools = np.zeros(SHAPE, bool)
ALL: Bools = np.ones(SHAPE, bool)


def lines(rest: Floats, depth_z: Floats, open_cells: Bools, taken: Bools) -> Bools:
    """As where every excess of a fifth is strange."""
    return module.lines(rest, np.abs(rest) > 0.2, depth_z, open_cells, taken)


def world(
    seed: int, *, contrast: float = -0.9, depth_z: float = 3.0, slope: float = 0.0, wide: int = 1
) -> tuple[Floats, Floats]:
    """Light and depth of a finish, and on it a line from row 50 to 80 about column 100."""
    rng = np.random.default_rng(seed)
    rest, z = 0.05 * rng.normal(size=SHAPE), rng.normal(size=SHAPE)
    for row in range(ROWS.start, ROWS.stop):
        first = round(100 + slope * (row - 65))
        rest[row, first : first + wide] += contrast
        z[row, first : first + wide] += depth_z
    return rest, z


@pytest.mark.parametrize("contrast", [-0.9, 0.9])
@pytest.mark.parametrize("depth_z", [-3.0, 3.0])
@pytest.mark.parametrize("slope", [-0.05, 0.0, 0.05])
def test_a_line_is_found_where_it_is(contrast: float, depth_z: float, slope: float) -> None:
    for seed in range(5):
        found = lines(*world(seed, contrast=contrast, depth_z=depth_z, slope=slope), ALL, NONE)
        rows, columns = np.nonzero(found)
        assert columns.min() >= 97
        assert columns.max() <= 102
        assert abs(rows.min() - ROWS.start) <= 8
        assert abs(rows.max() - ROWS.stop) <= 8


@pytest.mark.parametrize(
    ("contrast", "depth_z", "slope"),
    [
        (0.0, 3.0, 0.0),  # noise that happens to agree
        (-0.9, 0.0, 0.0),  # a scratch that stays in its column
        (-0.9, 3.0, 0.18),  # 10 degrees askew
    ],
)
def test_what_is_half_a_line_is_none(contrast: float, depth_z: float, slope: float) -> None:
    for seed in range(5):
        light_and_depth = world(seed, contrast=contrast, depth_z=depth_z, slope=slope)
        assert not lines(*light_and_depth, ALL, NONE).any()


def test_the_edge_of_a_patch_is_none() -> None:
    """Dark over 12 cells, with the depth off at its left edge, where the pixels are half dark."""
    for seed in range(5):
        rest, z = world(seed)
        rest[ROWS, 101:112] -= 0.9
        assert not lines(rest, z, ALL, NONE).any()


def test_a_wide_scratch_askew_keeps_a_column_dark_and_is_followed_beyond() -> None:
    """Three cells wide, so that a column is dark over 15 rows; 10 degrees, both edges bending the depth."""
    for seed in range(5):
        assert not lines(*world(seed, slope=0.18, wide=3), ALL, NONE).any()


def test_what_goes_with_another_place_and_what_is_out_of_sight_is_none() -> None:
    rest, z = world(0)
    near, far = NONE.copy(), NONE.copy()
    near[60:70, 104], far[60:70, 110] = True, True
    assert not lines(rest, z, ALL, near).any()
    assert lines(rest, z, ALL, far).any()
    hidden = ALL.copy()
    hidden[:, 100] = False
    assert not lines(rest, z, hidden, NONE).any()


def test_light_and_depth_that_nobody_knows_tell_nothing() -> None:
    unknown = np.full(SHAPE, np.nan)
    rest, z = world(0)
    assert not lines(unknown, z, ALL, NONE).any()
    assert not lines(rest, unknown, ALL, NONE).any()
    rest[ROWS.start : ROWS.stop : 3, 100] = np.nan  # a third of it
    assert not lines(rest, z, ALL, NONE).any()


def test_a_surface_without_lines_has_none_whatever_the_noise() -> None:
    """Twenty fields of 24,000 cells; light as strange as that of lines in one cell of five."""
    for seed in range(20):
        rng = np.random.default_rng(100 + seed)
        rest = np.where(rng.random(SHAPE) < 0.2, rng.normal(size=SHAPE), 0.0)
        assert not lines(rest, rng.standard_t(3, SHAPE), ALL, NONE).any()


def test_a_picture_and_its_mirror_image_have_the_same_lines() -> None:
    rest, z = world(3, slope=0.03)
    found = lines(rest, z, ALL, NONE)
    np.testing.assert_array_equal(lines(rest[:, ::-1], z[:, ::-1], ALL, NONE)[:, ::-1], found)
    np.testing.assert_array_equal(lines(rest[::-1], z[::-1], ALL, NONE)[::-1], found)


def test_a_long_scratch_is_followed_to_its_ends() -> None:
    """Four and a half degrees askew: over the 15 cells of a line it moves by one."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        rest, z = 0.05 * rng.normal(size=SHAPE), rng.normal(size=SHAPE)
        for row in range(20, 110):
            column = round(100 + 0.08 * (row - 65))
            rest[row, column] -= 0.9
            z[row, column] += 3.0
        assert not lines(rest, z, ALL, NONE).any()


def test_what_no_light_tells_of_is_no_line() -> None:
    """Beyond a gap that is hidden, a line's window reaches cells whose light is not known."""
    for seed in range(5):
        rest, z = world(seed)
        seen = ALL.copy()
        seen[76:78, 90:110] = False
        rest[78:82, 90:110] = np.nan
        found = lines(rest, z, seen, NONE)
        assert found[60:70, 100].all()
        assert not found[76:].any()
