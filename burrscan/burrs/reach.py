"""Which columns of an edge reach further than the edge does: alone, or in the mean with those beside them."""

from __future__ import annotations

from itertools import pairwise
from typing import Literal

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints
from burrscan.robust import SIGMA_PER_MEDIAN, TUKEY

Windows = tuple[tuple[int, float], ...]

FEWEST = 12
"""Columns by which a straight edge is told: of fewer six in ten may be alike by chance."""
BEYOND = 2.5
"""Vertex spacings by which a column must run on: an edge that smears is a vertex too long, or two."""
WINDOWS: Windows = ((1, BEYOND),)
"""Columns of which the mean is taken, and by how many vertex spacings it must be further: a mesh of many
views may end in teeth, or at a cut."""
WINDOWS_SEEN: Windows = ((1, BEYOND), (9, 1.0), (27, 0.8))
"""The same in the outline of one view, in which pixels err by half of one, each for itself."""
_SIGMAS = 6.0
"""By so many times the scatter of such means, too."""
_STEP = 1.0
"""Vertex spacings by which the mean of nine columns steps out, and in, at least."""
_KNOWN = 0.7
"""Share of a window's columns that must be known."""
_FLANK, _GUARD = 9, 2
"""Columns to either side of a burr that are lower, and those between that are its ends."""
_LOWER = 0.5
"""Share of a burr's reach that they have at most."""
_SUSPECT, _SUSPECT_SIGMAS = 0.5, 5.0
"""Vertex spacings, and standard deviations, by which columns that are suspect for another reason run on."""
_PASSES = 5
"""Fits of that parabola, each weighing by the misfit of the last."""
_PIXEL = 2.0
"""Standard deviations, of what is evenly spread over a pixel, that are a pixel and a bit to either side."""
_JOINED = 4.0
"""Vertex spacings between neighbours of one column beyond which what follows is another surface."""
_GAP = 3
"""Columns within a burr that may be lower, or without a vertex."""


def reach_of(ahead_mm: Floats, column: Ints, columns: int, *, spacing_mm: float) -> Floats:
    """(columns,) how far each column goes on without a gap from the edge, at 0; minus infinity: not at all.

    What follows after a gap is another surface, which comes into view beyond the edge. O(M log M).
    """
    order = np.lexsort((ahead_mm, column))
    ahead, column = ahead_mm[order], column[order]
    new = np.diff(column, prepend=-1) > 0
    before = np.where(new, 0.0, np.roll(ahead, 1))
    gaps = np.cumsum(ahead - before > _JOINED * spacing_mm)
    earlier = np.append(0, gaps)[np.flatnonzero(new)]  # those of the columns before
    joined = gaps == earlier[np.cumsum(new) - 1]
    reach = np.full(columns, -np.inf)
    np.maximum.at(reach, column[joined], ahead[joined])
    return reach


def usual_reach(reach: Floats, known: Bools, sigma_mm: float, *, bent: bool) -> Floats:
    """(columns,) how far the surface reaches without burrs: as far everywhere, or ``bent`` as a parabola.

    What hides the end of a surface does so further, or less far, to either side. Burrs only reach further:
    what does by more than a pixel's worth has no say, what falls short has as in Tukey's biweight.
    """
    middle = np.full(len(reach), float(np.median(reach[known])))
    if not bent:
        return middle
    at = np.linspace(-1.0, 1.0, len(reach))
    for _ in range(_PASSES):
        rest = reach[known] - middle[known]
        share = rest / np.where(rest > 0.0, _PIXEL, TUKEY) / sigma_mm
        weight = np.maximum(1.0 - share**2, 0.0)
        if np.count_nonzero(weight) < FEWEST:
            break
        middle = np.polyval(np.polyfit(at[known], reach[known], 2, w=weight), at)
    return middle


def between_steps(reach: Floats, known: Bools) -> Bools:
    """Columns from where an edge steps out to where it steps in again, however many they are.

    What is usual hangs on most columns; a step hangs on those beside it. ``reach`` is in vertex spacings.
    """
    found = np.zeros(len(reach), np.bool_)
    size, gap = _FLANK, _GUARD + _FLANK // 2 + 1
    share = ndimage.uniform_filter1d(known.astype(float), size, mode="constant")
    mean = ndimage.uniform_filter1d(np.where(known, reach, 0.0), size, mode="constant") / np.maximum(
        share, 1e-9
    )
    after, before = slice(2 * gap, None), slice(None, -2 * gap)
    full = (share[after] >= _KNOWN) & (share[before] >= _KNOWN)
    if np.count_nonzero(full) < FEWEST:
        return found
    step = mean[after] - mean[before]
    step = np.where(full, step - float(np.median(step[full])), 0.0)  # not that of a slope
    least = max(_STEP, _SIGMAS * SIGMA_PER_MEDIAN * float(np.median(np.abs(step[full]))))
    highest = np.abs(step) >= ndimage.maximum_filter1d(np.abs(step), 2 * gap + 1)
    ends = np.flatnonzero(highest & (np.abs(step) > least))
    for one, other in pairwise(ends):
        if step[one] > 0.0 > step[other]:
            found[one + gap : other + gap + 1] = True
    return found & known


def further(off: Floats, windows: Windows, *, usual: Bools, closed: bool) -> Bools:
    """Columns that run on: alone, or in the mean with those beside them.

    ``off`` is in vertex spacings, NaN where nothing is known; ``usual`` are the columns that tell how far it
    scatters.
    """
    mode: Literal["wrap", "constant"] = "wrap" if closed else "constant"
    known = np.isfinite(off)
    values, found = np.where(known, off, 0.0), np.zeros(len(off), np.bool_)
    for size, least in windows:
        if size > len(off):
            continue
        share = ndimage.uniform_filter1d(known.astype(float), size, mode=mode)
        mean = ndimage.uniform_filter1d(values, size, mode=mode) / np.maximum(share, 1e-9)
        full = share >= _KNOWN
        if not full.any():
            continue
        tell = full & usual if (full & usual).any() else full
        middle = float(np.median(mean[tell]))
        scatter = SIGMA_PER_MEDIAN * float(np.median(np.abs(mean[tell] - middle)))
        centres = full & (mean - middle > max(least, _SIGMAS * scatter))
        level = ndimage.maximum_filter1d(np.where(centres, mean, 0.0), size, mode=mode)
        found |= (level > 0.0) & known & (values > 0.5 * level)
    return found


def runs_on(off: Floats, run: Ints, *, closed: bool) -> bool:
    """Whether columns that are suspect for another reason reach further than those beside them.

    ``off`` is in vertex spacings, NaN where nothing is known; each errs by what is evenly spread over one.
    """
    beyond = off[run % len(off)]
    known = np.count_nonzero(np.isfinite(beyond))
    if known < max(_KNOWN * len(run), 3):
        return False
    sure = _SUSPECT_SIGMAS / np.sqrt(12.0 * known)
    return bool(np.nanmean(beyond) > max(_SUSPECT, sure)) and steps_out(off, run, closed=closed)


def steps_out(off: Floats, run: Ints, *, closed: bool) -> bool:
    """Whether columns that run on stand out from those before and after them: else it is a slope.

    Those beside them must be lower in the mean, and most of them, as far as pixels let most be known: where
    an edge crosses the rows of pixels at a small angle a slope is a comb, each third column a vertex shorter.
    The median of a short run errs as those beside it do, and must be above them twice as surely. Past the
    ends of a field that is not ``closed`` nothing is known. ``off`` is in vertex spacings.
    """
    level = float(np.nanmedian(off[run % len(off)]))
    most = _LOWER * (level - 2.0 * _median_errs(len(run))) + _median_errs(_FLANK)
    flanks = (run[0] - _GUARD - np.arange(1, _FLANK + 1), run[-1] + _GUARD + np.arange(1, _FLANK + 1))
    for flank in flanks:
        inside = closed | ((flank >= 0) & (flank < len(off)))
        beside = np.where(inside, off[flank % len(off)], np.nan)
        if np.isfinite(beside).mean() < _KNOWN:
            return False
        if np.nanmean(beside) > _LOWER * level or np.nanmedian(beside) > most:
            return False
    return True


def _median_errs(columns: int) -> float:
    """Standard deviation of the median of so many, each evenly spread over one: Beta's."""
    return float(0.5 / np.sqrt(columns + 2.0))


def runs_of(columns: Bools, *, closed: bool) -> list[Ints]:
    """Stretches of columns, across short gaps; a closed field's may go on past its last column."""
    start = int(np.argmin(columns | np.roll(columns, -1))) if closed else 0  # where no stretch is cut
    at = start + np.flatnonzero(np.roll(columns, -start))
    if not len(at):
        return []
    return [
        np.arange(run[0], run[-1] + 1) for run in np.split(at, np.flatnonzero(np.diff(at) > 1 + _GAP) + 1)
    ]
