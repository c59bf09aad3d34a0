"""Which two exposures an adaptive scan takes, from the bracketed response alone."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.devices import CameraSheet
from burrscan.scan.exposure import Response, sine_sigma_px

_BINS = 240
"""Of the logarithm of the response: over four decades a bin is 4 % wide, finer than the grid of exposures."""
_CANDIDATES = 28
"""Exposures over the camera's range, even in ratio: 36 % apart on the default camera. The cost grows with
their square."""
_ROOF = 0.9
"""Share of the well: shot noise, and what neighbours add, may still come on top without clipping."""


def plan_exposures_ms(
    response: Response,
    *,
    camera: CameraSheet,
    period_px: float,
    steps: tuple[int, int],
    max_sigma_px: float,
    least: float,
    most_clipped: float = 5e-4,
) -> tuple[float, float]:
    """Exposures of the crude round (full light) and of the final round (adapted light).

    Parameters
    ----------
    response
        Of each camera pixel.
    camera, period_px
        The instrument and the stripes.
    steps
        Sine frames of the two rounds.
    max_sigma_px
        A pixel no finer than this counts as lost, at the square of this.
    least
        The dimmest intensity that still carries a pattern.
    most_clipped
        Share of the seen pixels that the crude round may clip: what it clips it cannot place.

    Notes
    -----
    Minimises the expected squared error over all pairs of a grid, on a histogram of the response: a pixel
    that the crude round reads will be dimmed to fit the final one; one that it does not read stays at full
    light there. O(candidates² · bins).

    """
    count, rate = _histogram(response, camera)
    background = float(np.median(response.black_e_per_ms))
    exposures = np.geomspace(*camera.exposure_range_ms, _CANDIDATES)
    crude = [_information(rate, background, t, camera, period_px, steps[0], 0.0) for t in exposures]
    clipped = [float(count[rate * t > _ROOF * camera.full_well_e].sum()) for t in exposures]
    best, pair = np.inf, (exposures[0], exposures[-1])
    for i, first in enumerate(crude):
        if i > 0 and clipped[i] > most_clipped * count.sum():
            break
        read = first > 1.0 / max_sigma_px**2
        for j in range(i, _CANDIDATES):
            final_ms = exposures[j]
            plain = _information(rate, background, final_ms, camera, period_px, steps[1], 0.0)
            adapted = _information(rate, background, final_ms, camera, period_px, steps[1], least)
            total = first + np.where(read, adapted, plain)
            with np.errstate(divide="ignore"):
                cost = float((count * np.minimum(1.0 / total, max_sigma_px**2)).sum())
            if cost < best:
                best, pair = cost, (exposures[i], final_ms)
    return float(pair[0]), float(pair[1])


def _histogram(response: Response, camera: CameraSheet) -> tuple[Floats, Floats]:
    """Pixels per bin of response, and the bins' electrons per ms, of the pixels that see any light."""
    rates = response.signal_e_per_ms[
        response.signal_e_per_ms * camera.exposure_range_ms[1] > camera.read_noise_e
    ]
    if rates.size == 0:
        return np.zeros(1), np.ones(1)
    count, edges = np.histogram(np.log(rates), bins=_BINS)
    return count.astype(float), np.exp(0.5 * (edges[1:] + edges[:-1]))


def _information(
    rate: Floats,
    background: float,
    exposure_ms: float,
    camera: CameraSheet,
    period_px: float,
    steps: int,
    least: float,
) -> Floats:
    """Inverse variance that a round yields per bin; dimmed to fit, down to ``least``, where that is not 0."""
    roof = _ROOF * camera.full_well_e
    signal, dark = rate * exposure_ms, max(background, 0.0) * exposure_ms
    if least > 0.0:
        signal *= np.clip(roof / signal, least, 1.0)
    sigma = sine_sigma_px(signal, np.full_like(signal, dark), camera=camera, period_px=period_px, steps=steps)
    return np.where(signal + dark < roof, 1.0 / sigma**2, 0.0)
