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
_BESIDE, _FAR = 1.3, 3.0
"""Burr widths from its middle: from here to there is the bare part."""
_SHARP, _BROAD = 0.12, 2.0
"""Burr widths: changes between these are a burr's; narrower is a pixel's grain, broader a highlight."""
_MIRRORED_LOG, _MIRRORED = 1.5, 1.0
"""Burr widths to each side over which the line is compared with its mirror image: as logarithm, in which the
faint light beside it counts as well, and as it is, in which bright flanks do."""
_SEARCHED = 0.5
"""Burr widths from the place found by the logarithm in which it is told exactly."""
_PER_PIXEL = 8
"""Places across the burr for each pixel: the profile is continuous there, sampled by rows at a slant."""
_GRAIN = 1.0 / 30.0
"""Of a pixel: a standard deviation that all pieces share, of edges that pixels cut (measured: 128 looks)."""
_STANDS_OUT = 5.0
"""Standard deviations of the bare part's logarithm by which the line must differ from it."""
_ALIKE = 0.7
"""Share of the line's energy that its mirror image must have too (1: the same, 0: unlike, -1: opposite)."""
_NARROWEST = 0.6
"""Burr widths that a line must have: that of one flank alone, beside another that is lit, has half of one,
and a width is called to a fifth."""
_LEAST_ROWS = 0.5
"""Share of a piece's rows whose light must be known at a place."""


def shade_centre(
    sight: Sight,
    inspection: Inspection,
    T_camera_burr: Floats,
    *,
    width_mm: float,
    length_mm: float,
    reach_mm: float,
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
    reach_mm
        How far across it from there it may be.
    pixel_mm
        What a pixel spans there.

    Returns
    -------
    Value or None
        Mean of two centres of symmetry, of the light and of its logarithm, with the jackknife's standard
        deviation over pieces of the length (Efron & Tibshirani 1993, chapter 11), half of what the two differ
        by, and what pixels cut off edges. None where no line stands out, or it has no middle.

    Notes
    -----
    O(length × (reach + width) × width / pixel³).

    """
    step = pixel_mm / _PER_PIXEL
    wide = float(np.hypot(width_mm, pixel_mm))
    half = reach_mm + _FAR * wide
    across = np.arange(-half, half + 0.5 * step, step)
    rows = max(int(0.9 * length_mm / (0.5 * pixel_mm)) // PIECES, 1) * PIECES
    along = np.linspace(-0.45, 0.45, rows) * length_mm
    light = _log_light(sight, inspection, T_camera_burr, along, across)
    profiles = _profiles(light)
    if profiles is None:
        return None
    there, pieces = profiles
    across = across[there]
    sharp, broad = _SHARP * wide / step, _BROAD * wide / step
    change = ndimage.gaussian_filter1d(pieces, sharp) - ndimage.gaussian_filter1d(pieces, broad)
    alike = _mirrored(change, round(_MIRRORED_LOG * wide / step))
    about = _best(alike, across, 0.0, reach_mm)
    if about is None or not _is_line(pieces.mean(axis=0), across - about, wide):
        return None
    plain = _over_bare(np.exp(pieces), across - about, wide)
    same = _mirrored(ndimage.gaussian_filter1d(plain, sharp), round(_MIRRORED * wide / step))
    centres, spreads = [], []
    for each in (alike, same):
        whole = _best(each, across, about, _SEARCHED * wide)
        without = [_best(np.delete(each, k, axis=1), across, about, _SEARCHED * wide) for k in range(PIECES)]
        known = [one for one in without if one is not None]
        if whole is None or len(known) < PIECES:
            return None
        centres.append(whole)
        spreads.append(float(np.var(known)) * (PIECES - 1))
    differ = 0.5 * (centres[0] - centres[1])
    sigma = np.sqrt(np.mean(spreads) + differ**2 + (_GRAIN * pixel_mm) ** 2)
    return Value(float(np.mean(centres)), float(sigma))


def _mirrored(change: Floats, half: int) -> Floats:
    """(2, pieces, columns) what each place's two sides have in common, and what there is on both.

    The first is the convolution of the change with itself, over ``half`` columns to each side: largest about
    the centre of a line that is its own mirror image. Pieces weigh by the root of their energy: a glint in
    one does not drown the others, nor do those without a line.
    """
    common, all_of_it = np.zeros_like(change), np.zeros_like(change)
    columns, beyond = change.shape[1], np.pad(change, ((0, 0), (half, half)))
    for away in range(1, half + 1):
        right, left = (beyond[:, half + by : half + by + columns] for by in (away, -away))
        common += right * left
        all_of_it += 0.5 * (right**2 + left**2)
    weight = 1.0 / np.sqrt(np.maximum(all_of_it.max(axis=1, keepdims=True), 1e-30))
    return np.stack([weight * common, weight * all_of_it])


def _best(mirrored: Floats, across: Floats, about: float, reach: float) -> float | None:
    """Where the sides have most in common; None where that is too little, or at an end of the search."""
    common, all_of_it = mirrored.sum(axis=1)
    inside = np.flatnonzero(np.abs(across - about) <= reach)
    k = int(inside[np.argmax(common[inside])])
    if k in (inside[0], inside[-1]) or common[k] < _ALIKE * all_of_it[k]:
        return None
    return float(across[k] + top_of(common, k) * (across[1] - across[0]))


def top_of(values: Floats, k: int) -> float:
    """Where the parabola through the ``k``-th of even values and its neighbours is highest, steps from k."""
    before, here, behind = values[k - 1 : k + 2]
    bend = before - 2.0 * here + behind
    return 0.5 * float((before - behind) / bend) if bend < 0.0 else 0.0


def _bare(beside: Floats, wide: float) -> Bools:
    """(columns,) those of the part beside the burr."""
    return np.asarray((np.abs(beside) > _BESIDE * wide) & (np.abs(beside) < _FAR * wide))


def _over_bare(profiles: Floats, beside: Floats, wide: float) -> Floats:
    """(pieces, columns) what differs from the bare part, whose light is a parabola: part of a highlight."""
    bare = _bare(beside, wide)
    fits = np.polynomial.polynomial.polyfit(beside[bare], profiles[:, bare].T, 2)
    return np.asarray(profiles - np.polynomial.polynomial.polyval(beside, fits))


def _is_line(profile: Floats, beside: Floats, wide: float) -> bool:
    """Whether a line of the burr's width stands out there."""
    change = _over_bare(profile[None], beside, wide)[0]
    size = np.abs(np.where(np.abs(beside) <= _BESIDE * wide, change, 0.0))
    if size.max() < max(_STANDS_OUT * float(change[_bare(beside, wide)].std()), 1e-6):
        return False
    return bool(size.sum() * (beside[1] - beside[0]) >= _NARROWEST * wide * size.max())


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


def _profiles(light: Floats) -> tuple[slice, Floats] | None:
    """The columns around the middle whose light is known, and (pieces, columns) the mean of each piece there.

    None where the middle's own is not.
    """
    parts = light.reshape(PIECES, -1, light.shape[1])
    known = np.isfinite(parts)
    unknown = np.flatnonzero(known.mean(axis=1).min(axis=0) < _LEAST_ROWS)
    middle = light.shape[1] // 2
    if middle in unknown:
        return None
    end = int(np.searchsorted(unknown, middle))
    first = int(unknown[end - 1]) + 1 if end else 0
    there = slice(first, int(unknown[end]) if end < len(unknown) else light.shape[1])
    total = np.where(known, parts, 0.0).sum(axis=1)[:, there]
    return there, np.asarray(total / known.sum(axis=1)[:, there])
