"""A camera's noise from the pictures of a scan themselves: photon transfer without a series made for it.

Pictures that must agree but for noise are compared pixel by pixel: sums of a pattern and its inverse, steps
of a sine against the sine through them. The variance of one picture is ``gain · (value - black) + read
noise²`` (EMVA 1288): a straight line whose slope is the gain. What else moves between the pictures (flicker,
a projector that bends sines) is taken for noise, so the estimate errs upwards.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincinv

from burrscan.arrays import Bools, Floats, Image, Ints

_NOISE_BINS = 32
"""Of the photon transfer curve, a straight line: enough to fit one, each with a median of many pixels."""
_PER_BIN = 200
"""Pixels: the median of so many variances, each of some twenty sums, is known to 3 %."""
_LEAST_GAIN = 1e-4
"""DN per electron where the pictures tell no slope: 10 000 electrons per DN are more than any well holds."""
_LEAST_SPREAD = 0.2
"""Of the brightest bin: over a narrower range of light a slope is not told from the floor."""
_MOST = 1_000_000
"""Samples that are looked at: more make the line no finer than its model."""
_ALIKE = 4
"""Pictures of one brightness that a variance is taken of: three degrees of freedom."""


@dataclass(frozen=True)
class Samples:
    """Pixels' values and variances.

    Parameters
    ----------
    mean_dn, variance_dn2
        (N,) of one picture each; of a variance with few degrees of freedom, scaled so that its median over
        like pixels is the variance.

    """

    mean_dn: Floats
    variance_dn2: Floats


def of_pairs(pairs: Image, *, top: int) -> Samples:
    """From (2 n, h, w) DN of patterns and inverses in turn: a pair's sum is that of every other pair."""
    sums = pairs[0::2].astype(np.float32) + pairs[1::2]
    return _samples(
        0.5 * sums.mean(axis=0),
        0.5 * sums.var(axis=0, ddof=1),
        np.logical_and.reduce(pairs < top, axis=0),
        len(sums) - 1,
    )


def of_steps(steps: Image, *, top: int) -> Samples:
    """From (n, h, w) DN of four or more equal steps of a sine: what is left of them beside the sine."""
    count = len(steps)
    values = steps.astype(np.float32)
    turn = 2.0 * np.pi * np.arange(count, dtype=np.float32) / count
    mean = values.mean(axis=0)
    sine, cosine = (np.tensordot(wave, values, axes=1) for wave in (np.sin(turn), np.cos(turn)))
    rest = ((values - mean) ** 2).sum(axis=0) - 2.0 / count * (sine**2 + cosine**2)
    freedom = count - 3
    return _samples(
        mean, np.maximum(rest, 0.0) / freedom, np.logical_and.reduce(steps < top, axis=0), freedom
    )


def of_levels(images: Image, lit: Bools, *, top: int) -> Samples:
    """From (n, h, w) DN and where each is lit: a pixel's first four bright values, and its first four dark.

    Bounced light differs from pattern to pattern, and is taken for noise.
    """
    both = []
    for chosen in (lit, ~lit):
        first = np.argsort(~chosen, axis=0, kind="stable")[:_ALIKE]
        values = np.take_along_axis(images, first, axis=0).astype(np.float32)
        usable = (chosen.sum(axis=0) >= _ALIKE) & np.logical_and.reduce(values < top, axis=0)
        both.append(_samples(values.mean(axis=0), values.var(axis=0, ddof=1), usable, _ALIKE - 1))
    return joined(both)


def joined(samples: Sequence[Samples]) -> Samples:
    """All of them together."""
    return Samples(
        np.concatenate([one.mean_dn for one in samples]),
        np.concatenate([one.variance_dn2 for one in samples]),
    )


def _samples(mean: Floats, variance: Floats, usable: Bools, freedom: int) -> Samples:
    step = max(1, int(np.count_nonzero(usable)) // _MOST)
    share = 2.0 * float(gammaincinv(0.5 * freedom, 0.5)) / freedom  # the median of chi-squared
    return Samples(mean[usable][::step].astype(float), variance[usable][::step].astype(float) / share)


def noise_of(samples: Samples, *, top: int, black_level_dn: float) -> tuple[float, float]:
    """Full well and read noise in electrons, as :class:`burrscan.devices.CameraSheet` states them.

    Where no pixel tells (all clip somewhere) a noise of one DN is stated, as good a guess as any.
    """
    gain, floor = _line(samples.mean_dn - black_level_dn, samples.variance_dn2)
    read_dn = float(np.sqrt(max(floor - 1.0 / 12.0, 0.01)))
    return (top - black_level_dn) / gain, read_dn / gain


def _line(mean: Floats, variance: Floats) -> tuple[float, float]:
    """Slope and intercept of variance over mean, from medians in bins of equal count."""
    if not len(mean):
        return _LEAST_GAIN, 1.0
    order: Ints = np.argsort(mean, kind="stable")
    bins = np.array_split(order, min(max(len(mean) // _PER_BIN, 1), _NOISE_BINS))
    x = np.array([mean[b].mean() for b in bins])
    y = np.array([np.median(variance[b]) for b in bins])
    if np.ptp(x) < _LEAST_SPREAD * x.max():
        return _LEAST_GAIN, float(y.mean())
    slope, intercept = np.polyfit(x, y, 1, w=1.0 / np.maximum(y, 1e-3))
    return (float(slope), float(intercept)) if slope > _LEAST_GAIN else (_LEAST_GAIN, float(y.mean()))
