"""The measure of one burr: a ridge fitted to the deviations around it.

The largest deviation is biased upwards by noise and downwards by sampling; a ridge fitted to all vertices on
the burr is not. Cross-section: h (1 - |v/w|^p) with its own half-width on either side; p = 1 is a triangle (a
burr's usual idealisation, and the seed's), p = 2 a rounded one; the data choose.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.shape.grid_posterior import REACH, posterior_of
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.section import section

_STEPS = 25
"""Bounds Levenberg-Marquardt on five parameters, which ends by itself where a step gains nothing."""
_HUBER = 3.0
"""In sigma: farther off a vertex pulls with a constant force, the same as in the posterior on a grid."""
_BETTER = 10.0
"""Drop of the weighted sum of squares that a richer cross-section must bring (about BIC)."""
_FLANK = 0.15
"""Share of the height above which a vertex tells whether the burr is there."""
_WELL_SAMPLED = 2.5
"""Half-width, in vertex spacings, from which the width is never in doubt."""
TELLS_SHAPES = 1.5
"""Half-width, in vertex spacings, from which other cross-sections than the triangle are tried."""
_LONG = 3.0
"""Length, in vertex spacings, from which a burr tells its direction."""
_ALIKE = 0.01
"""Heights along a burr are alike unless chance gives such differences more rarely than this."""
_HALF_WIDTHS = np.array([0.6, 0.85, 1.2, 1.7, 2.4, 3.4, 5.0, 7.0, 10.0])
"""Tried first, in vertex spacings."""
_SYMMETRIC = np.array([True, True, True, True, False])
_ALL = np.ones(5, dtype=np.bool_)
"""Height, place, slant, half-width and asymmetry are all free."""


@dataclass(frozen=True)
class Ridge:
    """A fitted ridge.

    Parameters
    ----------
    parameters
        (5,) crest height, position across at u = 0, its change with u, half-width w of the base, and
        asymmetry a: the base reaches w (1 - a) to the left and w (1 + a) to the right of the crest.
    covariance
        (5, 5) of those.
    power
        p of the cross-section.
    start_mm, end_mm
        Extent along u.
    chi2
        Weighted sum of squares, robust.
    noise_mm
        Standard deviation of the height, all else taken as known.
    misfit
        ``chi2`` per vertex.
    footprint_mm
        Width over which the cross-section is averaged, 0 where vertices are points.
    open_mm
        By how much the height would change with the other kind of cross-section.

    """

    parameters: Floats
    covariance: Floats
    power: int
    start_mm: float
    end_mm: float
    chi2: float
    noise_mm: float
    misfit: float
    footprint_mm: float = 0.0
    open_mm: float = 0.0

    @property
    def height_mm(self) -> float:
        """Height of the crest."""
        return float(self.parameters[0])

    @property
    def width_mm(self) -> float:
        """Base width across the burr."""
        return float(2.0 * self.parameters[3])

    @property
    def fullness(self) -> float:
        """Cross-section area over height times width."""
        return self.power / (self.power + 1.0)

    def base_middle_mm(self, u_mm: float) -> float:
        """Position across of the middle of the base."""
        _, centre, slope, half, asymmetry = self.parameters
        return float(centre + slope * u_mm + half * asymmetry)

    def sigma_of(self, gradient: list[float]) -> float:
        """Standard deviation of a combination of the five parameters."""
        g = np.array(gradient, dtype=np.float64)
        return float(np.sqrt(max(float(g @ self.covariance @ g), 0.0)))

    def shape(self, patch: Patch) -> Floats:
        """(N,) height of the unit ridge at each vertex, without regard to its ends."""
        _, centre, slope, half, asymmetry = self.parameters
        v = patch.v_mm - centre - slope * patch.u_mm
        left, right = half * (1.0 - asymmetry), half * (1.0 + asymmetry)
        return section(v, left, right, self.power, self.footprint_mm)[0]


def first_ridge(patch: Patch, *, spacing_mm: float, start: tuple[float, float]) -> Ridge | None:
    """Fit a triangle whose extent along u is first guessed as ``start``; None where nothing rises.

    Notes
    -----
    Levenberg-Marquardt with Huber weights from the best of a grid of positions and widths. O(N) per step.

    """
    inside = _between(patch, start)
    guess = _guess(inside, spacing_mm)
    if guess is None:
        return None
    ridge = _fitted(inside, guess, 1, _SYMMETRIC, start, spacing_mm)
    for _ in range(2):
        extent = _extent(patch, ridge, spacing_mm)
        inside = _between(patch, extent)
        if len(inside.u_mm) < 6:
            return None
        ridge = _fitted(inside, ridge.parameters, 1, _SYMMETRIC, extent, spacing_mm)
    return ridge


def fit_ridge(patch: Patch, ridge: Ridge, *, spacing_mm: float) -> Ridge:
    """From a first triangle to the ridge.

    Notes
    -----
    The simplest cross-section that no richer one beats clearly. Where few vertices lie across, the mean of
    what explains them.

    """
    inside = _between(patch, (ridge.start_mm, ridge.end_mm))
    if ridge.parameters[3] > _WELL_SAMPLED * spacing_mm:
        return _opened(inside, _richest(inside, ridge, spacing_mm), spacing_mm)
    return _opened(inside, _narrow(inside, ridge, spacing_mm), spacing_mm)


def _opened(patch: Patch, ridge: Ridge, spacing: float) -> Ridge:
    """The ridge, and how far its height depends on the cross-section.

    A scanner rounds crests off by its footprint, so the triangle may be the better height though the parabola
    fits better.
    """
    other = _fitted(patch, ridge.parameters, 3 - ridge.power, _ALL, (ridge.start_mm, ridge.end_mm), spacing)
    return replace(ridge, open_mm=min(abs(other.height_mm - ridge.height_mm), 0.5 * ridge.height_mm))


def _between(patch: Patch, extent: tuple[float, float]) -> Patch:
    return _part(patch, (patch.u_mm >= extent[0]) & (patch.u_mm <= extent[1]))


def _part(patch: Patch, inside: Bools) -> Patch:
    return Patch(patch.u_mm[inside], patch.v_mm[inside], patch.lift_mm[inside], patch.sigma_mm[inside])


def _richest(patch: Patch, ridge: Ridge, spacing: float) -> Ridge:
    extent = (ridge.start_mm, ridge.end_mm)
    kinds = ((1, 1.0, _SYMMETRIC), (2, 0.0, _SYMMETRIC), (1, 0.0, _ALL), (1, 1.0, _ALL), (2, 0.0, _ALL))
    for power, footprint, free in kinds:
        other = _fitted(patch, ridge.parameters, power, free, extent, spacing, footprint * spacing)
        if other.chi2 < ridge.chi2 - _BETTER * max(1.0, ridge.chi2 / max(len(patch.u_mm), 1)) ** 2:
            ridge = other
    return ridge


def _guess(patch: Patch, spacing: float) -> Floats | None:
    """The position and width whose least-squares ridge explains most."""
    if len(patch.v_mm) < 6:
        return None
    rising = patch.lift_mm > 3.0 * patch.sigma_mm
    near = patch.v_mm[rising] if rising.sum() > 3 else patch.v_mm
    low, high = np.quantile(near, [0.02, 0.98])
    count = min(max(int((high - low) / (0.25 * spacing)) + 1, 3), 60)
    best = np.zeros(4)
    for half in spacing * _HALF_WIDTHS:
        for centre in np.linspace(low, high, count):
            shape = np.maximum(1.0 - np.abs(patch.v_mm - centre) / half, 0.0)
            weighted = shape / patch.sigma_mm**2
            match, power = float((weighted * patch.lift_mm).sum()), float((weighted * shape).sum())
            if match > 0.0 and match**2 / power > best[0]:
                best = np.array([match**2 / power, match / power, centre, half])
    _, height, centre, half = best
    return np.array([height, centre, 0.0, half, 0.0]) if height > 0.0 else None


def _fitted(
    patch: Patch,
    start: Floats,
    power: int,
    free: Bools,
    extent: tuple[float, float],
    spacing: float,
    footprint: float = 0.0,
) -> Ridge:
    """Levenberg-Marquardt over the free parameters; the slope only where the burr is long enough for one."""
    free = free.copy()
    free[2] &= bool(np.ptp(patch.u_mm) >= _LONG * spacing)
    parameters, chi2, normal = _descend(patch, start.copy(), power, footprint, free, 0.35 * spacing)
    misfit = max(1.0, chi2 / max(len(patch.u_mm) - int(free.sum()), 1))
    noise = float(np.sqrt(misfit / max(normal[0, 0], 1e-300)))
    return Ridge(
        parameters,
        _covariance(normal / misfit, free, spacing),
        power,
        *extent,
        chi2,
        noise,
        chi2 / len(patch.u_mm),
        footprint,
    )


def _covariance(normal: Floats, free: Bools, spacing: float) -> Floats:
    """Inverse of the normal matrix of the free parameters; the width is known to a vertex spacing at worst.

    So is the position, evenly: a ridge that one row of vertices shows lies within half a spacing of it.
    """
    some = np.ix_(free, free)
    normal = (normal + np.diag([0.0, 12.0 * spacing**-2, 0.0, spacing**-2, 1.0]))[some]
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    product = np.outer(scale, scale)
    covariance = np.zeros((5, 5))
    covariance[some] = np.linalg.pinv(normal / product) / product
    return covariance


def _equations(patch: Patch, p: Floats, power: int, footprint: float) -> tuple[float, Floats, Floats]:
    """Robust chi-square, gradient and normal matrix."""
    less, more = 1.0 - p[4], 1.0 + p[4]
    across = patch.v_mm - p[1] - p[2] * patch.u_mm
    shape, by_x, by_left, by_right = section(across, p[3] * less, p[3] * more, power, footprint)
    by_half, by_lean = by_left * less + by_right * more, p[3] * (by_right - by_left)
    J = np.stack([shape, *(p[0] * one for one in (-by_x, -by_x * patch.u_mm, by_half, by_lean))])
    residual = patch.lift_mm - p[0] * shape
    z = np.abs(residual) / patch.sigma_mm
    weighted = J * np.minimum(1.0, _HUBER / np.maximum(z, 1e-300)) / patch.sigma_mm**2
    chi2 = float(_huber(z).sum())
    # no BLAS: the same bits on any number of cores
    return chi2, np.einsum("in,n->i", weighted, residual), np.einsum("in,jn->ij", weighted, J)


def _huber(z: Floats) -> Floats:
    """(N,) squares of deviations in sigma, as far as they count."""
    return np.where(z > _HUBER, 2.0 * _HUBER * z - _HUBER**2, z * z)


def _damped(gradient: Floats, normal: Floats, free: Bools, damping: float) -> Floats:
    """(5,) damped step of the free parameters (Marquardt); the others stay."""
    system = normal[np.ix_(free, free)]
    system[np.diag_indices(len(system))] += damping * np.diag(system) + 1e-12 * (normal[0, 0] + 1e-300)
    step = np.zeros(len(free))
    step[free] = np.linalg.solve(system, gradient[free])
    return step


def _descend(
    patch: Patch, p: Floats, power: int, footprint: float, free: Bools, narrowest: float
) -> tuple[Floats, float, Floats]:
    damping = 1e-3
    chi2, gradient, normal = _equations(patch, p, power, footprint)
    for _ in range(_STEPS):
        trial = p + _damped(gradient, normal, free, damping)
        trial[3] = max(trial[3], narrowest)
        trial[4] = min(max(trial[4], -0.8), 0.8)
        outcome, next_gradient, next_normal = _equations(patch, trial, power, footprint)
        if outcome < chi2:
            gain = chi2 - outcome
            p, chi2, gradient, normal = trial, outcome, next_gradient, next_normal
            damping *= 0.3
            if gain < 3e-3 * (1.0 + 1e-3 * chi2):
                break
        else:
            damping *= 8.0
            if damping > 1e8:
                break
    return p, chi2, normal


def _narrow(patch: Patch, ridge: Ridge, spacing: float) -> Ridge:
    """A ridge of few vertices across: see :mod:`burrscan.burrs.shape.grid_posterior`."""
    _, centre, slope, _, _ = ridge.parameters
    near = _part(patch, np.abs(patch.v_mm - centre - slope * patch.u_mm) < REACH * spacing)
    if not len(near.u_mm):  # the triangle lies beside all vertices: an axis far off leaves such
        return ridge
    slanted = bool(np.ptp(near.u_mm) >= _LONG * spacing)
    found = posterior_of(
        near,
        ridge.parameters[:4],
        spacing_mm=spacing,
        slanted=slanted,
    )
    if found is None:
        return ridge
    covariance = np.zeros((5, 5))
    covariance[:4, :4] = found.covariance
    count = max(len(near.u_mm), 1)
    summed = replace(
        ridge,
        parameters=np.append(found.mean, 0.0),
        covariance=covariance,
        chi2=found.chi2,
        noise_mm=found.noise_mm,
        misfit=found.chi2 / count,
    )
    # Three vertices across cannot tell one cross-section from another.
    if found.mean[3] < TELLS_SHAPES * spacing:
        return summed
    fitted = _fitted(near, summed.parameters, 1, _SYMMETRIC, (ridge.start_mm, ridge.end_mm), spacing)
    richer = _richest(near, fitted, spacing)
    return summed if richer is fitted else richer


def _extent(patch: Patch, ridge: Ridge, spacing: float) -> tuple[float, float]:
    """The stretch of u over which a ridge of that height explains the vertices better than none.

    The contiguous stretch of largest total gain (Kadane's algorithm), its ends half-way to the next vertex
    that could have told otherwise.
    """
    shape = ridge.shape(patch)
    on = np.flatnonzero(shape > _FLANK)
    if len(on) < 4:
        return ridge.start_mm, ridge.end_mm
    on = on[np.argsort(patch.u_mm[on], kind="stable")]
    model = ridge.height_mm * shape[on]
    # Half the height decides: a stretch at less than that is not this burr.
    gain = np.clip((patch.lift_mm[on] - 0.5 * model) * model / patch.sigma_mm[on] ** 2, -50.0, 50.0)
    total = np.cumsum(gain)
    before = np.minimum.accumulate(np.concatenate([[0.0], total[:-1]]))
    last = int(np.argmax(total - before))
    first = int(np.argmin(np.concatenate([[0.0], total[:-1]])[: last + 1]))
    u = patch.u_mm[on]
    low = u[first] - 0.5 * min(u[first] - u[first - 1], spacing) if first else u[first] - 0.25 * spacing
    high = (
        u[last] + 0.5 * min(u[last + 1] - u[last], spacing) if last + 1 < len(u) else u[last] + 0.25 * spacing
    )
    return float(low), float(high)


def misfit_of(patch: Patch, ridge: Ridge) -> float:
    """Robust weighted square per vertex of a patch, on the burr and off it."""
    on = (patch.u_mm >= ridge.start_mm) & (patch.u_mm <= ridge.end_mm)
    model = np.where(on, ridge.height_mm * ridge.shape(patch), 0.0)
    z = np.abs(patch.lift_mm - model) / patch.sigma_mm
    return float(_huber(z).mean())


def height_of(patch: Patch, ridge: Ridge, *, least_mm: float) -> tuple[float, float]:
    """Largest height along the burr and its standard deviation.

    The burr is cut into stretches of at least ``least_mm``, each with a height of its own. Where these differ
    by no more than noise would make them (Cochran's Q, 1 %) the common height is the answer, else that of the
    higher ones: see :func:`_largest`.
    """
    sigma = ridge.sigma_of([1, 0, 0, 0, 0])
    length = ridge.end_mm - ridge.start_mm
    count = int(np.clip(length / least_mm, 1, 24))
    if count < 3:
        return ridge.height_mm, sigma
    part = _between(patch, (ridge.start_mm, ridge.end_mm))
    stretch = np.minimum((part.u_mm - ridge.start_mm) / length * count, count - 1).astype(np.int64)
    share, weight = _relative_heights(part, ridge, stretch, count)
    gain, gain_sigma = _largest(share, weight / max(1.0, ridge.misfit))
    return ridge.height_mm * gain, float(np.hypot(sigma * gain, ridge.height_mm * gain_sigma))


def _relative_heights(patch: Patch, ridge: Ridge, stretch: Ints, count: int) -> tuple[Floats, Floats]:
    """Height of each stretch over the ridge's, and its weight; none where nothing of the burr is seen."""
    model = ridge.height_mm * ridge.shape(patch)
    residual = np.abs(patch.lift_mm - model)
    w = np.minimum(1.0, _HUBER * patch.sigma_mm / np.maximum(residual, 1e-300)) / patch.sigma_mm**2
    weight = np.bincount(stretch, weights=w * model**2, minlength=count).astype(np.float64)
    match = np.bincount(stretch, weights=w * model * patch.lift_mm, minlength=count)
    return match / np.maximum(weight, 1e-300), weight


def _largest(share: Floats, weight: Floats) -> tuple[float, float]:
    """Largest of several heights, relative to the common one, and its sigma; (1, 0) where all are alike.

    Where the higher ones, at least half of them, are alike, it is their mean: the lower ones lie at corners
    of the part, or the burr is lower there. Else a random-effects model: the spread of the true heights by
    DerSimonian & Laird (1986), then the posterior mean of each.
    """
    known = weight > 0.2 * np.median(weight)
    order = np.argsort(-share[known], kind="stable")
    h, w = share[known][order], weight[known][order]
    for count in range(len(h), max((len(h) - 1) // 2, 2), -1):
        most, excess = _common(h[:count], w[:count])
        if excess < chdtri(count - 1, _ALIKE):
            if count == len(share):
                return 1.0, 0.0
            return most, float(np.sqrt(max(1.0 / w[:count].sum() - 1.0 / weight.sum(), 0.0)))
    if len(h) < 3:
        return 1.0, 0.0
    mean, excess = _common(h, w)
    spread = (excess - len(h) + 1.0) / (w.sum() - w @ w / w.sum())
    drawn = mean + (h - mean) * spread / (spread + 1.0 / w)
    highest = int(np.argmax(drawn))
    return float(drawn[highest]), float(np.sqrt(1.0 / (w[highest] + 1.0 / spread)))


def _common(height: Floats, weight: Floats) -> tuple[float, float]:
    """Weighted mean, and Cochran's Q of the differences from it."""
    mean = float(weight @ height / weight.sum())
    return mean, float(weight @ (height - mean) ** 2)
