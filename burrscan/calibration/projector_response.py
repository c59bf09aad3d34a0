"""A projector's response curves from pictures of even levels, seen by a camera whose own curves are known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.optimize import isotonic_regression

from burrscan.arrays import Bools, Floats, Ints, freeze
from burrscan.calibration.camera_response import ResponseCurve
from burrscan.calibration.ramps import LevelRamp, tiles_of
from burrscan.devices import ProjectorSheet
from burrscan.errors import InputError

_STEPS = 30
"""Alternations of shares and lines, which settle geometrically; each is a few sums."""
_OFF = -1
"""Level that stands for a projector switched off or covered, in a ramp's list of levels."""
_NOTHING = 1e-300
"""Keeps a division finite where no picture tells; anything above it is information."""


@dataclass(frozen=True)
class ProjectorResponse:
    """What each primary's levels give in light, and what the camera sees of it.

    Parameters
    ----------
    sheets
        One per primary.
    sigma
        (primaries, 256) standard deviation of their light; 255 is exact by definition.
    seen, seen_sigma
        (channels, primaries) linear light per ms, in each camera channel, of each primary at full; the mean
        over the board.

    """

    sheets: tuple[ProjectorSheet, ...]
    sigma: Floats
    seen: Floats
    seen_sigma: Floats

    def __post_init__(self) -> None:
        freeze(self, sigma=self.sigma, seen=self.seen, seen_sigma=self.seen_sigma)


class _Rate(NamedTuple):
    """Linear light per ms (F, sensors), its random and the curve's own deviation, and which are usable.

    A sensor is a tile in one camera channel.
    """

    light: Floats
    sigma: Floats
    systematic: Floats
    usable: Bools


class _Rise(NamedTuple):
    """Above level 0: share of each level measured (256,), and light at full per sensor, with deviations."""

    share: Floats
    sigma: Floats
    full: Floats
    full_sigma: Floats


def projector_response(ramp: LevelRamp, curves: Sequence[ResponseCurve]) -> ProjectorResponse:
    """Recover every primary's curve.

    Parameters
    ----------
    ramp
        Each primary ramped with the others at level 0; some pictures with the projector off.
    curves
        One per camera channel.

    Notes
    -----
    Per primary and tile the light is ``dark + full · share(level)``: rank one beside a constant, solved by
    alternating weighted least squares over all tiles, channels and exposures; levels in between are
    interpolated (monotone, Fritsch & Carlson 1980). The light at level 0 less that with the projector off is
    what all primaries leak together; each primary's part follows by solving for the camera's channels. With
    no picture of the projector off, the surround counts as the projector's black level.

    Raises
    ------
    InputError
        When a primary lacks level 0 or 255 below clipping.

    """
    rate = _rates(ramp, curves)
    off = (ramp.levels == _OFF).all(axis=1)
    dark = ~off & (ramp.levels == 0).all(axis=1)
    rises = [_rise(ramp.levels, primary, rate) for primary in range(ramp.levels.shape[1])]
    channels = len(curves)
    full = np.stack([_per_channel(rise.full, channels) for rise in rises], axis=-1)
    leak = _leaks(rate, dark, off, full, channels)
    sheets = tuple(ProjectorSheet(_with_leak(rise.share, b)) for rise, b in zip(rises, leak, strict=True))
    return ProjectorResponse(
        sheets=sheets,
        sigma=np.stack([rise.sigma for rise in rises]),
        seen=full * (1.0 + leak),
        seen_sigma=np.stack([_mean_sigma(rise.full_sigma, channels) for rise in rises], axis=-1),
    )


def _rates(ramp: LevelRamp, curves: Sequence[ResponseCurve]) -> _Rate:
    tiles = tiles_of(ramp.images, saturation_dn=len(curves[0].light) - 1)
    if tiles.dn.shape[-1] != len(curves):
        raise InputError(f"pictures of {tiles.dn.shape[-1]} channel(s), but {len(curves)} response curve(s)")
    per_ms = 1.0 / ramp.exposures_ms[:, None]

    def each(values: list[Floats]) -> Floats:
        return np.concatenate(values, axis=1) * per_ms

    dn = [tiles.dn[..., c] for c in range(len(curves))]
    return _Rate(
        light=each([curve.light_of(d) for curve, d in zip(curves, dn, strict=True)]),
        sigma=each(
            [
                curve.slope_of(d) * tiles.sigma_dn[..., c]
                for c, (curve, d) in enumerate(zip(curves, dn, strict=True))
            ]
        ),
        systematic=each([curve.sigma_of(d) for curve, d in zip(curves, dn, strict=True)]),
        usable=np.concatenate([tiles.usable[..., c] for c in range(len(curves))], axis=1),
    )


def _rise(levels: Ints, primary: int, rate: _Rate) -> _Rise:
    """Alternating least squares for one primary: a share per level, a line over the shares per sensor."""
    shown = _ramped(levels, primary, rate)
    level, number = np.unique(levels[shown, primary], return_inverse=True)
    light, w, systematic = rate.light[shown], _weight(rate, shown), rate.systematic[shown]

    def summed(values: Floats) -> Floats:
        return np.bincount(number, values.sum(axis=1), len(level)).astype(float)

    share: Floats = np.asarray((level / 255.0) ** 2, dtype=float)
    for _ in range(_STEPS):
        base, full = _lines(light, w, share[number])
        information = np.maximum(summed(np.asarray(w * full**2, dtype=float)), _NOTHING)
        share = summed(w * full * (light - base)) / information
        share = (share - share[0]) / (share[-1] - share[0])
    base, full = _lines(light, w, share[number])
    off = light - base - full * share[number][:, None]
    scatter = max(
        1.0, float(np.mean(summed(w * off**2) / np.maximum(summed(np.asarray(w > 0.0, dtype=float)), 1.0)))
    )
    sigma = np.sqrt(scatter / information + (summed(w * full * systematic) / information) ** 2)
    return _Rise(
        share=_every(level, isotonic_regression(share, weights=information).x),
        # the unit, level 255, has a deviation of its own, which every level shares
        sigma=np.interp(np.arange(256.0), level, np.hypot(sigma, share * sigma[-1]) * (level < 255)),
        full=full,
        full_sigma=_full_sigma(w, share[number][:, None], systematic, scatter),
    )


def _ramped(levels: Ints, primary: int, rate: _Rate) -> Bools:
    """The pictures (F,) that ramp one primary with the others at 0."""
    others = np.delete(levels, primary, axis=1)
    shown: Bools = np.asarray((levels[:, primary] >= 0) & (others == 0).all(axis=1))
    for level in (0, 255):
        if not rate.usable[shown & (levels[:, primary] == level)].any():
            raise InputError(
                f"primary {primary}: no unclipped picture at level {level} with the other primaries at 0; the"
                " ramp needs one (a shorter exposure for 255, a longer one or a higher black level for 0)"
            )
    return shown


def _every(level: Ints, share: Floats) -> Floats:
    """(256,) shares of all levels from those measured, by monotone cubics."""
    return np.asarray(np.clip(PchipInterpolator(level, share)(np.arange(256.0)), 0.0, 1.0))


def _full_sigma(w: Floats, share: Floats, systematic: Floats, scatter: float) -> Floats:
    """Deviation of each sensor's light at full: its noise, and the camera's curve where it was read."""
    information = np.maximum((w * share**2).sum(axis=0), _NOTHING)
    curve = (w * share**2 * systematic).sum(axis=0) / information
    return np.asarray(np.hypot(np.sqrt(scatter / information), curve))


def _weight(rate: _Rate, frames: Bools) -> Floats:
    """Inverse variances; the curve's own error, though not random, counts against where it is unsure."""
    variance = rate.sigma[frames] ** 2 + rate.systematic[frames] ** 2
    return np.where(rate.usable[frames], 1.0 / np.maximum(variance, 1e-24), 0.0)


def _lines(light: Floats, w: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Per sensor the weighted line ``base + full · share`` through its pictures."""
    s = share[:, None]
    n, sx, sxx = w.sum(axis=0), (w * s).sum(axis=0), (w * s * s).sum(axis=0)
    sy, sxy = (w * light).sum(axis=0), (w * s * light).sum(axis=0)
    determinant = n * sxx - sx * sx
    safe = np.where(determinant > 1e-9 * n * sxx, determinant, np.inf)
    full = (n * sxy - sx * sy) / safe
    base = (sy - full * sx) / np.maximum(n, _NOTHING)
    return base, full


def _leaks(rate: _Rate, dark: Bools, off: Bools, full: Floats, channels: int) -> Floats:
    """Light at level 0 of each primary, as a share of its rise from 0 to 255."""
    black = _mean_rate(rate, dark, channels) - (_mean_rate(rate, off, channels) if off.any() else 0.0)
    return np.asarray(np.maximum(np.linalg.lstsq(full, black, rcond=None)[0], 0.0))


def _mean_rate(rate: _Rate, frames: Bools, channels: int) -> Floats:
    w = _weight(rate, frames)
    mean = (w * rate.light[frames]).sum(axis=0) / np.maximum(w.sum(axis=0), _NOTHING)
    return _per_channel(mean, channels)


def _per_channel(sensors: Floats, channels: int) -> Floats:
    return np.asarray(sensors.reshape(channels, -1).mean(axis=1))


def _mean_sigma(sigma: Floats, channels: int) -> Floats:
    """Of the mean over tiles, as if their errors were one: the curve's error is common to all."""
    return _per_channel(sigma, channels)


def _with_leak(share: Floats, leak: float) -> Floats:
    return np.asarray((share + leak) / (1.0 + leak))
