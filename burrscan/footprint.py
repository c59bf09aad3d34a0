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
    Along each direction the brightness within a pixel is something between a ramp through its neighbours and
    a step between them at the place that gives the pixel's own light; the centroid is taken midway between
    those of both, and their distance is that of two standard deviations. O(pixels).

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
    before, after = _beside(radiance, direction)
    with np.errstate(invalid="ignore", divide="ignore"):
        ramp = np.clip((after - before) / (24.0 * radiance), -1.0 / 6.0, 1.0 / 6.0)
        # the step lies at s from the centre: before · (s + 1/2) + after · (1/2 - s) is the pixel's light
        s = np.clip((radiance - 0.5 * (before + after)) / (before - after), -0.5, 0.5)
        step = (before - after) * (s * s - 0.25) / (2.0 * radiance)
    ramp, step = np.nan_to_num(ramp, posinf=0.0, neginf=0.0), np.nan_to_num(step, posinf=0.0, neginf=0.0)
    return 0.5 * (ramp + step), 0.5 * np.abs(ramp - step)


def _slope(u_px: Floats, direction: int) -> Floats:
    """Change of the column per pixel: the mean of both sides, or of the one that is known and has no jump."""
    before, after = _beside(u_px, direction)
    steps = np.stack([u_px - before, after - u_px])
    with np.errstate(invalid="ignore"):
        steps = np.where(np.abs(steps) <= _LONGEST_STEP_PX, steps, np.nan)
    known = np.isfinite(steps)
    return np.asarray(np.nan_to_num(steps).sum(axis=0) / np.maximum(known.sum(axis=0), 1))


def _beside(image: Floats, direction: int) -> tuple[Floats, Floats]:
    """The image one pixel before and one pixel after; NaN beyond the border."""
    step = (1, 0) if direction == 0 else (0, 1)
    return shifted(image, -step[0], -step[1]), shifted(image, *step)
