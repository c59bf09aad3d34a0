"""A camera's response curve from pictures of one steady light at many exposures.

The exposure times are known, so the light of each picture is known up to one factor per place. The inverse
curve g, from DN to light, is a monotone spline (increments of an integrated B-spline basis, Ramsay 1988, kept
from falling) for which ``g(DN) = E t`` holds best; this is Debevec & Malik 1997 in linear light, with the
noise of each picture in its weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline
from scipy.optimize import lsq_linear

from burrscan.arrays import Floats, Ints, freeze
from burrscan.calibration.ramps import ExposureRamp, tiles_of
from burrscan.errors import InputError

_DEGREE = 3
"""Of the curve's B-splines: its slope is then piecewise quadratic, without kinks."""
_PIECES = 16
"""Even steps of the range; a camera's curve bends over larger parts of it, and finer steps follow the
noise."""
_OCTAVES = 5
"""Knots at halved distances towards the dark, where a gamma curve's slope changes by factors: to 1/512 of
the range."""
_BEND = 0.2
"""Standard deviation taken for granted of a slope's second difference between knots, relative to the slope.

It is loose, and decides only where no picture does.
"""
_STEPS = 8
"""Reweightings by slope and by fitted light; the start is a straight line."""
_MOST = 6.0
"""Standard deviations that an observed DN may be off its fitted one."""
_FEWEST_EXPOSURES = 6
"""Below clipping. Each tile is a ramp of its own, whose steps must overlap others' for a curve of twenty
coefficients."""
_LEAST_SLOPE = 0.01
"""Of the mean one: below it a slope no longer adds weight."""
_SLOPE_REACH = 1.0 / 128.0
"""Of the range, to each side: smooths over single DN, and is narrower than the even knots' steps."""
_SPARE_FRAMES = 4
"""Frames beyond the curve's freedom, fewer of which do not tell a lamp's flicker from the curve."""


@dataclass(frozen=True)
class ResponseCurve:
    """What a camera's DN mean in light.

    Parameters
    ----------
    light
        (2**bits,) light of each DN, relative to that of the highest; 0 at the black level, negative below.
    sigma
        (2**bits,) its standard deviation, the highest DN being exact by definition.
    shape_sigma
        (2**bits,) the same with its mean over the ramp as the unit: the highest DN is reached by continuing
        the curve, so its light is the least known of all, but in ratios the unit cancels.
    measured_dn
        Lowest and highest DN that the ramp covered; the rest is continued.

    """

    light: Floats
    sigma: Floats
    shape_sigma: Floats
    measured_dn: tuple[float, float]

    def __post_init__(self) -> None:
        freeze(self, light=self.light, sigma=self.sigma, shape_sigma=self.shape_sigma)

    @property
    def black_dn(self) -> float:
        """DN without light."""
        return float(np.interp(0.0, self.light, np.arange(len(self.light))))

    def light_of(self, dn: Floats) -> Floats:
        """Light of (mean) DN of any shape."""
        return np.interp(dn, np.arange(len(self.light)), self.light)

    def sigma_of(self, dn: Floats) -> Floats:
        """Standard deviation of :meth:`light_of` by the curve alone, but for the unit."""
        return np.interp(dn, np.arange(len(self.light)), self.shape_sigma)

    def slope_of(self, dn: Floats) -> Floats:
        """Light per DN, over 1/64 of the range: for weights, not for looks."""
        reach = len(self.light) * _SLOPE_REACH
        low, high = np.maximum(dn - reach, 0.0), np.minimum(dn + reach, len(self.light) - 1.0)
        return np.asarray((self.light_of(high) - self.light_of(low)) / (high - low))


class _Seen(NamedTuple):
    """Usable tiles of one channel: DN, sigma, exposure, which place under which lamp, which picture (n,)."""

    dn: Floats
    sigma_dn: Floats
    exposure_ms: Floats
    place: Ints
    frame: Ints


def camera_responses(ramps: Sequence[ExposureRamp], *, bit_depth: int) -> tuple[ResponseCurve, ...]:
    """The response curve of each channel.

    Parameters
    ----------
    ramps
        One per lamp; each channel needs some lamp under which it runs from dark to clipping.
    bit_depth
        Of the camera.

    Raises
    ------
    InputError
        When a channel has fewer than six different exposures below clipping, or covers less than half its
        range.

    """
    seen = [_channels(ramp, bit_depth) for ramp in ramps]
    return tuple(
        _curve(_joined(parts), channel, bit_depth) for channel, parts in enumerate(zip(*seen, strict=True))
    )


def _channels(ramp: ExposureRamp, bit_depth: int) -> list[_Seen]:
    tiles = tiles_of(ramp.images, saturation_dn=(1 << bit_depth) - 1)
    parts = []
    for channel in range(tiles.dn.shape[-1]):
        frame, tile = np.nonzero(tiles.usable[..., channel])
        dn, sigma = tiles.dn[frame, tile, channel], tiles.sigma_dn[frame, tile, channel]
        place = 2 * tile + ramp.lit[frame]  # with the lamp off a place has other light, as steady
        parts.append(_Seen(dn, sigma, ramp.exposures_ms[frame], place, frame))
    return parts


def _joined(parts: Sequence[_Seen]) -> _Seen:
    """Channels of several lamps: the same place under another lamp has other light."""
    lamp = np.repeat(np.arange(len(parts)), [len(part.dn) for part in parts])
    dn, sigma, exposure, place, frame = (np.concatenate(column) for column in zip(*parts, strict=True))
    return _Seen(dn, sigma, exposure, _numbered(lamp, place), _numbered(lamp, frame))


def _numbered(lamp: Ints, number: Ints) -> Ints:
    """The pairs (lamp, number) that occur, counted from 0."""
    pairs = lamp * (number.max(initial=0) + 1) + number
    return np.asarray(np.unique(pairs, return_inverse=True)[1])


def _curve(seen: _Seen, channel: int, bit_depth: int) -> ResponseCurve:
    top = float((1 << bit_depth) - 1)
    exposures = len(np.unique(seen.exposure_ms))
    if exposures < _FEWEST_EXPOSURES or np.ptp(seen.dn) < 0.5 * top:
        raise InputError(
            f"channel {channel}: {exposures} exposures below clipping cover {np.ptp(seen.dn):.0f} of "
            f"{top:.0f} DN; ramp from the dark until it clips, in {_FEWEST_EXPOSURES} steps or more"
        )
    basis = _basis(seen, top)
    coefficients, middle, covariance = _fit(seen, basis)
    rise = _integral(np.arange(top + 1.0), basis) - middle
    light = 1.0 + rise @ coefficients
    light, rise = light / light[-1], rise / light[-1]
    return ResponseCurve(
        light=light,
        sigma=_sigma(rise - np.outer(light, rise[-1]), covariance),
        shape_sigma=_sigma(rise, covariance),
        measured_dn=(float(seen.dn.min()), float(seen.dn.max())),
    )


def _sigma(rows: Floats, covariance: Floats) -> Floats:
    """Standard deviations of ``rows · c``; rounding may take a zero variance below zero."""
    return np.asarray(np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", rows, covariance, rows), 0.0)))


def _basis(seen: _Seen, top: float) -> BSpline:
    """Slopes that the curve is made of: B-splines over even steps in DN, and by octaves towards the dark."""
    low, high = float(seen.dn.min()), top
    octaves = 0.5 ** np.arange(_OCTAVES, 0, -1) / _PIECES
    inner = np.concatenate([octaves, np.arange(1, _PIECES) / _PIECES])
    knots = np.concatenate([[low] * _DEGREE, low + (high - low) * inner, [high] * _DEGREE])
    count = len(knots) - _DEGREE
    return BSpline(knots, np.eye(count), _DEGREE - 1, extrapolate=True)


def _integral(dn: Floats, basis: BSpline) -> Floats:
    """(n, k) integrals of the slopes; below the knots slopes stay what they are at the lowest."""
    low = basis.t[0]
    before = np.minimum(dn - low, 0.0)[:, None] * basis(low)
    return np.asarray(basis.antiderivative()(np.maximum(dn, low)) + before)


def _fit(seen: _Seen, basis: BSpline) -> tuple[Floats, Floats, Floats]:
    """Slopes c ≥ 0 for which ``g = 1 + (integral - middle) · c = E t`` holds best, E free at every place.

    The unit of light is free too, and the smaller the curve the smaller its residuals: so its mean over the
    data, each weighted by its part in the fit, is kept at 1 (``middle``); a unit set at one end would shrink
    the rest towards nothing. The noise is in the DN: slopes and light are taken at the DN that the last step
    fits (``dn``), and what is observed beyond it (``above``) is carried over by the slope. To take them at
    the observed ones would flatten the curve wherever the DN scatter more than they rise, as in the dark.
    Returns c, ``middle`` and the covariance of c.
    """
    c = np.full(basis.c.shape[1], 2.0 / np.ptp(seen.dn))
    dn, above = seen.dn, np.zeros(len(seen.dn))
    light = (seen.dn - seen.dn.min()) / np.ptp(seen.dn)
    least = _LEAST_SLOPE / np.ptp(seen.dn)
    for _ in range(_STEPS):
        integral, slope = _integral(dn, basis), np.maximum(basis(np.maximum(dn, basis.t[0])) @ c, least)
        weight = 1.0 / (slope * seen.sigma_dn)
        part = weight**2 * np.maximum(light, 0.0)
        middle = part @ integral / part.sum()
        exposure = seen.exposure_ms * weight
        matrix = _without_light((integral - middle) * weight[:, None], exposure, seen.place)
        wanted = -_without_light(((1.0 + above * slope) * weight)[:, None], exposure, seen.place)[:, 0]
        matrix = np.vstack([matrix, _smooth(c)])
        wanted = np.append(wanted, np.zeros(len(c) - 2))
        # of thousands of rows what their triangular factor keeps is the same problem
        _, few = np.linalg.qr(np.column_stack([matrix, wanted]))
        c = lsq_linear(few[:, :-1], few[:, -1], bounds=(0.0, np.inf), method="bvls").x
        light = 1.0 + (integral - middle) @ c
        above = np.clip(
            (matrix @ c - wanted)[: len(dn)] * seen.sigma_dn, -_MOST * seen.sigma_dn, _MOST * seen.sigma_dn
        )
        dn = seen.dn - above
    off = (wanted - matrix @ c)[: len(seen.dn)]
    covariance = np.asarray(np.linalg.pinv(matrix.T @ matrix)) * _scatter(off, seen, len(c))
    return c, np.asarray(middle), covariance


def _smooth(c: Floats) -> Floats:
    """(k - 2, k) rows that ask for small second differences of slopes that were about ``c``."""
    local = np.maximum(c, 0.1 * c.mean())
    return np.asarray(np.diff(np.eye(len(c)), n=2, axis=0) / (_BEND * local[1:-1, None]))


def _without_light(rows: Floats, light: Floats, place: Ints) -> Floats:
    """Rows (n, k) with their part along ``light`` (n,) removed within each place: its brightness is free."""
    norm = np.bincount(place, light**2)
    along = np.stack([np.bincount(place, column * light) for column in rows.T], axis=-1) / norm[:, None]
    return np.asarray(rows - light[:, None] * along[place])


def _scatter(off: Floats, seen: _Seen, free: int) -> float:
    """Factor on the variance: what the residuals say, single or, as a lamp flickers, frame by frame."""
    freedom = len(off) - len(np.unique(seen.place)) - free
    single = float(off @ off) / max(freedom, 1)
    sums, counts = np.bincount(seen.frame, off), np.bincount(seen.frame)
    spare = len(counts) - free - 1
    frames = float((sums**2 / counts).sum()) / spare if spare >= _SPARE_FRAMES else 1.0
    return max(1.0, single, frames)
