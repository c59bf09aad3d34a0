"""Where the line of changed light is that a burr draws on its part: its middle, whatever the depths say.

With camera and projector in one plane along the burr, its flanks lean away to both sides alike. Both send the
light elsewhere, so the line is its own mirror image about the burr's middle (centre of symmetry: Reisfeld,
Wolfson & Yeshurun 1995), also on metal, where the depth of a flank is often that of light which bounced.
"""

from __future__ import annotations

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.generatrix.deviation import feet_of
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Inspection, Value
from burrscan.pose import placed
from burrscan.sight import Sight

PIECES = 6
"""Of a burr's length, each left out once: how much the place hangs on one of them is its uncertainty."""
_LINE, _BESIDE, _FAR = 1.2, 1.3, 2.2
"""Burr widths from its middle: so far reaches the line at most, and from here to there is the bare part."""
_PER_PIXEL = 8
"""Places across the burr for each pixel: the profile is continuous there, sampled by rows at a slant."""
_STANDS_OUT = 5.0
"""Standard deviations of the bare part's logarithm by which the line must differ from it."""
_LOPSIDED = 0.1
"""Share of the line that its mirror image must not leave: a line that is lit from one side has no middle."""
_NARROWEST = 0.75
"""Burr widths that a line must have: a narrower one is that of one flank, beside another that is lit."""
_LEAST_ROWS = 0.5
"""Share of a piece's rows whose light must be known at a place."""


def shade_centre(
    sight: Sight,
    inspection: Inspection,
    T_camera_burr: Floats,
    *,
    width_mm: float,
    length_mm: float,
    middle_mm: float,
    pixel_mm: float,
) -> Value | None:
    """The middle of a burr's line of changed light across it, mm from the origin of its pose.

    Parameters
    ----------
    sight, inspection
        Of the look, both in the camera's frame.
    T_camera_burr
        (4, 4) about where the burr is: x along it, z out of the surface.
    width_mm, length_mm
        The burr's.
    middle_mm
        About where its middle is across it, to half of its width.
    pixel_mm
        What a pixel spans there.

    Returns
    -------
    Value or None
        Of the line's centre of symmetry and the middle of its edges, with the jackknife's standard deviation
        over pieces of the length (Efron & Tibshirani 1993, chapter 11) and half of what the two differ by:
        they agree for a line that is its own mirror image. None where no line stands out, or it is not.

    Notes
    -----
    O(length × width / pixel²).

    """
    step = pixel_mm / _PER_PIXEL
    across = np.arange(-_FAR * width_mm, _FAR * width_mm + 0.5 * step, step)
    rows = max(int(0.9 * length_mm / (0.5 * pixel_mm)) // PIECES, 1) * PIECES
    along = np.linspace(-0.45, 0.45, rows) * length_mm
    light = _log_light(sight, inspection, T_camera_burr, along, middle_mm + across)
    pieces = _profiles(light)
    if pieces is None:
        return None
    whole = _centre(across, pieces.mean(axis=0), width_mm)
    without = [_centre(across, np.delete(pieces, k, axis=0).mean(axis=0), width_mm) for k in range(PIECES)]
    if whole is None or any(one is None for one in without):
        return None
    spread = np.var([sum(one) / 2.0 for one in without if one is not None]) * (PIECES - 1)
    return Value(middle_mm + sum(whole) / 2.0, float(np.hypot(np.sqrt(spread), 0.5 * (whole[0] - whole[1]))))


def _log_light(
    sight: Sight, inspection: Inspection, T_camera_burr: Floats, along: Floats, across: Floats
) -> Floats:
    """(rows, columns) logarithm of the light at a grid of places on the fitted surface; NaN where unknown."""
    x, y = np.meshgrid(along, across, indexing="ij")
    plane = placed(T_camera_burr, np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1))
    points, on = _on_surface(plane, inspection)
    column, row = sight.rig.camera.project(points).T
    radiance = sight.radiance.astype(float)
    known = np.isfinite(radiance) & (radiance > 0.0)
    image = np.log(np.where(known, radiance, 1.0))
    value = ndimage.map_coordinates(image, [row, column], order=1, mode="nearest")
    share = ndimage.map_coordinates(known.astype(float), [row, column], order=1, mode="constant")
    return np.where(on & (share >= 1.0), value, np.nan).reshape(x.shape)


def _on_surface(points: Floats, inspection: Inspection) -> tuple[Floats, Bools]:
    """(N, 3) the places of the fitted surface nearest to points, camera frame, and where there are any."""
    axis, line = inspection.axis, polyline_of(inspection.generatrix)
    frame = T_part_mesh(axis.point_mm, axis.direction)
    x, y, z = placed(frame, points).T
    radius = np.hypot(x, y)
    foot = feet_of(z, radius, line)
    at = line.places_mm(np.maximum(foot.segment, 0), foot.t)
    share = at[:, 1] / np.maximum(radius, 1e-9)
    return placed(np.linalg.inv(frame), np.stack([share * x, share * y, at[:, 0]], axis=1)), foot.valid


def _profiles(light: Floats) -> Floats | None:
    """(pieces, columns) mean light of each piece of the length; None where much of it is not known."""
    parts = light.reshape(PIECES, -1, light.shape[1])
    known = np.isfinite(parts)
    if known.mean(axis=1).min() < _LEAST_ROWS:
        return None
    total = np.where(known, parts, 0.0).sum(axis=1)
    return np.asarray(total / known.sum(axis=1))


def _centre(across: Floats, profile: Floats, width_mm: float) -> tuple[float, float] | None:
    """Centre of symmetry of what differs from the part beside it, and middle of its edges; None for no line.

    The bare part's light is a parabola: part of a highlight, on either side of the burr.
    """
    bare = np.abs(across) > _BESIDE * width_mm
    fit = np.polynomial.Polynomial.fit(across[bare], profile[bare], 2)
    change = profile - fit(across)
    noise = float(change[bare].std())
    change = np.where(np.abs(across) <= _LINE * width_mm, change, 0.0)
    size = np.abs(change)
    if size.max() < max(_STANDS_OUT * noise, 1e-6):
        return None
    if size.sum() * (across[1] - across[0]) < _NARROWEST * width_mm * size.max():
        return None
    tried = np.arange(-0.5, 0.5, 0.01) * width_mm
    mirrored = np.interp(2.0 * tried[:, None] - across, across, change)
    left = ((change - mirrored) ** 2).sum(axis=1)
    best = int(np.argmin(left))
    if not 0 < best < len(tried) - 1 or left[best] > _LOPSIDED * 2.0 * float((change**2).sum()):
        return None
    before, here, behind = left[best - 1 : best + 2]
    bend = before - 2.0 * here + behind
    shift = 0.5 * (before - behind) / bend if bend > 0.0 else 0.0
    middle = float(tried[best] + shift * (tried[1] - tried[0]))
    edges = [_edge(across, change, middle, side * width_mm) for side in (-1.0, 1.0)]
    return middle, float(np.mean(edges))


def _edge(across: Floats, change: Floats, middle: float, towards_mm: float) -> float:
    """Where the change falls to half of what it is on one side of the middle."""
    away = np.linspace(0.0, _LINE, 200) * towards_mm
    there = np.interp(middle + away, across, change)
    level = float(np.median(there[np.abs(away) < 0.4 * abs(towards_mm)]))
    less = np.flatnonzero(there / level < 0.5) if level != 0.0 else np.zeros(0, np.int64)
    return float(middle + (away[less[0]] if len(less) else away[-1]))
