"""Chessboard corners to a hundredth of a pixel: two blurred edges that cross, fitted to all pixels around.

On rendered, tilted boards OpenCV's ``findChessboardCornersSB`` is off by 0.08 to 0.15 px RMS,
``cornerSubPix`` by 0.06, this by 0.013 (``tests/burrscan/test_calibration_board.py``).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import erf

from burrscan.arrays import Floats, Image
from burrscan.rig import View

_STEPS = 25
"""Bounds Levenberg-Marquardt on nine parameters a corner."""
_FEWEST_STEPS = 8
"""Before all corners may count as settled: a refused step looks like rest while the damping still adapts."""
_SETTLED_PX = 1e-4
"""A hundredth of the hundredth of a pixel that corners are wanted to."""
_REACH = 0.65
"""Radius of a neighbourhood, as a share of the way to the nearest corner; the next edges begin at 1."""
_REACH_PX = 20.0
"""Its upper limit: further along the edges a lens's distortion bends them by more than noise hides."""
_LARGEST_STEP_PX = 0.5
"""Keeps a step within the blurred edge, beyond which the model is flat and its slopes say nothing."""
_START_BLUR_PX = 0.5
"""Of an edge in a sharp picture: a box of one pixel has a deviation of 0.29, a lens adds to it."""
_BLUR_PX = (0.05, 10.0)
"""Least and most that the fit may take: an edge sharper than a pixel shows is one, a wider one is no edge."""
_NARROWEST_PX = 0.05
"""Of a pixel's extents across an edge, the smaller may be nothing; the closed form divides by both."""


class _Windows(NamedTuple):
    """Pixels around each corner: offsets (n, k, 2) from its start, grey values (n, k), and weights (n, k)."""

    offset: Floats
    grey: Floats
    weight: Floats


class _Edge(NamedTuple):
    """An edge at some distances (n, k), and its derivatives by distance and by the logarithm of the blur."""

    value: Floats
    slope: Floats
    by_blur: Floats


def refined(image: Image, corners: Floats, *, rows: int, lens: View | None = None) -> Floats:
    """Corners (n, 2) fitted to an image, from starts within a pixel or two.

    Parameters
    ----------
    image
        (h, w) DN.
    corners
        (n, 2) starts, row by row.
    rows
        Rows of the board.
    lens
        The camera as far as known: its distortion is taken off the neighbourhoods, whose edges are straight
        only then. Bent edges move a corner by some thousandths of a pixel.

    Returns
    -------
    (n, 2); a corner whose fit wanders off keeps its start.

    Notes
    -----
    The model around a corner c is ``(1 + g·x) (a + b e1 e2)`` with ``e`` a function of the distance d from
    one of two lines through c: an edge as a lens of Gaussian blur w shows it to square pixels, under light
    that varies linearly. A sharp edge along the columns has all its pixels cut at the same place, so that
    without the pixels' own box it would be drawn towards the middle of them. Nine parameters by damped
    Gauss-Newton, all corners at once. O(pixels in the windows).

    """
    grid = corners.reshape(rows, -1, 2)
    step = _nearest(grid)
    lens = lens or View(image.shape[1], image.shape[0], 1.0, 1.0, 0.0, 0.0)
    windows = _windows(image.astype(float), corners, np.minimum(_REACH * step, _REACH_PX), lens)
    p = _start(windows, grid)
    damping = np.full(len(p), 1e-3)
    off, slopes = _residuals(p, windows)
    cost = (off**2).sum(axis=1)
    for step_number in range(_STEPS):
        normal = slopes.swapaxes(1, 2) @ slopes
        diagonal = np.einsum("nii->ni", normal)
        damped = normal + (damping[:, None] * diagonal + 1e-12)[..., None] * np.eye(p.shape[1])
        move = np.linalg.solve(damped, np.einsum("nki,nk->ni", slopes, off)[..., None])[..., 0]
        move *= np.minimum(1.0, _LARGEST_STEP_PX / np.maximum(np.abs(move[:, :2]).max(axis=1), 1e-12))[
            :, None
        ]
        tried = p + move
        tried[:, 8] = np.clip(tried[:, 8], *np.log(_BLUR_PX))
        there, slopes_there = _residuals(tried, windows)
        costs = (there**2).sum(axis=1)
        better = costs < cost
        p[better], cost[better] = tried[better], costs[better]
        off[better], slopes[better] = there[better], slopes_there[better]
        damping = np.where(better, damping / 5.0, damping * 5.0)
        moving = better & (np.abs(move[:, :2]).max(axis=1) > _SETTLED_PX)
        if step_number >= _FEWEST_STEPS and not moving.any():
            break
    settled = np.asarray((np.abs(p[:, :2]) < 0.5 * step[:, None]).all(axis=1))
    return np.where(settled[:, None], lens.bent(lens.straight(corners) + p[:, :2]), corners)


def _nearest(grid: Floats) -> Floats:
    """(n,) distance of each corner from the nearest of its neighbours."""
    least = np.full(grid.shape[:2], np.inf)
    for axis in (0, 1):
        step = np.linalg.norm(np.diff(grid, axis=axis), axis=-1)
        before, after = [slice(None)] * 2, [slice(None)] * 2
        before[axis], after[axis] = slice(None, -1), slice(1, None)
        least[tuple(before)] = np.minimum(least[tuple(before)], step)
        least[tuple(after)] = np.minimum(least[tuple(after)], step)
    return least.ravel()


def _windows(image: Floats, corners: Floats, reach: Floats, lens: View) -> _Windows:
    size = int(np.ceil(reach.max()))
    y, x = (v.ravel() for v in np.mgrid[-size : size + 1, -size : size + 1])
    nearest = np.rint(corners).astype(int)
    columns, rows = nearest[:, :1] + x, nearest[:, 1:] + y
    height, width = image.shape
    inside = (columns >= 0) & (columns < width) & (rows >= 0) & (rows < height)
    grey = image[np.clip(rows, 0, height - 1), np.clip(columns, 0, width - 1)]
    pixels = np.stack([columns, rows], axis=-1).astype(float)
    offset = lens.straight(pixels) - lens.straight(corners)[:, None]
    near = np.hypot(offset[..., 0], offset[..., 1]) <= reach[:, None]
    return _Windows(offset, grey, (inside & near).astype(float))


def _start(windows: _Windows, grid: Floats) -> Floats:
    """(n, 9): place, angles of the two lines, mean, half contrast, slopes of the light, log of the blur."""
    p = np.zeros((grid.shape[0] * grid.shape[1], 9))
    for k, axis in ((2, 1), (3, 0)):
        along = np.gradient(grid, axis=axis)
        p[:, k] = np.arctan2(along[..., 1], along[..., 0]).ravel()
    p[:, 8] = np.log(_START_BLUR_PX)
    p[:, 4], p[:, 5] = 0.0, 1.0
    sign = (_model(p, windows.offset)[0] > 0.0) * 2.0 - 1.0
    count = windows.weight.sum(axis=1)
    mean = (windows.grey * windows.weight).sum(axis=1) / count
    p[:, 5] = ((windows.grey - mean[:, None]) * sign * windows.weight).sum(axis=1) / count
    p[:, 4] = mean
    return p


def _residuals(p: Floats, windows: _Windows) -> tuple[Floats, Floats]:
    """What the model leaves of the windows (n, k), and its derivatives (n, k, 9), both weighted."""
    model, slopes = _model(p, windows.offset)
    return (windows.grey - model) * windows.weight, slopes * windows.weight[..., None]


def _model(p: Floats, offset: Floats) -> tuple[Floats, Floats]:
    """Grey values (n, k) and their derivatives (n, k, 9)."""
    c, a, b, light = p[:, None, :2], p[:, 4:5], p[:, 5:6], p[:, None, 6:8]
    width = np.exp(p[:, 8:9])
    away = offset - c
    shade = 1.0 + (light * offset).sum(axis=-1)
    edges, along = [], []
    for k in (2, 3):
        cosine, sine = np.cos(p[:, k : k + 1]), np.sin(p[:, k : k + 1])
        edges.append(_edge(cosine * away[..., 1] - sine * away[..., 0], width, cosine, sine))
        along.append((cosine, sine, cosine * away[..., 0] + sine * away[..., 1]))
    product = edges[0].value * edges[1].value
    body = a + b * product
    chain = [b * shade * edges[i].slope * edges[1 - i].value for i in (0, 1)]
    slopes = np.empty((*product.shape, 9))
    slopes[..., 0] = sum(chain[i] * along[i][1] for i in (0, 1))
    slopes[..., 1] = -sum(chain[i] * along[i][0] for i in (0, 1))
    for i in (0, 1):
        slopes[..., 2 + i] = -chain[i] * along[i][2]
    slopes[..., 4], slopes[..., 5] = shade, shade * product
    slopes[..., 6:8] = body[..., None] * offset
    slopes[..., 8] = b * shade * sum(edges[i].by_blur * edges[1 - i].value for i in (0, 1))
    return shade * body, slopes


def _edge(d: Floats, width: Floats, cosine: Floats, sine: Floats) -> _Edge:
    """A step from -1 to 1 under Gaussian blur, averaged over square pixels at distances ``d``.

    Across a line with cosine c and sine s a pixel is a box as wide as s under one as wide as c: the average
    is a second difference of the twice integrated error function. By the heat equation the derivative by
    log w is w² times the curvature.
    """
    first, second = np.maximum(np.abs(sine), _NARROWEST_PX), np.maximum(np.abs(cosine), _NARROWEST_PX)
    value, slope, curvature = 0.0, 0.0, 0.0
    for far, sign in (
        (first + second, 1.0),
        (first - second, -1.0),
        (second - first, -1.0),
        (-first - second, 1.0),
    ):
        x = d + 0.5 * far
        step = erf(x / (np.sqrt(2.0) * width))
        bell = np.sqrt(2.0 / np.pi) * width * np.exp(-0.5 * (x / width) ** 2)
        value = value + sign * 0.5 * ((x * x + width * width) * step + x * bell)
        slope = slope + sign * (x * step + bell)
        curvature = curvature + sign * step
    area = first * second
    return _Edge(value / area, slope / area, width**2 * curvature / area)
