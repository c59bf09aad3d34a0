"""A ridge that few vertices cross: its height, place and width integrated over, not descended to.

Two columns of vertices on a burr carry two numbers, and height, place and width are three unknowns: what is
left is a curve of solutions. And where a base ends at a vertex, chi-square has a kink at which descents get
stuck. So the posterior is summed over a grid of widths, and for each of places of its own, that zooms to
where the mass is: for vertices askew to the burr that is a point, for columns along it a curve.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.burrs.shape.patch import Patch

_PLACES, _WIDTHS = 41, 33
"""Nodes across and of half-widths: steps of a sixteenth of a spacing and of 6.5 %, refined where the mass
needs it."""
_PASSES = 16
"""Bounds the zooming and re-centring of the grid, which end by themselves once it is fine enough."""
_MASS = 25.0
"""Chi-square above the least at which what is left of the posterior does not count."""
_NARROWEST, _WIDEST = 0.4, 3.0
"""Half-widths of the base, in vertex spacings."""
_REACH = 1.25
"""How far the crest may lie from where it was first seen, in vertex spacings."""
REACH = _WIDEST + _REACH
"""Vertices farther than this from where the crest was first seen tell nothing, in vertex spacings."""
_SETTLED = 0.6
"""A stretch of places, or of widths, is fine enough where the mass fills this share of it."""
_HUBER = 3.0
"""In sigma: farther off a vertex pulls with a constant force. Costs 0.04 % of efficiency on normal noise
(Huber 1964)."""
STEEPEST = 3.6
"""Height over base width from which flanks are steeper than 82 degrees, and no scanner sees them."""
_MOST_SHIFT = 0.5
"""How far a turn may move an end of the burr in one pass, in vertex spacings."""
_OPEN = 0.02
"""Relative sigma of the width from which directions are summed over too."""
_STEP, _MOST_STEPS = 0.015, 15
"""First step of the direction, how far an end of the burr moves, in vertex spacings; and how many of such."""
_LEVEL = 0.5
"""A change of the logarithm of the posterior below which the next step is twice as long."""
_NO_SHARE = 6.0
"""Logarithm of the posterior below the best's at which a direction does not count."""
_WITHIN_E = 1.0
"""How far, in logarithms, a height is from its base's width."""
_FEWEST = 5
"""Taken off the count of vertices for the misfit's degrees of freedom: the five parameters of a ridge."""


@dataclass(frozen=True)
class Posterior:
    """What vertices say of a triangular ridge.

    Parameters
    ----------
    mean
        (4,) height, mm, position across at u = 0, mm, its change with u, and half-width, mm. Height and width
        are geometric means.
    covariance
        (4, 4) of those.
    chi2
        Least weighted sum of squares.
    noise_mm
        Standard deviation of the height, all else known.
    misfit
        ``chi2`` per degree of freedom, at least 1: by so much chi-square is held to be too large.
    volume
        Logarithm of the whole of the posterior over its peak.

    """

    mean: Floats
    covariance: Floats
    chi2: float
    noise_mm: float
    misfit: float
    volume: float

    def evidence(self, misfit: float) -> float:
        """Logarithm of the whole, up to a constant, for some common misfit."""
        return self.volume - 0.5 * self.chi2 / misfit


@dataclass(frozen=True)
class _Grid:
    """Half-widths (W,) and for each the places (W, P); a row is evenly spaced, the widths in logarithms."""

    half_mm: Floats
    place_mm: Floats


@dataclass(frozen=True)
class _Nodes:
    """Per node of a grid: least chi-square, height, turn against the slope, information of the height."""

    chi2: Floats
    height_mm: Floats
    turn: Floats
    information: Floats


def posterior_of(patch: Patch, start: Floats, *, spacing_mm: float, slanted: bool) -> Posterior | None:
    """Sum the posterior of a triangular ridge; None where none rises that a scanner would see.

    Parameters
    ----------
    patch
        The vertices.
    start
        (4,) height, position, change with u, half-width of a first guess.
    spacing_mm
        Distance between neighbouring vertices.
    slanted
        Whether the burr is long enough to tell its direction.

    Notes
    -----
    Prior: even in place and in the logarithms of height and width, but for a height that is the base's width
    within a factor e (one sigma), and no spike. The height is integrated out; the direction is the best for
    each place and width, or integrated out too where it leaves the width open. Outliers count with Huber's
    weights. O(N log N) for each of a few passes: sums over the flanks are differences of running sums.

    """
    reach = max(float(np.abs(patch.u_mm).max()), spacing_mm)
    most = _MOST_SHIFT * spacing_mm / reach if slanted else 0.0
    found = _converged(patch, start, _first(float(start[1]), spacing_mm), most)
    if found is None or not slanted or found.covariance[3, 3] < (_OPEN * found.mean[3]) ** 2:
        return found
    return _over_slants(patch, found, _STEP * spacing_mm / reach, spacing_mm)


def _converged(patch: Patch, start: Floats, grid: _Grid, most: float) -> Posterior | None:
    """The posterior on the grid that is fine enough, turns of the start by up to ``most`` a pass allowed."""
    model, result = start, None
    for _ in range(_PASSES):
        weight = _weights(patch, model)
        slope = float(model[2])
        nodes = _matched(*_running(patch, weight, slope), grid, most)
        if not np.isfinite(nodes.chi2).any():
            return result
        i, j = np.unravel_index(int(np.argmin(nodes.chi2)), nodes.chi2.shape)
        model = np.array(
            [nodes.height_mm[i, j], grid.place_mm[i, j], slope + nodes.turn[i, j], grid.half_mm[i]]
        )
        misfit = max(1.0, float(nodes.chi2[i, j]) / max(len(weight) - _FEWEST, 1))
        result = _summed(grid, nodes, slope, misfit)
        finer = _zoomed(grid, nodes.chi2 / misfit)
        if finer is None:
            break
        grid = finer
    return result


def _over_slants(patch: Patch, found: Posterior, step: float, spacing: float) -> Posterior:
    """The posterior over directions too, where width, place and direction trade against each other.

    Columns that are nearly along the burr cross it once, at a place that each direction puts elsewhere. The
    directions go up and down from the best in steps as long as they have a share in the whole.
    """
    parts, offsets, least = [found], [0.0], found.evidence(found.misfit) - _NO_SHARE
    for way in (1.0, -1.0):
        before, offset, stride = found, 0.0, step
        while offset + stride <= _MOST_STEPS * step:
            offset += stride
            model = before.mean.copy()
            model[2] = found.mean[2] + way * offset
            part = _converged(patch, model, _first(float(model[1]), spacing), 0.0)
            if part is None or part.evidence(found.misfit) < least:
                break
            parts.append(part)
            offsets.append(way * offset)
            if abs(part.evidence(found.misfit) - before.evidence(found.misfit)) < _LEVEL:
                stride *= 2.0
            before = part
    if len(parts) == 1:
        return found
    return _mixed(parts, _stretches(np.array(offsets)), found.misfit)


def _stretches(offsets: Floats) -> Floats:
    """How much of the line each of some places stands for: to half-way to the next."""
    order = np.argsort(offsets)
    gaps = np.diff(offsets[order])
    stretch = np.empty_like(offsets)
    stretch[order] = 0.5 * (np.append(gaps, gaps[-1]) + np.append(gaps[0], gaps))
    return stretch


def _mixed(parts: list[Posterior], stretches: Floats, misfit: float) -> Posterior:
    """Mean and covariance of the whole, heights and widths in logarithms."""
    evidence = np.array([part.evidence(misfit) for part in parts])
    mass = stretches * np.exp(evidence - evidence.max())
    mass /= mass.sum()
    scales = np.array([[part.mean[0], 1.0, 1.0, part.mean[3]] for part in parts])
    values = np.array([part.mean for part in parts])
    values[:, [0, 3]] = np.log(values[:, [0, 3]])
    mean = mass @ values
    off = values - mean
    own = [part.covariance / np.outer(scale, scale) for part, scale in zip(parts, scales, strict=True)]
    covariance = np.einsum("k,kij->ij", mass, np.array(own)) + (mass[:, None] * off).T @ off
    mean[[0, 3]] = np.exp(mean[[0, 3]])
    scale = np.array([mean[0], 1.0, 1.0, mean[3]])
    best = min(parts, key=lambda part: part.chi2)
    return replace(best, mean=mean, covariance=covariance * np.outer(scale, scale))


def _first(middle: float, spacing: float) -> _Grid:
    half = spacing * np.geomspace(_NARROWEST, _WIDEST, _WIDTHS)
    return _Grid(half, np.tile(middle + spacing * np.linspace(-_REACH, _REACH, _PLACES), (_WIDTHS, 1)))


def _weights(patch: Patch, model: Floats) -> Floats:
    """Huber's weights over the variance."""
    height, centre, slope, half = model
    off = np.abs(patch.v_mm - centre - slope * patch.u_mm) / half
    residual = np.abs(patch.lift_mm - height * np.clip(1.0 - off, 0.0, None))
    huber = np.minimum(1.0, _HUBER * patch.sigma_mm / np.maximum(residual, 1e-300))
    return np.asarray(huber / patch.sigma_mm**2)


def _running(patch: Patch, weight: Floats, slope: float) -> tuple[Floats, Floats, float]:
    """Places across in order, running sums of what the flanks need, and the sum of squares of all lifts."""
    v = patch.v_mm - slope * patch.u_mm
    order = np.argsort(v, kind="stable")
    v, u, y, w = v[order], patch.u_mm[order], patch.lift_mm[order], weight[order]
    terms = np.stack([w, w * v, w * v * v, w * y, w * y * v, w * u, w * u * v, w * u * u, w * u * y], axis=1)
    sums = np.zeros((len(v) + 1, terms.shape[1]))
    np.cumsum(terms, axis=0, out=sums[1:])
    return v, sums, float(w @ (y * y))


def _matched(v: Floats, sums: Floats, square: float, grid: _Grid, most: float) -> _Nodes:
    """Least squares of height and turn, at ``most`` so large, at every node; infinite where nothing rises."""
    w, c = grid.half_mm[:, None], grid.place_mm
    first, crest, last = (sums[np.searchsorted(v, at)] for at in (c - w, c, c + w))
    hh, hk, kk, hy, ky = np.zeros((5, *c.shape))
    for flank, b in ((crest - first, 1.0 / w), (last - crest, -1.0 / w)):
        s, a = np.moveaxis(flank, -1, 0), 1.0 - b * c
        hh += a * a * s[0] + 2.0 * a * b * s[1] + b * b * s[2]
        hy += a * s[3] + b * s[4]
        hk -= b * (a * s[5] + b * s[6])
        kk += b * b * s[7]
        ky -= b * s[8]
    # The ratio of the two unknowns, height and height times turn, held to where it is linear.
    turned, whole = hh * ky - hk * hy, kk * hy - hk * ky
    told = (whole > 1e-9 * kk * hy) & (whole != 0.0)
    turn = np.where(told, np.clip(turned / np.where(told, whole, 1.0), -most, most), 0.0)
    match, power = hy + turn * ky, hh + 2.0 * turn * hk + turn * turn * kk
    rises = (match > 0.0) & (hh > 0.0) & (power > 0.0)
    height = np.where(rises, match / np.where(rises, power, 1.0), 0.0)
    chi2 = np.where(rises, np.maximum(square - match * height, 0.0), np.inf)
    return _Nodes(chi2, height, turn, hh)


def _summed(grid: _Grid, nodes: _Nodes, slope: float, misfit: float) -> Posterior | None:
    """Means and covariance over the nodes, with what each leaves open of its height; None for spikes."""
    some = np.isfinite(nodes.chi2) & (nodes.height_mm < 2.0 * STEEPEST * grid.half_mm[:, None])
    if not some.any():
        return None
    chi2 = np.where(some, nodes.chi2, np.inf)
    height, information = (np.where(some, one, 1.0) for one in (nodes.height_mm, nodes.information))
    best = np.unravel_index(int(np.argmin(chi2)), chi2.shape)
    half = grid.half_mm[:, None]
    stretch = np.ptp(grid.place_mm, axis=1, keepdims=True) * np.log(half[-1] / half[0])
    aspect = np.log(height / (2.0 * half)) / _WITHIN_E
    share = np.exp(-0.5 * ((chi2 - chi2[best]) / misfit + aspect**2))
    mass = share * stretch / (height * np.sqrt(information))
    total = float(mass.sum())
    logs = np.log(height), np.broadcast_to(np.log(half), chi2.shape)
    value = np.stack([logs[0], grid.place_mm, slope + nodes.turn, logs[1]])
    mean = (mass * value).sum(axis=(1, 2)) / total
    off = value - mean[:, None, None]
    covariance = np.einsum("kij,mij->km", mass * off, off) / total
    covariance[0, 0] += float((mass * misfit / (information * height**2)).sum()) / total
    mean[[0, 3]] = np.exp(mean[[0, 3]])
    scale = np.array([mean[0], 1.0, 1.0, mean[3]])
    noise = float(np.sqrt(misfit / information[best]))
    volume = float(np.log(max(total, 1e-300)))
    return Posterior(mean, covariance * np.outer(scale, scale), float(chi2[best]), noise, misfit, volume)


def _zoomed(grid: _Grid, chi2: Floats) -> _Grid | None:
    """A finer grid around the mass; None where this one is fine enough.

    Places first: only where those are fine is the least chi-square of every width known.
    """
    rows = chi2.min(axis=1)
    low, high, filled = _hull(chi2, rows)
    first, last, share = (x[0] for x in _hull(rows[None, :], rows.min(keepdims=True)))
    if (filled[first : last + 1] < _SETTLED).any():
        number = np.arange(len(rows))
        return _Grid(grid.half_mm, _spread(grid.place_mm[number, low], grid.place_mm[number, high]))
    if share >= _SETTLED:
        return None
    half = np.geomspace(grid.half_mm[first], grid.half_mm[last], len(rows))
    before = np.clip(np.searchsorted(grid.half_mm, half, side="right") - 1, 0, len(rows) - 2)
    lowest, highest = grid.place_mm[:, 0], grid.place_mm[:, -1]
    return _Grid(
        half,
        _spread(
            np.minimum(lowest[before], lowest[before + 1]), np.maximum(highest[before], highest[before + 1])
        ),
    )


def _spread(low: Floats, high: Floats) -> Floats:
    return np.asarray(np.linspace(low, high, _PLACES, axis=1))


def _hull(chi2: Floats, least: Floats) -> tuple[Ints, Ints, Floats]:
    """Per row the node before the first of the mass, the one after its last, and the share between.

    A grid that is coarse misses the least: what the next node is higher by is allowed for.
    """
    number, count = np.arange(len(chi2)), chi2.shape[1]
    best = np.argmin(chi2, axis=1)
    beside = np.minimum(chi2[number, np.abs(best - 1)], chi2[number, np.minimum(best + 1, count - 1)])
    beside = np.where(np.isfinite(beside), beside, least)
    mass = chi2 <= (beside + _MASS)[:, None]
    first, last = np.argmax(mass, axis=1), count - 1 - np.argmax(mass[:, ::-1], axis=1)
    return np.maximum(first - 1, 0), np.minimum(last + 1, count - 1), (last - first + 1) / count
