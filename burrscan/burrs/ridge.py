"""The measure of one burr: a ridge fitted to the deviations around it.

The largest deviation is biased upwards by noise and downwards by sampling; a ridge fitted to all vertices on the
burr is not. Cross-section: h (1 - |v/w|^p) with its own half-width on either side; p = 1 is a triangle (a burr's
usual idealisation, and the seed's), p = 2 a rounded one; the data choose.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats

_STEPS = 25
_HUBER = 3.0
_BETTER = 10.0
"""Drop of the weighted sum of squares that a richer cross-section must bring (BIC for thousands of points)."""
_FLANK = 0.15
"""Share of the height above which a vertex tells whether the burr is there."""


@dataclass(frozen=True)
class Patch:
    """Vertices around a burr in its own frame.

    Parameters
    ----------
    u_mm, v_mm
        (N,) along the burr and across it.
    lift_mm
        (N,) deviation, positive on the burr.
    sigma_mm
        (N,) noise.

    """

    u_mm: Floats
    v_mm: Floats
    lift_mm: Floats
    sigma_mm: Floats


@dataclass(frozen=True)
class Ridge:
    """A fitted ridge.

    Parameters
    ----------
    height_mm, centre_mm, slope, left_mm, right_mm
        Crest height, position across at u = 0, its change with u, and the two half-widths of the base.
    power
        p of the cross-section.
    covariance
        (5, 5) of those five.
    start_mm, end_mm
        Extent along u.
    chi2
        Weighted sum of squares, robust.

    """

    height_mm: float
    centre_mm: float
    slope: float
    left_mm: float
    right_mm: float
    power: int
    covariance: Floats
    start_mm: float
    end_mm: float
    chi2: float

    @property
    def width_mm(self) -> float:
        """Base width across the burr."""
        return self.left_mm + self.right_mm

    @property
    def fullness(self) -> float:
        """Cross-section area over height times width."""
        return self.power / (self.power + 1.0)

    @property
    def noise_mm(self) -> float:
        """Standard deviation of the height, the base's width taken as known."""
        normal = np.linalg.pinv(self.covariance)
        return float(1.0 / np.sqrt(max(normal[0, 0], 1e-300)))

    def sigma_of(self, gradient: list[float]) -> float:
        """Standard deviation of a combination of the five parameters."""
        g = np.array(gradient, dtype=np.float64)
        return float(np.sqrt(max(g @ self.covariance @ g, 0.0)))

    def shape(self, patch: Patch) -> Floats:
        """(N,) height of the unit ridge at each vertex, without regard to its ends."""
        q = _offset(patch, self.parameters)[0]
        return np.clip(1.0 - np.abs(q) ** self.power, 0.0, None)

    @property
    def parameters(self) -> Floats:
        """The five parameters as an array."""
        return np.array([self.height_mm, self.centre_mm, self.slope, self.left_mm, self.right_mm])


def fit_ridge(patch: Patch, *, spacing_mm: float, start: tuple[float, float]) -> Ridge | None:
    """Fit a ridge whose extent along u is first guessed as ``start``; None where nothing rises.

    Notes
    -----
    Levenberg-Marquardt with Huber weights from the best of a grid of positions and widths. O(N) per step.

    """
    inside = (patch.u_mm >= start[0]) & (patch.u_mm <= start[1])
    guess = _guess(_part(patch, inside), spacing_mm)
    if guess is None:
        return None
    ridge = _fitted(_part(patch, inside), guess, 1, symmetric=True, extent=start, spacing=spacing_mm)
    for _ in range(2):
        extent = _extent(patch, ridge, spacing_mm)
        inside = (patch.u_mm >= extent[0]) & (patch.u_mm <= extent[1])
        if inside.sum() < 6:
            return None
        ridge = _fitted(
            _part(patch, inside), ridge.parameters, 1, symmetric=True, extent=extent, spacing=spacing_mm
        )
    return _richest(_part(patch, inside), ridge, spacing_mm)


def _part(patch: Patch, inside: Bools) -> Patch:
    return Patch(patch.u_mm[inside], patch.v_mm[inside], patch.lift_mm[inside], patch.sigma_mm[inside])


def _richest(patch: Patch, ridge: Ridge, spacing: float) -> Ridge:
    """The simplest cross-section that no richer one beats clearly."""
    extent = (ridge.start_mm, ridge.end_mm)
    for power, symmetric in ((2, True), (1, False), (2, False)):
        other = _fitted(patch, ridge.parameters, power, symmetric=symmetric, extent=extent, spacing=spacing)
        if other.chi2 < ridge.chi2 - _BETTER * max(1.0, ridge.chi2 / max(len(patch.u_mm), 1)):
            ridge = other
    return ridge


def _offset(patch: Patch, parameters: Floats) -> tuple[Floats, Floats]:
    """Place across in units of the half-width, and the half-width that applies."""
    v = patch.v_mm - parameters[1] - parameters[2] * patch.u_mm
    width = np.where(v < 0.0, parameters[3], parameters[4])
    return v / width, width


def _guess(patch: Patch, spacing: float) -> Floats | None:
    """The position and width whose least-squares ridge explains most."""
    if len(patch.v_mm) < 6:
        return None
    rising = patch.lift_mm > 3.0 * patch.sigma_mm
    near = patch.v_mm[rising] if rising.sum() > 3 else patch.v_mm
    low, high = np.quantile(near, [0.02, 0.98])
    centres = np.linspace(low, high, max(int((high - low) / (0.25 * spacing)) + 1, 3))[:60]
    half = spacing * np.array([0.6, 0.85, 1.2, 1.7, 2.4, 3.4, 5.0, 7.0, 10.0])
    weight = patch.sigma_mm**-2
    shape = np.clip(1.0 - np.abs(patch.v_mm - centres[:, None, None]) / half[:, None], 0.0, None)
    power, match = (shape**2) @ weight, shape @ (weight * patch.lift_mm)
    gain = np.where((power > 0.0) & (match > 0.0), match**2 / np.maximum(power, 1e-300), 0.0)
    i, j = np.unravel_index(int(np.argmax(gain)), gain.shape)
    if gain[i, j] == 0.0:
        return None
    return np.array([match[i, j] / power[i, j], centres[i], 0.0, half[j], half[j]])


def _fitted(
    patch: Patch,
    start: Floats,
    power: int,
    *,
    symmetric: bool,
    extent: tuple[float, float],
    spacing: float,
) -> Ridge:
    """Levenberg-Marquardt on (height, centre, slope, left, right); one width for both sides if symmetric."""
    tie = np.eye(5)
    if symmetric:
        tie = np.delete(tie, 4, axis=1)
        tie[4, 3] = 1.0
    if np.ptp(patch.u_mm) < 3.0 * spacing:
        tie = np.delete(tie, 2, axis=1)
    parameters, damping = start.copy(), 1e-3
    chi2, residual, jacobian, weight = _model(patch, parameters, power)
    for _ in range(_STEPS):
        reduced = jacobian @ tie
        normal = reduced.T @ (weight[:, None] * reduced)
        gradient = reduced.T @ (weight * residual)
        scaled = normal + damping * np.diag(np.diag(normal) + 1e-12)
        trial = parameters + tie @ np.linalg.lstsq(scaled, gradient, rcond=None)[0]
        trial[3:] = np.maximum(trial[3:], 0.35 * spacing)
        outcome = _model(patch, trial, power)
        if outcome[0] < chi2:
            done = chi2 - outcome[0] < 1e-4 * (1.0 + 1e-3 * chi2)
            parameters, damping = trial, 0.3 * damping
            chi2, residual, jacobian, weight = outcome
            if done:
                break
        else:
            damping *= 8.0
    prior = tie.T @ np.diag([0.0, 0.0, 0.0, 1.0, 1.0]) @ tie / spacing**2
    covariance = _covariance(jacobian @ tie, weight, chi2, prior)
    return Ridge(*map(float, parameters), power, tie @ covariance @ tie.T, *extent, chi2)


def _model(patch: Patch, parameters: Floats, power: int) -> tuple[float, Floats, Floats, Floats]:
    """Robust chi-square, residuals, Jacobian and weights."""
    q, width = _offset(patch, parameters)
    size = np.abs(q)
    on = size < 1.0
    shape = np.where(on, 1.0 - size**power, 0.0)
    steep = np.where(on, parameters[0] * power * size ** (power - 1) * np.sign(q) / width, 0.0)
    wider = np.where(on, parameters[0] * power * size**power / width, 0.0)
    jacobian = np.stack(
        [shape, steep, steep * patch.u_mm, np.where(q < 0.0, wider, 0.0), np.where(q >= 0.0, wider, 0.0)],
        axis=1,
    )
    residual = patch.lift_mm - parameters[0] * shape
    z = np.abs(residual) / patch.sigma_mm
    weight = np.minimum(1.0, _HUBER / np.maximum(z, 1e-12)) / patch.sigma_mm**2
    chi2 = float(np.where(z < _HUBER, z**2, 2.0 * _HUBER * z - _HUBER**2).sum())
    return chi2, residual, jacobian, weight


def _covariance(jacobian: Floats, weight: Floats, chi2: float, prior: Floats) -> Floats:
    """Inverse normal matrix, enlarged where the model misses the data by more than their noise.

    Two or three vertices across a burr leave a trade between height and width open; the prior says no more than
    that the width is known to a vertex spacing, so that the stated uncertainty shows the trade.
    """
    normal = jacobian.T @ (weight[:, None] * jacobian)
    normal = normal / max(1.0, chi2 / max(len(jacobian) - len(normal), 1)) + prior
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    covariance: Floats = np.linalg.pinv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return covariance


def _extent(patch: Patch, ridge: Ridge, spacing: float) -> tuple[float, float]:
    """The stretch of u over which a ridge of that height explains the vertices better than none.

    The contiguous stretch of largest total gain (Kadane's algorithm), its ends half-way to the next vertex that
    could have told otherwise.
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


def heights_along(patch: Patch, ridge: Ridge, *, least_mm: float) -> tuple[float, float]:
    """Largest height along the burr and its standard deviation.

    The burr is cut into stretches of at least ``least_mm``. Where their heights agree within noise (chi-square,
    1 %) the common height is the answer; else the largest of them, smoothed over neighbours.
    """
    sigma = float(np.sqrt(ridge.covariance[0, 0]))
    length = ridge.end_mm - ridge.start_mm
    count = int(np.clip(length / least_mm, 1, 16))
    inside = (patch.u_mm >= ridge.start_mm) & (patch.u_mm <= ridge.end_mm)
    part = _part(patch, inside)
    if count < 3 or len(part.u_mm) < 6 * count:
        return ridge.height_mm, sigma
    shape = ridge.shape(part)
    stretch = np.minimum(((part.u_mm - ridge.start_mm) / length * count).astype(np.int64), count - 1)
    weight = 1.0 / part.sigma_mm**2
    power = np.bincount(stretch, weights=weight * shape**2, minlength=count)
    height = np.bincount(stretch, weights=weight * shape * part.lift_mm, minlength=count)
    height /= np.maximum(power, 1e-300)
    misfit = np.bincount(
        stretch, weights=weight * (part.lift_mm - height[stretch] * shape) ** 2, minlength=count
    )
    number = np.bincount(stretch, minlength=count)
    spread = np.sqrt(np.maximum(misfit / np.maximum(number - 1, 1), 1.0) / np.maximum(power, 1e-300))
    return _largest(height, spread, power > 0.0, ridge.height_mm, sigma)


def _largest(
    height: Floats, spread: Floats, known: Bools, common: float, sigma: float
) -> tuple[float, float]:
    height, spread = height[known], spread[known]
    count = len(height)
    chi2 = float((((height - common) / spread) ** 2).sum())
    # Wilson-Hilferty: the 99 % point of chi-square with n degrees of freedom.
    if count < 3 or chi2 < count * (1.0 - 2.0 / (9.0 * count) + 2.326 * np.sqrt(2.0 / (9.0 * count))) ** 3:
        return common, sigma
    padded = np.pad(height, 1, mode="edge")
    smooth = 0.25 * padded[:-2] + 0.5 * height + 0.25 * padded[2:]
    best = int(np.argmax(smooth))
    return float(smooth[best]), float(spread[best] * 0.61)
