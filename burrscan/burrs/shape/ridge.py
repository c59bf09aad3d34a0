"""The measure of one burr: a ridge fitted to the deviations around it.

The largest deviation is biased upwards by noise and downwards by sampling; a ridge fitted to all vertices on
the burr is not. Cross-section: h (1 - |v/w|^p) with its own half-width on either side; p = 1 is a triangle (a
burr's usual idealisation, and the seed's), blunt or not, p = 2 a rounded one; the data weigh them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.burrs.shape.grid_posterior import REACH, posterior_of
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.section import Kind, section

_STEPS = 25
"""Bounds Levenberg-Marquardt on five parameters, which ends by itself where a step gains nothing."""
HUBER = 3.0
"""In sigma: farther off a vertex pulls with a constant force, the same as in the posterior on a grid."""
_FLANK = 0.15
"""Share of the height above which a vertex tells whether the burr is there."""
_WELL_SAMPLED = 2.5
"""Half-width, in vertex spacings, from which the width is never in doubt."""
_TELLS_SHAPES = 1.0
"""Half-width, in vertex spacings, from which other cross-sections than the triangle are tried."""
_WIDEST_GAP = 0.5
"""Share of the half-width: where vertices leave more of the base unseen, as two or three rows along a burr
do, they tell no cross-section from another. What they tell then is one of many that go through them all."""
_LONG = 3.0
"""Length, in vertex spacings, from which a burr tells its direction."""
_TRIANGLE = Kind()
_SHAPES = Kind(), Kind(1, 1.0), Kind(2), Kind(1, 1.0, 0.33), Kind(1, 1.0, 0.67)
"""Cross-sections, their footprints in pixels; the first two differ by what a vertex is alone."""
_USUAL = 4.0
"""What the weighted sum of squares of any but the first must be less by to count as much: before all data
a triangle of point-like vertices is e² times as likely as each of the others. With 0 or 2, where data tell
nothing, triangles that a grid meets in three places come out 4 to 6 % too high."""
_SEEN_SHAPES = Kind(1, 1.0), Kind(2, 1.0), Kind(1, 1.0, 0.33), Kind(1, 1.0, 0.67)
"""Those of what pixels are known to be means over."""
_STARTS = (
    np.array([1.0, 1.0, 1.0, 1.0, 1.0]),
    np.array([1.5, 1.0, 1.0, 1.0, 1.0]),
    np.array([1.5, 1.0, 1.0, 1.5, 1.0]),
)
"""Heights and widths from which a ridge is sought, over those of the first: a flank that a pixel or two hold
may be of a burr that is higher, or wider."""
_PRIOR = np.array([0.0, *[_USUAL] * (len(_SHAPES) - 1)])
"""Of each of ``_SHAPES``: minus twice the log of its prior odds."""
_HALF_WIDTHS = np.array([0.6, 0.85, 1.2, 1.7, 2.4, 3.4, 5.0, 7.0, 10.0])
"""Tried first, in vertex spacings."""
_SYMMETRIC = np.array([True, True, True, True, False])
_TELLS_PIXELS = 1.5
"""Half-width, in pixels, from which these alone tell a height. With what points tell counted as much below it
the pulls of 165 burrs on 82 wheels are 0.92 (root mean square; without 1.14), errors 0.161 mm in the mean."""
_ALIKE_ROWS = 4.0
"""Rows of pixels along a burr whose errors are alike, the length over which a height is stated: what light
that bounced moves columns by is no noise. Of 117 burrs on 22 wheels heights are off by 0.17 mm in the mean if
every row counts by itself, 0.156 with 4 or 16, 0.163 if all count as one."""
_HIDDEN = 0.02
"""Half-width of a flank that is hidden, in pixels: a step in what they see."""
_SLOWLY = 0.2
"""The least share of a height that one step of a descent leaves of it: none falls below the surface."""
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
    kind
        Of the cross-section.
    start_mm, end_mm
        Extent along u.
    chi2
        Weighted sum of squares, robust.
    noise_mm
        Standard deviation of the height, all else taken as known.
    misfit
        ``chi2`` per vertex.
    open_mm
        Standard deviation of the height over the kinds of cross-section that the data leave open.

    """

    parameters: Floats
    covariance: Floats
    kind: Kind
    start_mm: float
    end_mm: float
    chi2: float
    noise_mm: float
    misfit: float
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
    def area_mm2(self) -> float:
        """Of its cross-section."""
        return self.fullness * self.height_mm * self.width_mm

    @property
    def fullness(self) -> float:
        """Cross-section area over height times width."""
        return (self.kind.power + self.kind.blunt) / (self.kind.power + 1.0)

    def base_middle_mm(self, u_mm: float) -> float:
        """Position across of the middle of the base."""
        _, centre, slope, half, asymmetry = self.parameters
        return float(centre + slope * u_mm + half * asymmetry)

    def sigma_of(self, gradient: list[float]) -> float:
        """Standard deviation of a combination of the five parameters."""
        g = np.array(gradient, dtype=np.float64)
        return float(np.sqrt(max(float(g @ self.covariance @ g), 0.0)))

    def shape(self, patch: Patch) -> Floats:
        """(N,) height of the unit ridge at each vertex, as it is seen, without regard to its ends."""
        return _profile(patch, self.parameters, self.kind)[0]


def first_ridge(patch: Patch, *, spacing_mm: float, start: tuple[float, float]) -> Ridge | None:
    """Fit a triangle whose extent along u is first guessed as ``start``; None where nothing rises.

    Notes
    -----
    Levenberg-Marquardt with Huber weights from the best of a grid of positions and widths. O(N) per step.

    """
    inside = between(patch, start)
    guess = _guess(inside, spacing_mm)
    if guess is None:
        return None
    guess[1] += patch.slant * guess[0]
    kind = Kind(1, patch.pixel_mm)
    ridge = _fitted(inside, guess, kind, _SYMMETRIC, start, spacing_mm)
    for _ in range(2):
        extent = _extent(patch, ridge, spacing_mm)
        inside = between(patch, extent)
        if len(inside.u_mm) < 6:
            return None
        ridge = _fitted(inside, ridge.parameters, kind, _SYMMETRIC, extent, spacing_mm)
    return ridge


def fit_ridge(patch: Patch, ridge: Ridge, *, spacing_mm: float, footprint_mm: float | None = None) -> Ridge:
    """From a first triangle to the ridge.

    Parameters
    ----------
    patch
        The vertices around it.
    ridge
        The triangle, and where it begins and ends.
    spacing_mm
        Distance between neighbouring vertices across it.
    footprint_mm
        What a vertex may be the mean over; the spacing, unless several views' vertices lie between one
        another.

    Notes
    -----
    The cross-section that explains most, its height the mean over all of them (Bayesian model averaging,
    Hoeting et al. 1999). Where few vertices lie across, its place and width are the mean of what explains
    them (:mod:`burrscan.burrs.shape.grid_posterior`); not where pixels show them, whose means are smooth.

    """
    inside = between(patch, (ridge.start_mm, ridge.end_mm))
    if patch.pixel_mm > 0.0:
        return _seen(inside, ridge, spacing_mm)
    if ridge.parameters[3] > _WELL_SAMPLED * spacing_mm:
        footprint = footprint_mm or spacing_mm
        return _averaged(inside, ridge, (_SYMMETRIC, _ALL), _SHAPES, spacing_mm, footprint)
    return _narrow(inside, ridge, spacing_mm)


def _seen(patch: Patch, start: Ridge, spacing: float) -> Ridge:
    """A ridge as the pixels of one camera see it, whose lifts are means over known footprints.

    Few pixels may show a steep one, of which most is hidden, as well as a flat one. What they tell as points,
    each for itself, is then as likely: the height is the geometric mean, and what both differ by is open.
    """
    seen = _of_pixels(patch, start, spacing)
    if seen.parameters[3] >= _TELLS_PIXELS * patch.pixel_mm:
        return seen
    points = patch.as_points()
    first = first_ridge(points, spacing_mm=spacing, start=(start.start_mm, start.end_mm))
    if first is None:
        return seen
    other = fit_ridge(points, first, spacing_mm=spacing)
    middle = float(np.sqrt(seen.height_mm * max(other.height_mm, 1e-9)))
    apart = 0.5 * abs(float(np.log(seen.height_mm / max(other.height_mm, 1e-9)))) * middle
    return _of_height(seen, middle, float(np.hypot(max(seen.open_mm, other.open_mm), apart)))


def _of_pixels(patch: Patch, start: Ridge, spacing: float) -> Ridge:
    """The mean over all kinds of cross-section, from several starts, as pixels see them."""
    starts = [
        _fitted(
            patch, start.parameters * scale, start.kind, _SYMMETRIC, (start.start_mm, start.end_mm), spacing
        )
        for scale in _STARTS
    ]
    best = min(starts, key=lambda one: one.chi2)
    lean = best.parameters[3] > _WELL_SAMPLED * spacing
    leans = (_SYMMETRIC, _ALL) if lean else (_SYMMETRIC,)
    return _averaged(patch, best, leans, _SEEN_SHAPES, spacing, patch.pixel_mm, alike=_ALIKE_ROWS)


def _averaged(
    patch: Patch,
    start: Ridge,
    leans: Sequence[Bools],
    shapes: Sequence[Kind],
    spacing: float,
    footprint: float,
    *,
    alike: float = 1.0,
) -> Ridge:
    """The mean over all kinds of cross-section, with ``leans`` free, by Schwarz's criterion."""
    free = np.log(max(len(patch.u_mm), 1)) * np.array([lean.sum() for lean in leans])
    fits = _fits(patch, start, leans, shapes, spacing, footprint)
    prior = np.add.outer(free, _PRIOR[: len(shapes)]).ravel()
    return _mean(fits, prior, len(patch.u_mm), alike=alike)


def _fits(
    patch: Patch,
    start: Ridge,
    leans: Sequence[Bools],
    shapes: Sequence[Kind],
    spacing: float,
    pixel: float,
) -> list[Ridge]:
    """A ridge of every kind of cross-section, ``leans`` by ``leans``."""
    extent = (start.start_mm, start.end_mm)
    return [
        _fitted(patch, start.parameters, Kind(power, footprint * pixel, blunt), free, extent, spacing)
        for free in leans
        for power, footprint, blunt in shapes
    ]


def _mean(fits: Sequence[Ridge], prior: Floats, count: int, *, alike: float = 1.0) -> Ridge:
    """The likeliest ridge, its height the mean over all, ``prior`` being added to their sums of squares.

    What no kind explains (the misfit, squared) makes all of them less sure: vertices do not err
    independently, and a scan's worst errors are where burrs are. So does what errors are ``alike`` along it,
    in rows.
    """
    chi2 = np.array([one.chi2 for one in fits])
    score = chi2 / max(1.0, float(chi2.min()) / max(count, 1)) ** 2 / alike + prior
    weight = np.exp(-0.5 * (score - score.min()))
    weight /= weight.sum()
    logs = np.log([max(one.height_mm, 1e-9) for one in fits])
    mean = float(weight @ logs)
    height = float(np.exp(mean))
    open_mm = height * float(np.sqrt(weight @ (logs - mean) ** 2))
    return _of_height(fits[int(np.argmax(weight))], height, open_mm)


def _of_height(ridge: Ridge, height_mm: float, open_mm: float) -> Ridge:
    """The same ridge, higher or lower, and as sure of its height in proportion, if it had one above 0."""
    by = height_mm / ridge.height_mm if ridge.height_mm > 0.0 else 1.0
    scale = np.append(by, np.ones(len(ridge.parameters) - 1))
    return replace(
        ridge,
        parameters=np.append(height_mm, ridge.parameters[1:]),
        covariance=scale[:, None] * ridge.covariance * scale,
        noise_mm=by * ridge.noise_mm,
        open_mm=open_mm,
    )


def between(patch: Patch, extent: tuple[float, float]) -> Patch:
    """The part of a patch within an extent along u."""
    return patch.of((patch.u_mm >= extent[0]) & (patch.u_mm <= extent[1]))


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
    kind: Kind,
    free: Bools,
    extent: tuple[float, float],
    spacing: float,
) -> Ridge:
    """Levenberg-Marquardt over the free parameters; the slope only where the burr is long enough for one."""
    free = free.copy()
    free[2] &= bool(np.ptp(patch.u_mm) >= _LONG * spacing)
    parameters, chi2, normal = _descend(patch, start.copy(), kind, free, 0.35 * spacing)
    misfit = max(1.0, chi2 / max(len(patch.u_mm) - int(free.sum()), 1))
    noise = float(np.sqrt(misfit / max(normal[0, 0], 1e-300)))
    return Ridge(
        parameters,
        _covariance(normal / misfit, free, spacing),
        kind,
        *extent,
        chi2,
        noise,
        chi2 / len(patch.u_mm),
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


def _equations(patch: Patch, p: Floats, kind: Kind) -> tuple[float, Floats, Floats]:
    """Robust chi-square, gradient and normal matrix."""
    shape, by_x, by_left, by_right = _profile(patch, p, kind)
    less, more = 1.0 - p[4], 1.0 + p[4]
    by_half, by_lean = by_left * less + by_right * more, p[3] * (by_right - by_left)
    higher = patch.slant / (1.0 - kind.blunt) * (by_x - by_left + by_right)
    J = np.stack(
        [shape + p[0] * higher, *(p[0] * one for one in (-by_x, -by_x * patch.u_mm, by_half, by_lean))]
    )
    residual = patch.lift_mm - p[0] * shape
    z = np.abs(residual) / patch.sigma_mm
    weighted = J * np.minimum(1.0, HUBER / np.maximum(z, 1e-300)) / patch.sigma_mm**2
    chi2 = float(huber(z).sum())
    # no BLAS: the same bits on any number of cores
    gradient, normal = np.einsum("in,n->i", weighted, residual), np.einsum("in,jn->ij", weighted, J)
    if patch.pixel_mm > 0.0:  # a height is the base's width within a factor e, as in the posterior on a grid
        aspect, by_aspect = float(np.log(p[0] / (2.0 * p[3]))), np.array([1.0 / p[0], 0, 0, -1.0 / p[3], 0])
        chi2 += aspect**2
        gradient -= aspect * by_aspect
        normal += np.outer(by_aspect, by_aspect)
    return chi2, gradient, normal


def _profile(patch: Patch, p: Floats, kind: Kind) -> tuple[Floats, Floats, Floats, Floats]:
    """(N,) heights of the unit ridge as it is seen, derivatives with x and with both half-widths.

    Seen askew a triangle is one of the same height, whose crest is moved towards one side by as far as the
    line of sight goes across; of a flank that turns away nothing is seen, nor of a flat top beyond its edge.
    Of what is cut in, what is behind the rim is hidden. All of it is linear in the places where the lines of
    sight meet the surface below.
    """
    apex = patch.slant * p[0] / (1.0 - kind.blunt)  # of a blunt one: of the triangle that it was
    across = patch.v_mm - (p[1] - apex) - p[2] * patch.u_mm
    left, right = p[3] * (1.0 - p[4]) - apex, p[3] * (1.0 + p[4]) + apex
    top = 1.0 if patch.sunk else kind.blunt
    seen = -top * left if left < 0.0 else -np.inf, top * right if right < 0.0 else np.inf
    least = _HIDDEN * patch.pixel_mm
    shape, by_x, by_left, by_right = section(across, max(left, least), max(right, least), kind, seen=seen)
    return shape, by_x, by_left * (left > least), by_right * (right > least)


def huber(z: Floats) -> Floats:
    """(N,) squares of deviations in sigma, as far as they count."""
    return np.where(z > HUBER, 2.0 * HUBER * z - HUBER**2, z * z)


def _damped(gradient: Floats, normal: Floats, free: Bools, damping: float) -> Floats:
    """(5,) damped step of the free parameters (Marquardt); the others stay."""
    system = normal[np.ix_(free, free)]
    system[np.diag_indices(len(system))] += damping * np.diag(system) + 1e-12 * (normal[0, 0] + 1e-300)
    step = np.zeros(len(free))
    step[free] = np.linalg.solve(system, gradient[free])
    return step


def _descend(
    patch: Patch, p: Floats, kind: Kind, free: Bools, narrowest: float
) -> tuple[Floats, float, Floats]:
    damping = 1e-3
    chi2, gradient, normal = _equations(patch, p, kind)
    for _ in range(_STEPS):
        trial = p + _damped(gradient, normal, free, damping)
        trial[3] = max(trial[3], narrowest)
        trial[4] = min(max(trial[4], -0.8), 0.8)
        if patch.pixel_mm > 0.0:
            trial[0] = max(trial[0], _SLOWLY * p[0])
        outcome, next_gradient, next_normal = _equations(patch, trial, kind)
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
    near = patch.of(np.abs(patch.v_mm - centre - slope * patch.u_mm) < REACH * spacing)
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
    told = found.mean[3] >= _TELLS_SHAPES * spacing and _gap(near, summed) <= _WIDEST_GAP * found.mean[3]
    shapes = _SHAPES if told else _SHAPES[:2]
    fits = _fits(near, summed, (_SYMMETRIC,), shapes, spacing, spacing)
    if not told:  # nor whether vertices are points or means over a pixel, whatever neither explains may say
        points, means = (max(fit.height_mm, 1e-3 * summed.height_mm) for fit in fits)
        apart = abs(float(np.log(means / points)))
        return replace(summed, open_mm=0.5 * apart * summed.height_mm)
    averaged = _mean(fits, _PRIOR, count)
    # a descent's height differs from the posterior's mean, and it does not know what is open
    by = summed.height_mm / fits[0].height_mm
    likeliest = summed
    if averaged.kind != _TRIANGLE:
        rest = averaged.parameters[1:]
        likeliest = replace(
            averaged, parameters=np.append(summed.height_mm, rest), covariance=summed.covariance
        )
    return _of_height(likeliest, by * averaged.height_mm, by * averaged.open_mm)


def _gap(patch: Patch, ridge: Ridge) -> float:
    """Widest part of the base, across, without a vertex."""
    _, centre, slope, half, _ = ridge.parameters
    v = patch.v_mm - centre - slope * patch.u_mm
    places = np.sort(np.append(v[np.abs(v) < half], [-half, half]))
    return float(np.diff(places).max())


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
    return float(huber(z).mean())
