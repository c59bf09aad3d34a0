"""What light along an edge has that edge and faces do not explain, and where depth is not the surface's.

Beside an edge a pixel sees shares of its two faces that depend on how far from the edge it lies, by fractions
of a pixel (the edge-spread function of a slanted edge, ISO 12233). The faces show what they are like a few
pixels further in. So along each half-pixel beside the edge light is a mixture of theirs; and a rounding adds
a glint where it mirrors the projector. Of 164 rendered burrs on edges this lets 79 be seen, and on three of
560 scans what is none; with shares that change along the edge, and within a row, 76 and three, and 64 and two
with shares that bend, which are like a long burr.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.along_edges.strips import REACH, Strip
from burrscan.robust import SIGMA_PER_MEDIAN, TUKEY

_FACES = (5.0, 8.0)
"""Pixels beside an edge between which its faces show what they are like: a burr is narrower."""
_SMOOTH = 2.0
"""Pixels along the edge over which that is smoothed: less than what a burr is long, more than noise."""
_ROW = 0.5
"""Width of a row of alike pixels: the edge-spread function changes little over it."""
_GLINTS = np.radians([3.0, 8.0, 20.0])
"""Widths of the glint of a rounding, from polished to turned metal."""
_DARK = 0.05
"""Of the median light along the edge; less is shadow, whose shares of anything are noise."""
_NOISY, _OVER = 0.2, 8.0
"""Share by which the light of a face differs from pixel to pixel, over so many along the edge, from which on
it is noise: of lit metal it is 0.02 to 0.1, of an end face in the dark 0.3, whose noise has steps."""
_FEWEST = 40
"""Pixels of a row: it has five unknowns."""
_STEPS = (4, 8)
"""Of reweighting: first with weights that shut nothing out, then with those that do."""
_ODD = 4.5
"""Robust deviations of its row from which a depth is odd."""
_FEWEST_DEPTHS = 20
"""Of a row of pixels; of fewer nobody knows what is usual, and only what has none is odd."""


def unexplained(strip: Strip, radiance: Floats) -> Floats:
    """(P,) light over what explains it, less one; NaN where that is unknown. O(P).

    ``radiance`` is the strip's pixels' light, (P,).
    """
    faces, noise = _faces_light(strip, radiance)
    share = np.full(len(radiance), np.nan)
    brighter = np.arange(len(faces)), faces.argmax(axis=1)
    lit = (faces[brighter] > _DARK * float(np.median(radiance))) & (noise[brighter] < _NOISY)
    for low in np.arange(-float(REACH), float(REACH), _ROW):
        row = np.flatnonzero((strip.off_px >= low) & (strip.off_px < low + _ROW) & lit)
        if len(row) >= _FEWEST:
            glints = np.exp(-0.5 * (strip.from_mirror[row, None] / _GLINTS) ** 2) * float(faces[row].mean())
            share[row] = _rest(faces[row], glints, radiance[row], 1.0 / faces[row].max(axis=1))
    return share


def _faces_light(strip: Strip, radiance: Floats) -> tuple[Floats, Floats]:
    """(P, 2) what the faces before and behind the edge are like beside each pixel; 0 where there is none.

    And by what share their pixels differ from that.
    """
    length = int(strip.arc_px.max()) + 2
    light, noise = np.zeros((2, len(radiance), 2))
    for face, side in enumerate((-1.0, 1.0)):
        inner = (side * strip.off_px > _FACES[0]) & (side * strip.off_px < _FACES[1])
        at = np.rint(strip.arc_px[inner]).astype(np.int64)
        mean = _along(at, radiance[inner], length, _SMOOTH)
        off = radiance[inner] / np.maximum(mean[at], 1e-12) - 1.0
        light[:, face] = np.interp(strip.arc_px, np.arange(length), mean)
        noise[:, face] = np.interp(
            strip.arc_px, np.arange(length), np.sqrt(_along(at, off**2, length, _OVER))
        )
    return light, noise


def _along(at: Ints, values: Floats, length: int, over: float) -> Floats:
    """(length,) mean of values at places along the edge, smoothed; 0 where there are few."""
    sums = np.bincount(at, values, length), np.bincount(at, minlength=length).astype(np.float64)
    total, count = (ndimage.gaussian_filter1d(each, over) for each in sums)
    return np.where(count > 0.2, total / np.maximum(count, 0.2), 0.0)


def _rest(faces: Floats, glints: Floats, light: Floats, scale: Floats) -> Floats:
    """What a robust fit by faces (N, 2) and glints (N, 3) leaves of light, as a share of what it explains.

    Or of the faces' light, 1 / ``scale``, if that is more. A glint's light is known to a share of it: twenty
    times that of the faces, on a rounding less than a pixel wide, it differed by three of theirs from one
    pixel to the next.

    Tukey's weights, from a convex start. A glint adds light: one that would take some away is none (active
    sets, Lawson & Hanson 1974).
    """
    weight = np.ones(len(light))
    rest = np.zeros(len(light))
    for step in range(sum(_STEPS)):
        by = weight * scale
        while True:
            model = np.hstack([faces, glints])
            fit = np.linalg.lstsq(model * by[:, None], light * by, rcond=1e-8)[0]
            adds = fit[faces.shape[1] :] >= 0.0
            if adds.all():
                break
            glints = glints[:, adds]
        rest = (light - model @ fit) * scale
        size = np.abs(rest) / (SIGMA_PER_MEDIAN * float(np.median(np.abs(rest))) + 1e-6)
        inside = np.maximum(1.0 - (size / TUKEY) ** 2, 0.0)
        weight = 1.0 / np.sqrt(1.0 + size**2) if step < _STEPS[0] else inside
    return rest / np.maximum(scale * (model @ fit), 1.0)


def odd_depths(strip: Strip, deviation_mm: Floats) -> Bools:
    """(P,) True where a pixel has no depth, or not that of its row along the edge. O(P).

    ``deviation_mm`` (P,) from the ideal surface, NaN without depth. A row is a pixel wide.
    """
    known = np.isfinite(deviation_mm)
    odd = ~known
    number = np.floor(strip.off_px).astype(np.int64)
    for row in np.unique(number):
        on = np.flatnonzero(number == row)
        depths = deviation_mm[on][known[on]]
        if len(depths) >= _FEWEST_DEPTHS:
            middle = float(np.median(depths))
            spread = SIGMA_PER_MEDIAN * float(np.median(np.abs(depths - middle))) + 1e-3
            odd[on] = ~(np.abs(deviation_mm[on] - middle) <= _ODD * spread)
    return odd
