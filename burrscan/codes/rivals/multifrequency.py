"""Multi-frequency phase shifting, unwrapped by hierarchy: each period tells the stripe of the next finer one.

Huntley & Saldner 1993. Unwrapping by beats is in :mod:`burrscan.codes.rivals.heterodyne`.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.codes.code import Code
from burrscan.codes.phase import Phase, decode_phase, encode_phase
from burrscan.codes.unwrapping import climb
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet

_STEP_UP = 4.0
"""Ratio of neighbouring periods, about: to name the next finer stripe a phase must be right to half of
that, an eighth of its own."""
MARGIN = 0.1
"""Share by which the longest period exceeds the width: noise at one border then does not name the other."""


def longest_px(*, width: float) -> float:
    """A period a little over the width, so that noise at one border does not name the other."""
    return (1.0 + MARGIN) * width


def start(longest: Phase) -> Floats:
    """Columns from the longest period's phase, the margin split between both borders."""
    margin = 0.5 * MARGIN / (1.0 + MARGIN) * longest.period_px
    columns: Floats = (longest.offset_px.astype(float) + margin) % longest.period_px - margin
    return columns


def ladder_px(*, width: float, finest_px: float) -> tuple[float, ...]:
    """Periods from a little over the width down to ``finest_px`` in even ratios of about four."""
    width = longest_px(width=width)
    rungs = 1 + max(1, round(np.log(width / finest_px) / np.log(_STEP_UP)))
    return tuple(float(p) for p in np.geomspace(width, finest_px, rungs))


def encode(*, width: int, periods_px: tuple[float, ...], steps: int) -> tuple[Floats, tuple[str, ...]]:
    """``steps`` sine frames of each period."""
    parts = [encode_phase(width=width, period_px=period, steps=steps) for period in periods_px]
    return np.concatenate([light for light, _ in parts]), tuple(name for _, names in parts for name in names)


def phases_of(
    images: Image, camera: CameraSheet, *, periods_px: tuple[float, ...], steps: int
) -> tuple[Phase, ...]:
    """Each period's phase."""
    blocks = images.reshape(len(periods_px), steps, *images.shape[1:])
    return tuple(
        decode_phase(block, camera=camera, period_px=period)
        for block, period in zip(blocks, periods_px, strict=True)
    )


def decode_ladder(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    periods_px: tuple[float, ...],
    steps: int,
    max_sigma_px: float,
    z: float = 4.0,
) -> Correspondence:
    """From the longest period to the finest; doubtful where a step's noise could name the wrong stripe."""
    phases = phases_of(images, camera, periods_px=periods_px, steps=steps)
    u_px = start(phases[0])
    doubtful = np.zeros(u_px.shape, bool)
    return climb(phases, u_px, doubtful, width=width, max_sigma_px=max_sigma_px, z=z)


def ladder(*, width: int, finest_px: float = 16.0, steps: int = 8, max_sigma_px: float = 0.4) -> Code:
    """Hierarchical multi-frequency phase shifting: each period a quarter of the one before."""
    periods = ladder_px(width=width, finest_px=finest_px)
    light, names = encode(width=width, periods_px=periods, steps=steps)
    read = partial(decode_ladder, width=width, periods_px=periods, steps=steps, max_sigma_px=max_sigma_px)
    return Code(light, names, read)
