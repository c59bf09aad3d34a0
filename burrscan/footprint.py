"""From where a pixel's light comes to where the pixel looks: columns taken to the pixels' centres.

A pixel reads the column at the centroid of the light in its footprint. Where the metal's brightness changes
from pixel to pixel (a highlight's slope, the border of a stain, a burr's flank) that centroid lies beside the
pixel's centre, and the point on the centre's ray would be off by the centroid's way over the tangent of the
triangulation angle: a tenth of a millimetre at the border of a bright spot, which looks like a burr.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats, Floats32
from burrscan.correspondence import Correspondence
from burrscan.shifted import shifted

_LONGEST_STEP_PX = 2.0
"""Columns of neighbouring pixels further apart than twice their usual distance have a jump between them; a
projector pixel is about as large as a camera pixel."""

_FLAT = 1e-3
"""Change of log brightness per pixel below which an exponential is a ramp, to six digits."""
_DARK = 1e-3
"""Of a pixel's light, what is no light beside it: noise may leave none, or less."""
_GOES_ON = (0.15, 2.0)
"""Change of log brightness beyond both neighbours, over that between them: 0 beside a step, 1 along an
exponential. Between these the truth is at the exponential's centroid, below 0.15 at the step's (rendered
wheels, 54,000 pixels on the flanks of highlights and on the borders of blemishes and burrs)."""
_OFF_FALL, _OFF_EITHER = 0.3, 0.5
"""Standard deviation of the centroid over the distance of both models: where light goes on falling, as
measured likewise; where either may be right, half of it, for the centroid is taken midway."""
_PEAK, _OFF_PEAK = 0.1, 0.2
"""Share of a pixel's light that both its neighbours lack from which on it is no noise; and per share beyond,
the standard deviation of the centroid, in pixels: a glint narrower than a pixel may lie anywhere in it, 0.29
if all places are alike. On 33 rendered wheels, of pixels with over two fifths such light, 4.8 % were over
five of their stated deviations off without it, and 0.3 % are with it."""
_LACKS, _OFF_LACKING = 0.5, 0.5
"""Share of its light that a pixel lacks from which on a gap is beside it: on turned metal up to a third is
its own, and moves no centroid. And per share the standard deviation of the centroid, in pixels: it is as far
off if all that a pixel lacks is on one side, and on 16 rendered wheels half of such pixels were off by more
than 0.2 of one, at a stated 0.02 to 0.1."""


def at_centres(correspondence: Correspondence, radiance: Floats32 | None) -> Correspondence:
    """Columns as the pixels' centres would read them.

    Parameters
    ----------
    correspondence
        Columns at the centroids of the light.
    radiance
        (h, w) light of each pixel under full white, in any unit, NaN where it is not known; None leaves the
        columns as they are.

    Returns
    -------
    Correspondence
        Its sigmas are wider where the centroid is uncertain.

    Notes
    -----
    Along each direction the brightness within a pixel falls exponentially from one neighbour to the other, as
    the flank of a highlight does, or steps between them at the place that gives the pixel's own light, as at
    the border of a stain. Where it goes on changing beyond both neighbours it falls; else the centroid is
    taken midway. Beside a gap as narrow as a pixel or two, such as a burr's shadow, neither neighbour is as
    bright or as dark as what lies in the pixel: what it lacks is on the gap's side, if the gap is quite
    dark, and the centroid is taken midway again. O(pixels).

    """
    if radiance is None:
        return correspondence
    u_px = correspondence.u_px.astype(float)
    shift, variance = np.zeros(u_px.shape), np.zeros(u_px.shape)
    for direction in (0, 1):
        centroid, sigma = centroids(radiance.astype(float), direction)
        slope = _slope(u_px, direction)
        shift += slope * centroid
        variance += (slope * sigma) ** 2
    return replace(
        correspondence,
        u_px=(u_px - shift).astype(np.float32),
        sigma_u_px=np.hypot(correspondence.sigma_u_px, np.sqrt(variance)).astype(np.float32),
    )


def centroids(radiance: Floats, direction: int) -> tuple[Floats, Floats]:
    """Centroid of the light in each pixel along rows (0: down) or columns (1: to the right), and its sigma.

    Both (h, w) in pixels from the centre; 0 at the border of the image and beside unknown light.
    """
    light = np.where(radiance > 0.0, radiance, np.nan)
    dark = _DARK * light
    near, far = _beside(radiance, direction), _beside(radiance, direction, by=2)
    before, after = np.maximum(near, dark)
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        rate = 0.5 * np.log(after / before)  # of an exponential, per pixel
        fall = np.where(np.abs(rate) > _FLAT, 0.5 / np.tanh(0.5 * rate) - 1.0 / rate, rate / 12.0)
        # the step lies at s from the centre: before · (s + 1/2) + after · (1/2 - s) is the pixel's light
        s = np.clip((radiance - 0.5 * (before + after)) / (before - after), -0.5, 0.5)
        step = (before - after) * (s * s - 0.25) / (2.0 * radiance)
        further = np.maximum(far, dark)
        outside = np.log(before / further[0]) + np.log(further[1] / after)
        share = outside / (2.0 * rate)
        goes_on = (share > _GOES_ON[0]) & (share < _GOES_ON[1])
        peak = np.maximum(1.0 - _PEAK - np.maximum(before, after) / light, 0.0)
    fall, step = np.nan_to_num(fall, posinf=0.0, neginf=0.0), np.nan_to_num(step, posinf=0.0, neginf=0.0)
    sigma = np.where(goes_on, _OFF_FALL, _OFF_EITHER) * np.abs(step - fall)
    sigma = np.hypot(sigma, _OFF_PEAK * np.nan_to_num(peak))
    centroid = np.where(goes_on, fall, 0.5 * (fall + step))
    first, last = _lacking(radiance, near, far, direction)
    gap = (first > 0.0) | (last > 0.0)
    sigma = np.hypot(sigma, _OFF_LACKING * np.maximum(first, last))
    return np.where(gap, 0.5 * (centroid + 0.5 * (first - last)), centroid), sigma


def _lacking(
    radiance: Floats, near: tuple[Floats, Floats], far: tuple[Floats, Floats], direction: int
) -> tuple[Floats, Floats]:
    """(h, w) shares of its light that a pixel lacks beside a gap of a pixel or two, before it or after it.

    A shadow, or a dark flank, between two bright surfaces: the pixels on either side of it lack light that
    those beyond them have, each going on as it comes. 0 elsewhere. ``near`` and ``far`` are the images one
    pixel and two before and after.
    """
    with np.errstate(invalid="ignore", divide="ignore"):
        before, after = (
            np.nan_to_num(1.0 - radiance / (one * np.minimum(one / two, 1.0)), posinf=0.0, neginf=0.0)
            for one, two in zip(near, far, strict=True)
        )
    first = (after > _LACKS) & (_beside(before, direction)[0] > _LACKS)
    last = (before > _LACKS) & (_beside(after, direction)[1] > _LACKS)
    return np.where(first, after, 0.0), np.where(last, before, 0.0)


def _slope(u_px: Floats, direction: int) -> Floats:
    """Change of the column per pixel: the mean of both sides, or of the one that is known and has no jump."""
    before, after = _beside(u_px, direction)
    steps = np.stack([u_px - before, after - u_px])
    with np.errstate(invalid="ignore"):
        steps = np.where(np.abs(steps) <= _LONGEST_STEP_PX, steps, np.nan)
    known = np.isfinite(steps)
    return np.asarray(np.nan_to_num(steps).sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def _beside(image: Floats, direction: int, *, by: int = 1) -> tuple[Floats, Floats]:
    """The image one pixel (or more) before and after; NaN beyond the border."""
    down, right = (by, 0) if direction == 0 else (0, by)
    return shifted(image, -down, -right), shifted(image, down, right)
