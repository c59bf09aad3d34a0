"""The (z, r) plane cut into cells: where the data lie, how thick they are, over how much of the arc.

Everything here is computed from all vertices, so that their order does not matter.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.errors import InputError
from burrscan.generatrix.profile import Profile

ARC_BINS = 64
"""Angular bins of a coverage mask, over the arc that the data span."""
_FINE = 16
"""Parts of an angular bin: a burr is narrower than a bin, and where it is the surface below it is not."""
_MEET = 0.3
"""Share of the parts in which two cells would meet by chance, below which they exclude each other."""
_CROWDED = 0.4
"""Parts in which a cell's vertices are, over those in which they would be by chance: below this share of what
a stronger cell nearby has they crowd, as a narrow burr's do. Lugs and grooves differ by less than half."""
_TELLING = 8.0
"""Parts in which two cells must be expected to meet: of eight two or fewer are left by chance in 1 of 70."""
_ANOMALY = 0.05
"""Burrs and nicks are looked for within this share of the largest radius."""
_TAIL = 0.25
"""A cell with less data than this share of a neighbour's is the tail of the noise."""
_SPARSE = 0.02
"""Share of a typical cell's count, under which a cell holds strays and not the curve."""
_LEAST_COVERAGE = 0.12
"""Share of the arc, relative to the best covered cell, that a surface of revolution must cover."""
_OPPOSED = -0.5
"""Product of two cells' mean normals under which they are two sides of a wall: both look clearly one way."""
_TOLD = 4
"""Vertices on a patch, of a cell's side by an arc's bin, from which their number tells how far apart they
are: a number of four is known to its half, a distance to a quarter."""
_SHAPE = 0.5
"""A thickness that falls below this share in cells of half the side is the shape's: a step or a corner gives
a share of the side, a bend of its square, noise the same."""
_THIRD = 0.3
"""Share of the surface that is no thicker than the noise says: edges, corners and burrs are on the rest."""
Looks = tuple[Floats, Floats, Floats, Floats]
"""Of faces: centres (z, r), and area-weighted normals along the axis and away from it, (T,) each."""
_ROWS = 8.0
"""Vertex spacings that a cell must span to show the thickness of the data."""


@dataclass(frozen=True)
class Scale:
    """What resolution the data allow.

    Parameters
    ----------
    low_mm, high_mm
        (2,) corners of the (z, r) box that holds all but the outliers.
    noise_mm
        Thickness (one sigma) of the data along the normal of the curve.
    spacing_mm
        Distance between neighbouring vertices on the surface.
    thinnest_mm
        The smaller of the ranges of z and r: no wall is thinner in the simplest parts.
    arc
        (start, extent) of the angular range with data, radians.

    """

    low_mm: Floats
    high_mm: Floats
    noise_mm: float
    spacing_mm: float
    thinnest_mm: float
    arc: tuple[float, float]

    @property
    def cell_mm(self) -> float:
        """Side of a cell: two vertices wide, and wide enough that the band of noise fits in."""
        return max(self._finest_mm, 6.0 * self.noise_mm)

    @property
    def node_mm(self) -> float:
        """Spacing of the curve's nodes.

        At least five sigma: over a spacing d, a tilt of the curve turns noise into a slope of 12 (sigma/d)²
        times the tilt, so that nodes closer than 3.5 sigma would weave through the noise.
        """
        return self.cell_mm / 1.2

    @property
    def _finest_mm(self) -> float:
        finest = min(2.0 * self.spacing_mm, float(np.hypot(*(self.high_mm - self.low_mm))) / 100.0)
        wall = self.thinnest_mm / 6.0
        # Without noise a small range of radii is a wall (a drawn tube), not the noise of one surface.
        return wall if max(20.0 * self.noise_mm, finest / 20.0) < wall < finest else finest


@dataclass(frozen=True)
class Cells:
    """Occupied cells of a regular grid in the (z, r) plane.

    Parameters
    ----------
    centre_mm
        (N, 2) mean (z, r) of the data in each.
    count
        (N,) how many data each holds.
    finely
        (N, bins, parts) in which parts of the angular bins of the arc it holds data.
    index
        (rows, columns) cell number at each place of the grid, -1 where empty.
    place
        (N, 2) place of each cell in the grid.
    facing
        (N, 2) mean normal (z, r) of the faces in each, by area: of unit length where all look one way, zero
        where they look all ways or there are none.

    """

    centre_mm: Floats
    count: Floats
    finely: Bools
    index: Ints32
    place: Ints
    facing: Floats

    @property
    def seen(self) -> Bools:
        """(N, bins) in which angular bins each holds data."""
        return np.asarray(self.finely.any(axis=2))

    @property
    def coverage(self) -> Floats:
        """(N,) share of the arc over which each holds data, 0 to 1."""
        return np.asarray(self.seen.mean(axis=1))

    @property
    def rare(self) -> Bools:
        """(N,) True for those that cover too little of the arc for a surface of revolution: burrs, bars."""
        coverage = self.coverage
        return np.asarray(coverage < _LEAST_COVERAGE * coverage.max(initial=0.0))


def arc_of(angle: Floats) -> tuple[float, float]:
    """Start and extent (radians) of the shortest arc that holds all angles, to half a degree. O(V)."""
    bins = 720
    width = 2.0 * np.pi / bins
    used = np.unique(((angle[np.isfinite(angle)] + np.pi) / width).astype(np.int64) % bins)
    gaps = np.diff(used, append=used[0] + bins)
    widest = int(np.argmax(gaps))
    start = float(used[(widest + 1) % len(used)] * width - np.pi)
    if gaps[widest] < 2:
        return start, 2.0 * np.pi
    # the data's own ends, not those of the bins
    turn = np.where(angle < start, angle + 2.0 * np.pi, angle) - start
    least, most = float(np.nanmin(turn)), float(np.nanmax(turn))
    return start + least, max(most - least, width)


def scale_of(profile: Profile) -> Scale:
    """Measure the extent, the noise and the spacing of the data. O(V)."""
    low, high = np.array([_limits(profile.z_mm), _limits(profile.r_mm)]).T
    if not (high > low).any():
        raise InputError("no generatrix: the vertices coincide along the axis and in their distance from it")
    diagonal, thinnest = float(np.hypot(*(high - low))), float((high - low).min())
    low, high = low - 0.02 * diagonal - 1e-12, high + 0.02 * diagonal + 1e-12
    arc = arc_of(profile.angle)
    side = diagonal / 48.0
    holding = _thickness(profile, low, high, side, arc)[1]
    area = holding * side * 0.5 * (low[1] + high[1]) * arc[1]
    spacing = float(np.sqrt(area / len(profile.r_mm)))
    # Rows of a regular scan are lines in the (z, r) plane: a cell must hold several to show their thickness.
    side = max(side, _ROWS * min(spacing, _local_spacing(profile, low, high, side, arc)))
    noise = _noise(profile, low, high, side, arc)
    return Scale(low, high, noise, spacing, thinnest, arc)


def _local_spacing(
    profile: Profile, low: Floats, high: Floats, side: float, arc: tuple[float, float]
) -> float:
    """Distance between vertices where a typical one is, mm; infinite where they are too few to tell.

    Bars and spokes fill cells, but not their arcs: what area a wheel has by its cells alone is too large.
    """
    flat = _in_cells(profile.z_mm, profile.r_mm, low, high, side)[0]
    inside = flat >= 0
    patch = flat[inside] * ARC_BINS + arc_bin(profile.angle[inside], arc)
    _, number, count = np.unique(patch, return_inverse=True, return_counts=True)
    of_each = count[number]
    if np.median(of_each) < _TOLD:
        return np.inf
    return float(np.sqrt(np.median(side * profile.r_mm[inside] * arc[1] / ARC_BINS / of_each)))


def _noise(profile: Profile, low: Floats, high: Floats, side: float, arc: tuple[float, float]) -> float:
    """Thickness of the data in cells of the first size in which it is thin.

    A mesh with few vertices has large cells, in which a tread or a corner looks thick: they are halved, which
    leaves some rows in each. What then is less than half as thick was the shape in a cell and not noise, for
    noise is as thick in any. Then they are grown, for spokes fill small ones. If the data are thin in none,
    the size given counts.
    """
    first, half = (_thickness(profile, low, high, factor * side, arc)[0] for factor in (1.0, 0.5))
    if first < 0.1 * side and not 0.0 < half < _SHAPE * first:
        return first
    for factor in (0.5, 2.0, 4.0, 8.0, 16.0):
        noise = _thickness(profile, low, high, factor * side, arc)[0]
        if noise < 0.1 * factor * side:
            return noise
    return first


def _limits(values: Floats) -> tuple[float, float]:
    """Least and largest value, but for two in a thousand at each end."""
    known = values[np.isfinite(values)]
    cut = len(known) // 500
    parts = np.partition(known, [cut, len(known) - 1 - cut])
    return float(parts[cut]), float(parts[-1 - cut])


def _thickness(
    profile: Profile, low: Floats, high: Floats, side: float, arc: tuple[float, float]
) -> tuple[float, int]:
    """Smaller standard deviation of a cell's points (lower third over the surface); number of cells.

    Cells count by how much of the arc they hold, for bars and handles fill many, and little of each.
    """
    flat, a, b = _in_cells(profile.z_mm, profile.r_mm, low, high, side)
    inside = flat >= 0
    flat, a, b = flat[inside], a[inside], b[inside]
    terms = np.ones_like(a), a, b, a * a, b * b, a * b
    moments = np.stack([np.bincount(flat, one) for one in terms], axis=1)
    seen = np.zeros((len(moments), ARC_BINS), np.bool_)
    seen[flat, arc_bin(profile.angle[inside], arc)] = True
    # Outliers are spread over many cells, each with few of them.
    used = moments[moments[:, 0] > 0.0, 0]
    enough = moments[:, 0] >= max(8.0, 0.25 * float(used.mean()) if len(used) else 8.0)
    if not enough.any():
        return 0.0, 1
    count, a, b, zz, rr, zr = moments[enough].T
    zz, rr, zr = zz / count - (a / count) ** 2, rr / count - (b / count) ** 2, zr / count - a * b / count**2
    least = (zz + rr) / 2.0 - np.sqrt(((zz - rr) / 2.0) ** 2 + zr**2)
    third = np.quantile(least, _THIRD, method="inverted_cdf", weights=seen[enough].sum(axis=1))
    return float(np.sqrt(max(third, 0.0))), len(count)


def _sparse(count: Floats) -> float:
    """Number of data below which a cell holds outliers only.

    A small share of a cell that holds a typical point, but no more than a quarter of the mean cell: drawn
    parts have most of their vertices in few places.
    """
    order = np.sort(count)
    total = np.cumsum(order)
    typical = order[np.searchsorted(total, 0.5 * total[-1])]
    return float(min(_SPARSE * typical, 0.25 * count.mean()))


def _in_cells(z: Floats, r: Floats, low: Floats, high: Floats, side: float) -> tuple[Ints, Floats, Floats]:
    """(V,) number of each point's cell, row by row, -1 outside, and its place (z, r) from its middle."""
    rows, columns = _shape(low, high, side)
    with np.errstate(invalid="ignore"):
        u, v = (z - low[0]) / side, (r - low[1]) / side
        inside = (u >= 0.0) & (v >= 0.0) & (u < rows) & (v < columns)
    row, column = (np.where(inside, one, 0.0).astype(np.int64) for one in (u, v))
    flat = np.where(inside, row * columns + column, -1)
    return flat, (u - row - 0.5) * side, (v - column - 0.5) * side


def _shape(low: Floats, high: Floats, side: float) -> tuple[int, int]:
    """Rows and columns of the grid between two corners."""
    rows, columns = np.maximum(np.ceil((high - low) / side).astype(np.int64), 1).tolist()
    return rows, columns


def cells_of(profile: Profile, scale: Scale, *, side_mm: float, looks: Looks | None = None) -> Cells:
    """Sort the data into cells, and what faces there are. O(V + T)."""
    low, high = scale.low_mm, scale.high_mm
    shape, flat = _shape(low, high, side_mm), _in_cells(profile.z_mm, profile.r_mm, low, high, side_mm)[0]
    inside = flat >= 0
    used, cell = np.unique(flat[inside], return_inverse=True)
    index = np.full(shape, -1, np.int32)
    index.flat[used] = np.arange(len(used))
    count = np.bincount(cell, minlength=len(used)).astype(np.float64)
    centre = [np.bincount(cell, one[inside], len(used)) / count for one in (profile.z_mm, profile.r_mm)]
    finely = np.zeros((len(used), ARC_BINS * _FINE), np.bool_)
    finely[cell, _arc_part(profile.angle[inside], scale.arc, ARC_BINS * _FINE)] = True
    parts: Bools = finely.reshape(-1, ARC_BINS, _FINE)
    facing = np.zeros((len(used), 2))
    if looks is not None:
        faces = _in_cells(looks[0], looks[1], low, high, side_mm)[0]
        facing = _facing(np.where(faces >= 0, index.flat[faces], -1), looks, len(used))
    place = np.stack(np.unravel_index(used, shape), axis=1)
    return Cells(np.stack(centre, axis=1), count, parts, index, place, facing)


def _facing(cell: Ints, looks: Looks, count: int) -> Floats:
    """(count, 2) mean normals of the faces, each in a cell or in none (-1)."""
    _, _, nz, nr = looks
    size = np.hypot(nz, nr)
    told = (cell >= 0) & (size > 0.0)
    sums = [np.bincount(cell[told], one[told], count) for one in (nz, nr, size)]
    return np.stack(sums[:2], axis=1) / np.maximum(sums[2], 1e-300)[:, None]


@njit(cache=True, nogil=True, error_model="numpy")
def opposed(facing: Floats, i: int, j: int) -> bool:
    """Whether two cells look opposite ways, as the two sides of a wall do."""
    return bool(facing[i, 0] * facing[j, 0] + facing[i, 1] * facing[j, 1] < _OPPOSED)


def without(profile: Profile, cells: Cells, dropped: Bools, scale: Scale, *, side_mm: float) -> Profile:
    """The data but for those in some of the cells, (N,), that they were sorted into. O(V)."""
    flat = _in_cells(profile.z_mm, profile.r_mm, scale.low_mm, scale.high_mm, side_mm)[0]
    kept = (flat < 0) | ~dropped[cells.index.flat[flat]]
    return Profile(profile.z_mm[kept], profile.r_mm[kept], profile.angle[kept])


def trusted(cells: Cells, scale: Scale, *, side_mm: float) -> Cells:
    """Only the cells that belong to the surface of revolution. O(cells)."""
    reach = int(np.ceil(_ANOMALY * scale.high_mm[1] / side_mm))
    keep = _ridge(cells.place, cells.index, cells.count, cells.facing)
    keep &= cells.count >= _sparse(cells.count)
    keep &= _covered(
        cells.place,
        cells.index,
        cells.coverage,
        cells.rare,
        cells.seen,
        cells.finely,
        cells.count,
        reach,
        cells.facing,
    )
    number = np.where(keep, np.cumsum(keep) - 1, -1).astype(np.int32)
    index = np.where(cells.index >= 0, number[cells.index], -1).astype(np.int32)
    return Cells(
        cells.centre_mm[keep],
        cells.count[keep],
        cells.finely[keep],
        index,
        cells.place[keep],
        cells.facing[keep],
    )


def past_start(angle: Floats, arc: tuple[float, float]) -> Floats:
    """(N,) radians from the arc's start to angles within -π to π, 0 to 2π: a remainder would be dear."""
    turn = angle - arc[0]
    return np.asarray(turn + 2.0 * np.pi * (turn < 0.0))


def arc_bin(angle: Floats, arc: tuple[float, float]) -> Ints:
    """(N,) which of the :data:`ARC_BINS` of the arc angles are in."""
    return _arc_part(angle, arc, ARC_BINS)


def _arc_part(angle: Floats, arc: tuple[float, float], parts: int) -> Ints:
    share = past_start(angle, arc) / arc[1]
    return np.minimum((share * parts).astype(np.int64), parts - 1)


@njit(cache=True, nogil=True, error_model="numpy")
def _ridge(place: Ints, index: Ints32, count: Floats, facing: Floats) -> Bools:
    """Cells on the ridge of the density of the data, not in the tails of its noise."""
    keep = np.ones(len(place), np.bool_)
    for i in range(len(place)):
        for row in range(max(place[i, 0] - 1, 0), min(place[i, 0] + 2, index.shape[0])):
            for column in range(max(place[i, 1] - 1, 0), min(place[i, 1] + 2, index.shape[1])):
                j = index[row, column]
                keep[i] &= j < 0 or count[i] >= _TAIL * count[j] or opposed(facing, i, j)
    return keep


@njit(cache=True, nogil=True, error_model="numpy")
def _covered(
    place: Ints,
    index: Ints32,
    coverage: Floats,
    rare: Bools,
    seen: Bools,
    finely: Bools,
    count: Floats,
    reach: int,
    facing: Floats,
) -> Bools:
    """Cells whose data go round.

    A burr or a spoke covers little of the arc; an arc of burr, or many burrs that are alike, cover more, but
    just where the surface below them is hidden: their bins and those of a stronger cell nearby exclude each
    other, or the parts of bins do that they share. Burrs narrower than a part crowd in few parts. The two
    sides of a wall, which look opposite ways, exclude each other too.
    """
    keep = np.zeros(len(place), np.bool_)
    most = coverage.max() if len(coverage) else 0.0
    share = np.array([one.sum() for one in finely]) / (ARC_BINS * _FINE)
    spread = np.array([_spread(finely[i], count[i]) for i in range(len(finely))])
    for i in range(len(place)):
        keep[i] = not rare[i]
        if not keep[i] or coverage[i] > 0.5 * most:
            continue
        for row in range(max(place[i, 0] - reach, 0), min(place[i, 0] + reach + 1, index.shape[0])):
            for column in range(max(place[i, 1] - reach, 0), min(place[i, 1] + reach + 1, index.shape[1])):
                j = index[row, column]
                if not keep[i] or j < 0 or opposed(facing, i, j):
                    continue
                if coverage[j] >= 1.5 * coverage[i]:
                    keep[i] &= (seen[i] & seen[j]).sum() > 0.2 * coverage[i] * ARC_BINS
                if share[j] >= 1.5 * share[i]:
                    keep[i] &= spread[i] >= _CROWDED * spread[j] and not _avoid(finely[i], finely[j])
    return keep


@njit(cache=True, nogil=True, error_model="numpy")
def _spread(finely: Bools, count: float) -> float:
    """In how many parts of its bins, (bins, parts), a cell is seen, over what chance would give."""
    parts = finely.shape[1] * np.array([one.any() for one in finely]).sum()
    expected = parts * (1.0 - (1.0 - 1.0 / parts) ** count)
    return float(finely.sum() / expected) if expected >= _TELLING else 1.0


@njit(cache=True, nogil=True, error_model="numpy")
def _avoid(one: Bools, other: Bools) -> bool:
    """Whether two cells, (bins, parts) each, are hardly ever seen in the same part of a bin."""
    expected, met = 0.0, 0
    for k in range(one.shape[0]):
        expected += one[k].sum() * other[k].sum() / one.shape[1]
        met += (one[k] & other[k]).sum()
    return expected >= _TELLING and met < _MEET * expected
