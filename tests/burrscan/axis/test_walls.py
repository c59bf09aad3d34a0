"""Walls of lugs are left out of the fit, and smoothing draws no curve inwards."""

import numpy as np

from bench.synthetic.revolution import revolution_scan
from burrscan.axis.points.smooth import given_back, smoothed
from burrscan.axis.points.walls import RINGS, off_walls

AROUND, ALONG = 120, 40


def test_walls_and_their_neighbours_are_left_out() -> None:
    """One lug of 5 mm on a cylinder of 90 mm: two flanks, a row of faces each, and their rings."""
    scan = revolution_scan("cylinder", shape=(AROUND, ALONG))
    points = (scan.vertices_mm - scan.point_mm).reshape(AROUND, ALONG, 3)
    outward = points - (points @ scan.direction)[..., None] * scan.direction
    points[50:70] += 5.0 * outward[50:70] / np.linalg.norm(outward[50:70], axis=-1, keepdims=True)
    flat = points.reshape(-1, 3)
    kept = off_walls(flat, scan.faces, scan.direction, np.zeros(3), noise=0.0).reshape(AROUND, ALONG)
    left = np.flatnonzero(~kept.any(axis=1))
    expected = [row for edge in (49, 69) for row in range(edge - RINGS, edge + 2 + RINGS)]
    np.testing.assert_array_equal(left, expected)
    assert kept.sum() == (AROUND - len(expected)) * ALONG
    assert off_walls(flat, scan.faces, scan.direction, np.zeros(3), noise=0.2).all()


def test_smoothing_draws_no_curve_inwards() -> None:
    """Where neighbours are twice as far apart, their mean lies within the curve by four times as much."""
    scan = revolution_scan("cylinder", shape=(AROUND, ALONG))
    points = (scan.vertices_mm - scan.point_mm).reshape(AROUND, ALONG, 3)
    uneven = np.concatenate([np.arange(0, AROUND // 2), np.arange(AROUND // 2, AROUND, 2)])
    index = np.arange(len(uneven) * ALONG, dtype=np.int32).reshape(len(uneven), ALONG)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, :-1], index[1:, 1:]
    faces = np.stack([a, c, b, b, c, d], axis=-1).reshape(-1, 3)
    once = smoothed(points[uneven].reshape(-1, 3), np.empty(0), faces, rounds=2)
    back = given_back(once, np.empty(0), faces, rounds=2)
    inwards = []
    for some in (once, back):
        off = some - np.outer(some @ scan.direction, scan.direction)
        radius = np.linalg.norm(off, axis=1).reshape(len(uneven), ALONG)[:, 8:-8]
        inwards.append([90.0 - radius[20:50].mean(), 90.0 - radius[70:80].mean()])
    assert inwards[0][1] > 3.0 * inwards[0][0] > 0.0
    assert np.abs(inwards[1]).max() < 0.02 * inwards[0][1]
