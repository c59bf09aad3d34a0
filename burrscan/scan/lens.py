"""What a projector out of focus does to stripes: how wide its blur circles are, and how unsure columns get.

Each point of a part is lit through all of the lens. The finer stripes are the less modulated for it, which
shows how wide the circle is. In a penumbra a part of the lens is hidden, on metal one side of it shines more
than the other: the circle's centre of light is then not its middle.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy import ndimage, special

from burrscan.arrays import Bools, Floats, Floats32, Image, Ints, Levels
from burrscan.correspondence import Correspondence
from burrscan.pose import placed
from burrscan.rig import Rig
from burrscan.scan.matching.matched import SURE_LEAD, Reading
from burrscan.scan.stripes import Stripes
from burrscan.triangulation import triangulate

_WIDEST_PX, _STEP_PX = 12.0, 0.05
"""Circles that are tried: of wider ones the coarsest stripes keep nothing."""
_SHARP_PX = 1.0
"""A narrower circle is none: of 16 wheels without a lens the widest at any of twelve depths was 0.65 px."""
_TENT_PX2 = 1.0 / 12.0
"""Half the variance of a sharp projector pixel, a tent as of known_light.py; a camera pixel that is w columns
or rows wide adds w² / 24."""
_DEPTHS = 12
"""Ranges of depth, with as many pixels each, in which a circle is looked for: from the focus on it grows."""
_LEAST_WIDE = 3
"""Depths with circles from which there is a lens: light between surfaces takes modulation too, at one."""
_FOCI = 401
"""Depths of the focus that are tried, from far before the part to far behind it: a hundredth of its depth."""
_MOST_PIXELS, _LEAST_PIXELS = 4000, 400
"""Pixels of a depth that are asked, evenly: their median is known to 0.5 %. Fewer do not tell a lens."""
_STEEPEST = 1.4
"""Columns, or rows, per camera pixel: where a pixel sees more, that takes modulation, too."""
_LEVELS = 65535
"""Of blurred light: far finer than the projector's own."""
_SMOOTH_PX = 1.0
"""Noise of the radiance is taken off over about three pixels, as wide as a penumbra that matters."""
_AROUND_PX = 4
"""Half the width of the square in which what is not hidden is looked for: half as wide as a wide penumbra."""
_SHADOW = 0.25
"""Share of the light beside it that a shadow has, by interreflection: lobes of metal hardly fall as far over
as few pixels, and there the whole lens sends light."""
_SHADING = 0.1
"""Share of the light by which surfaces darken over as far without any shadow, or by noise."""
_OFF = 0.85
"""See :func:`penumbra_sigma_px`."""


class Lens(NamedTuple):
    """A thin lens: how fast its blur circles grow with the inverse depth, and where it is in focus.

    ``per_inverse``: px · mm, 0 for a pinhole or a lens whose circles nobody can tell; ``focus``: 1 / mm.
    """

    per_inverse: float = 0.0
    focus: float = 0.0

    def circles_px(self, u_px: Floats32, rig: Rig) -> Floats32:
        """Diameters (h, w) of the circles where columns (h, w) are seen, px; 0 where nothing is."""
        if self.per_inverse == 0.0:
            return np.zeros(u_px.shape, np.float32)
        off = 1.0 / _depth_mm(u_px, rig) - self.focus
        circles = np.minimum(np.nan_to_num(np.abs(self.per_inverse * off)), _WIDEST_PX)
        return np.asarray(circles, np.float32)


def lens_of(reading: Reading, images: Image, code: Stripes, *, rig: Rig) -> Lens:
    """The projector's lens, from what its stripes keep of their modulation.

    Parameters
    ----------
    reading, images, code
        A round of stripes: decoded, (F, h, w) as seen, and as shown.
    rig
        The calibration, by which columns tell how far from the projector a surface is.

    Notes
    -----
    Of stripes of frequency ν a circle of diameter d keeps 2 J₁(πdν) / πdν (Goodman, Introduction to Fourier
    Optics, 6.4), beside what a sharp pixel's footprint keeps. That of the median pixel is found at each of
    some depths; a thin lens's circles are linear in the inverse depth, to both sides of the focus. O(pixels).

    """
    inverse = 1.0 / _depth_mm(reading.u_px, rig)
    sure = np.isfinite(inverse) & (reading.lead >= SURE_LEAD) & ~reading.clipped
    across = [np.hypot(*np.gradient(place)) for place in (reading.u_px, reading.v_px)]
    sure &= (across[0] <= _STEEPEST) & (across[1] <= _STEEPEST)
    row, column = np.nonzero(sure)
    order = np.argsort(inverse[row, column], kind="stable")
    at, found = [], []
    for part in np.array_split(order, _DEPTHS):
        if len(part) >= _LEAST_PIXELS:
            some = part[:: max(len(part) // _MOST_PIXELS, 1)]
            at.append(float(np.median(inverse[row[some], column[some]])))
            wide = [float(np.median(one[row[some], column[some]])) for one in across]
            footprint = _TENT_PX2 + (wide[0] ** 2 + wide[1] ** 2) / 48.0
            found.append(_circle_px(reading, images, code, row[some], column[some], footprint))
    return _lens(np.array(at), np.array(found))


def _lens(inverse: Floats, circles: Floats) -> Lens:
    """The lens whose circles are like those found at some inverse depths; what is sharp may be sharper."""
    wide = circles >= _SHARP_PX
    if np.count_nonzero(wide) < _LEAST_WIDE:
        return Lens()
    reach = float(np.ptp(inverse)) or float(inverse[0])
    best, lens = np.inf, Lens()
    for focus in np.linspace(inverse.min() - 2.0 * reach, inverse.max() + 2.0 * reach, _FOCI):
        off = np.abs(inverse - focus)
        slope = float(off[wide] @ circles[wide] / (off[wide] @ off[wide]))
        wrong = np.where(wide, slope * off - circles, np.maximum(slope * off - _SHARP_PX, 0.0))
        if float(wrong @ wrong) < best:
            best, lens = float(wrong @ wrong), Lens(slope, float(focus))
    return lens


def _depth_mm(u_px: Floats32, rig: Rig) -> Floats:
    """(h, w) distance of what is seen from the projector, along its optical axis; NaN where unknown."""
    known = Correspondence(u_px, np.zeros_like(u_px), np.isfinite(u_px))
    points, _ = triangulate(known, rig)
    return placed(rig.T_projector_camera, points.reshape(-1, 3))[:, 2].reshape(points.shape[:2])


def _circle_px(
    reading: Reading, images: Image, code: Stripes, row: Ints, column: Ints, footprint_px2: float
) -> float:
    """The circle that explains what stripes keep at some pixels, best by least squares."""
    frames = images[:, row, column].astype(float).reshape(len(code.per_column), code.steps, -1)
    turns = np.exp(2j * np.pi * np.arange(code.steps) / code.steps)
    u, v = reading.u_px[row, column], reading.v_px[row, column]
    phase = np.outer(code.per_column, u) + np.outer(code.per_row, v)
    along = (np.einsum("ksn,s->kn", frames, turns) * np.exp(-2j * np.pi * phase)).real
    kept = np.median(along / along.mean(axis=0), axis=1)
    tried = np.arange(0.0, _WIDEST_PX, _STEP_PX)
    model = kept_of(tried, code, footprint_px2=footprint_px2)
    off = ((kept / kept.mean() - model / model.mean(axis=1, keepdims=True)) ** 2).sum(axis=1)
    return float(tried[int(np.argmin(off))])


def kept_of(circles_px: Floats, code: Stripes, *, footprint_px2: float) -> Floats:
    """(N, K) share of their modulation that stripes keep through circles (N,) of some diameters.

    ``footprint_px2`` is half the variance of what a pixel sees without any.
    """
    frequency = np.hypot(code.per_column, code.per_row)
    x = np.pi * np.outer(circles_px, frequency)
    disc = np.where(x > 0.0, 2.0 * special.j1(x) / np.where(x > 0.0, x, 1.0), 1.0)
    return np.asarray(disc * np.exp(-footprint_px2 * (2.0 * np.pi * frequency) ** 2))


def blurred(levels: Levels, light: Floats32, *, circle_px: float) -> tuple[NDArray[np.uint16], Floats32]:
    """What a lens makes of frames (H, W, F) whose levels have some light (L,): levels, and their light.

    O(H·W·F·circle²).
    """
    most = float(light.max())
    disc = _disc(circle_px)
    table = (light / most).astype(np.float32)
    out = np.empty(levels.shape, np.uint16)
    for frame in range(levels.shape[-1]):
        seen = cv2.filter2D(table[levels[..., frame]], cv2.CV_32F, disc, borderType=cv2.BORDER_REPLICATE)
        out[..., frame] = np.rint(np.clip(seen, 0.0, 1.0) * _LEVELS)
    return out, np.linspace(0.0, most, _LEVELS + 1, dtype=np.float32)


def penumbra_sigma_px(radiance: Floats32, *, known: Bools, circles_px: Floats32) -> Floats32:
    """Standard deviation (h, w) of columns where a part of the lens is hidden.

    Parameters
    ----------
    radiance
        (h, w) what each camera pixel sees of white light.
    known
        (h, w) True where a column is: what is dark and has one is paint, and no shadow.
    circles_px
        (h, w) diameters of the blur circles.

    Notes
    -----
    Of a disc cut by a straight edge that leaves a share φ, the middle lies 0.85 (1 - φ) radii off (within 7 %
    from φ = 0.1 to 0.9). The share is what a pixel has of the brightest light within a few pixels, where a
    shadow lies within as few; which way the edge runs nobody asks. O(pixels).

    """
    even = ndimage.gaussian_filter(np.nan_to_num(radiance), _SMOOTH_PX)
    brightest = ndimage.maximum_filter(even, 2 * _AROUND_PX + 1)
    shadow = ~known & (even < _SHADOW * brightest)
    beside = ndimage.maximum_filter(shadow, 2 * _AROUND_PX + 1)
    hidden = 1.0 - even / np.maximum(brightest, np.float32(1e-12))
    beyond = np.where(beside, np.maximum(hidden - _SHADING, 0.0), 0.0)
    return np.asarray(0.5 * _OFF * circles_px * beyond, np.float32)


def _disc(circle_px: float) -> Floats32:
    """An even disc on pixels: each has the share of it that lies within, counted on a fine grid."""
    reach, fine = int(np.ceil(0.5 * circle_px + 0.5)), 16
    at = (np.arange((2 * reach + 1) * fine) + 0.5) / fine - reach - 0.5
    inside = (np.hypot(*np.meshgrid(at, at)) <= 0.5 * circle_px).astype(float)
    shares = inside.reshape(2 * reach + 1, fine, 2 * reach + 1, fine).sum(axis=(1, 3))
    return np.asarray(shares / shares.sum(), np.float32)
