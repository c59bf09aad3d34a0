"""Is it flat after all? Edges of brightness bend the depth by part of a pixel, to either side in turn.

A pixel across which the brightness changes sees the columns of its brighter part, so its depth is off by up
to half a pixel's worth (Curless & Levoy 1995, section 2). Across a scratch these errors sum to whatever the
line's place within its pixels makes of them, and where the line wanders over pixels that sum changes its
sign. What stands up or is cut in shows the same depths all along.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh, perpendicular_basis
from burrscan.burrs.light.medians import column_medians
from burrscan.burrs.light.row_sigma import row_sigma
from burrscan.burrs.light.section import column_of, triangulated
from burrscan.burrs.light.side import Looks
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.generatrix.polyline import revolved
from burrscan.inspection import Axis, Burr
from burrscan.turns import turn_rad

_BESIDE_CELLS = 2
"""The pixels that an edge crosses reach so far beyond the cells whose depth is off."""
_FEWEST = 2.5
"""Stretches that tell: along a single one a scratch's depths agree as a burr's do, and noise alone makes the
line of a short place wander by a pixel."""
_AGREE = 2.0
"""Standard errors from which the depths of a place agree along it."""
_ALONG_ROWS = 16
"""Rows from which a line that stays within a cell is known to lie along the generatrix: to 3.6 degrees to
either side, which of scratches in all directions is one in 25. Longer lines are surer still; from 10 rows on,
160 rendered wheels gave two burrs more and four false calls on scratches."""
_AGREE_ALONG = 3.0
"""Standard errors, from row to row, by which the depths of such a line must have the sign of what is called.
Of 48 scratches along the generatrix on metal, 0.15 and 0.4 mm wide, five are asked, and have 2.3 at most."""
_THIN_CELLS, _THIN_BASE = 1.5, 0.75
"""A burr that is wider shows in more pixels than one edge crosses: as light shows it, and as depth tells its
base, which is a pixel narrower than what pixels show of it, and as narrow as any that is fitted."""
_UPRIGHT = 0.5
"""Share of a burr's direction along the axis from which rows of the surface cross it."""
_SAME_RADIUS = 0.2
"""Share by which the radius may change along a burr: rows further in or out are of another surface."""
_FEWEST_ROWS = 3
"""Rows from which a mean along them says something."""
_MEASURED = 0.5
"""Share of a burr's cells that need a depth: what hides its surroundings is no scratch."""
_BESIDE_BORDER_CELLS = 4
"""How far beyond what an edge crosses light on either side is looked at."""
_BORDER = 0.4
"""Difference of the light on either side, over its largest step, from which it is a border: the one of a
patch of chatter on a rendered wheel had 0.7, lines at 50 burrs at most 0.08."""
_EDGES_BY_DEPTH, _EDGES_BY_LIGHT = 2.0, 1.0
"""Most that is put down to edges, over what one does. A line has two, which is 1.4 as a root of squares, and
lenses spread them over two pixels. What the light tells of has evidence besides its depth: there one."""


def wanders_flat(cells: Bools, deviation_mm: Floats, *, pixel_mm: float) -> bool:
    """Whether a place runs askew over pixels and its depths cancel along it, as those of a scratch do.

    Parameters
    ----------
    cells
        (rows, columns) of the place on the unrolled surface.
    deviation_mm
        (rows, columns) depth off the surface, NaN where nothing was measured.
    pixel_mm
        By how much a depth is off that the column of the neighbouring pixel tells: no edge bends it further.

    Notes
    -----
    A row's depths are summed across the place. Sums of rows between which the place moves on by a pixel are
    independent, so the place has as many of them as it moves by columns, and one. O(cells).

    """
    rows, columns = np.nonzero(cells)  # row by row, from the left
    used, first, count = np.unique(rows, return_index=True, return_counts=True)
    middles = np.add.reduceat(columns, first) / count
    place = np.arange(cells.shape[1])
    near = place >= (columns[first] - _BESIDE_CELLS)[:, None]
    near &= place <= (columns[first + count - 1] + _BESIDE_CELLS)[:, None]
    depth = np.where(near, np.nan_to_num(deviation_mm[used]), 0.0)
    sums, squares = depth.sum(axis=1), (depth * depth).sum(axis=1)
    stretches = 1.0 + abs(float(np.polyfit(used, middles, 1)[0])) * float(used[-1] - used[0])
    seen = np.isfinite(deviation_mm[cells]).mean() >= _MEASURED
    small = float(np.mean(squares)) <= (0.5 * _EDGES_BY_DEPTH * pixel_mm) ** 2
    return bool(stretches >= _FEWEST and seen and small and not _agree(sums, stretches))


def is_an_edge(burr: Burr, looks: Looks, surface: Unrolled, axis: Axis, *, by_depth: bool) -> bool:
    """Whether what is called a burr is no more than an edge of brightness shows.

    Its depths are no larger than the light beside it explains, and cancel along it, or it is the border of
    something of another brightness, which bends them to one side all along. What the depth tells of
    (``by_depth``) is an edge only where it is no wider than a pixel, then also where it runs askew over
    pixels: a burr that small cannot be told from a scratch by one view, unless it lies along the generatrix
    and its rows show what is called. O(rows of the burr).
    """
    thin = burr.width_mm.value <= (_THIN_BASE if by_depth else _THIN_CELLS) * surface.step_mm
    if by_depth and not thin:
        return False
    rows, middles = _line(burr, surface, axis)
    if len(rows) < _FEWEST_ROWS:
        return False
    half = 0.5 * burr.width_mm.value / surface.step_mm
    on = _across(looks.deviation_mm, rows, middles, half)
    if np.isfinite(np.concatenate(on)).mean() < _MEASURED:
        return False
    depths = _across(looks.deviation_mm, rows, middles, half + _BESIDE_CELLS)
    calm = row_sigma(looks.deviation_mm[rows], least=0.0)
    squares = [
        float(np.nansum(depth**2) - np.isfinite(depth).sum() * sigma**2)
        for depth, sigma in zip(depths, calm, strict=True)
    ]
    light, predicted = (
        _across(image, rows, middles, half + _BESIDE_CELLS) for image in (looks.light, looks.predicted)
    )
    contrast = float(np.median([_largest_step(a - b) for a, b in zip(light, predicted, strict=True)]))
    middle = int(np.clip(np.rint(np.median(middles)), 0, len(surface.angle) - 1))
    most = 0.5 * depth_of_a_pixel_mm(surface, int(np.median(rows)), middle) * (1.0 - np.exp(-contrast))
    edges = _EDGES_BY_DEPTH if by_depth else _EDGES_BY_LIGHT
    if np.mean(squares) > (edges * most) ** 2:
        return False
    border = _is_a_border(looks, rows, middles, half + _BESIDE_CELLS, contrast=contrast)
    return border or not _is_shown(burr, depths, middles, thin=thin)


def _is_shown(burr: Burr, depths: list[Floats], middles: Floats, *, thin: bool) -> bool:
    """Whether the depths of a line's rows show a burr: a long one's its side, others' the same all along."""
    sums = np.array([np.nansum(depth) for depth in depths])
    stretches = 1.0 + float(np.ptp(middles))
    along = len(depths) >= _ALONG_ROWS and stretches <= 2.0
    called = burr.sign * sums.mean() > 0.0
    if along and called and _agree(sums, len(sums), least=_AGREE_ALONG):
        return True
    askew = thin and stretches >= _FEWEST
    return not askew and _agree(sums, stretches)


def _is_a_border(
    looks: Looks, rows: Sequence[int], middles: Floats, reach: float, *, contrast: float
) -> bool:
    """Whether light is another on either side of a line; beside a burr, and a scratch, it is as usual."""
    half = 0.5 * _BESIDE_BORDER_CELLS
    sides = []
    for place in (middles - reach - half, middles + reach + half):
        light, predicted = (
            np.concatenate(_across(image, rows, place, half)) for image in (looks.light, looks.predicted)
        )
        sides.append(column_medians((light - predicted)[:, None])[0])
    return bool(abs(sides[1] - sides[0]) > _BORDER * contrast)


def _across(image: Floats, rows: Sequence[int], middles: Floats, reach: float) -> list[Floats]:
    """Of each row the cells within ``reach`` of its middle."""
    return [image[row, _cells(at - reach, at + reach)] for row, at in zip(rows, middles, strict=True)]


def _cells(first: float, last: float) -> slice:
    return slice(max(int(np.floor(first)), 0), int(np.ceil(last)) + 1)


def _agree(sums: Floats, stretches: float, *, least: float = _AGREE) -> bool:
    """Whether the depths of a line's rows are alike along it, counted in independent stretches."""
    return bool(abs(float(sums.mean())) * np.sqrt(stretches) >= least * float(sums.std()))


def _line(burr: Burr, surface: Unrolled, axis: Axis) -> tuple[Sequence[int], Floats]:
    """Rows of the unrolled surface that a burr crosses, and the column of its middle in each.

    None for a burr around the axis, or on a face.
    """
    T_part_burr = T_part_mesh(axis.point_mm, axis.direction) @ burr.T_mesh_burr
    (x, y, z), along = T_part_burr[:3, 3], T_part_burr[:3, 0]
    r, angle = float(np.hypot(x, y)), float(np.arctan2(y, x))
    around = -along[0] * np.sin(angle) + along[1] * np.cos(angle)
    if abs(along[2]) < max(abs(around), _UPRIGHT):
        return [], np.zeros(0)
    inside = (surface.z_mm >= burr.z_start_mm.value) & (surface.z_mm <= burr.z_end_mm.value)
    rows = np.flatnonzero(inside & (np.abs(surface.r_mm - r) < _SAME_RADIUS * r))
    turned = angle + around / along[2] * (surface.z_mm[rows] - z) / r
    wrapped = turn_rad(turned - surface.angle[len(surface.angle) // 2])
    middles = len(surface.angle) // 2 + wrapped / (surface.angle[1] - surface.angle[0])
    on = (middles >= 0.0) & (middles <= len(surface.angle) - 1)
    return rows[on].tolist(), middles[on]


def _largest_step(excess: Floats) -> float:
    """Largest change of the logarithm of the light from one cell to the next; 0 where it is not known."""
    steps = np.abs(np.diff(excess))
    return float(np.nanmax(steps)) if np.isfinite(steps).any() else 0.0


def depth_of_a_pixel_mm(surface: Unrolled, row: int, column: int) -> float:
    """By how much a depth at a cell is off that the column of the neighbouring pixel tells."""
    place = np.array([[surface.z_mm[row], surface.r_mm[row]]])
    turns = np.array([0.0, -0.5, 0.5]) * surface.step_mm / surface.r_mm[row]
    middle, *ends = revolved(place, surface.angle[column] + turns)[0]
    square = perpendicular_basis(surface.columns)
    ray = (middle - surface.camera_mm) / np.linalg.norm((middle - surface.camera_mm)[:2])
    depths = []
    for end in ends:
        through = column_of(*end, surface.projector_mm, square)
        depths.append(triangulated(surface.camera_mm, ray, surface.projector_mm, square, through))
    return float(abs(depths[1] - depths[0]))
