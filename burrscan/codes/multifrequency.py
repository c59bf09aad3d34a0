"""Multi-frequency phase shifting, unwrapped by hierarchy or by heterodyne beats.

Several sine periods; their differences (beats) have long periods that tell the stripe of the next finer one
(Reich, Ritter, Thesing 1997; Huntley & Saldner 1993 for the ladder of periods).
"""

from __future__ import annotations

from functools import partial
from itertools import pairwise

import numpy as np

from burrscan.arrays import Bools, Floats, Image
from burrscan.codes.code import Code
from burrscan.codes.phase import Phase, decode_phase, encode_phase
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet

_STEP_UP = 4.0
_MARGIN = 0.1


def longest_px(*, width: float) -> float:
    """A period a little over the width, so that noise at one border does not name the other."""
    return (1.0 + _MARGIN) * width


def start(longest: Phase) -> Floats:
    """Columns from the longest period's phase, the margin split between both borders."""
    margin = 0.5 * _MARGIN / (1.0 + _MARGIN) * longest.period_px
    columns: Floats = (longest.offset_px.astype(float) + margin) % longest.period_px - margin
    return columns


def ladder_px(*, width: float, finest_px: float) -> tuple[float, ...]:
    """Periods from a little over the width down to ``finest_px`` in even ratios of about four."""
    width = longest_px(width=width)
    rungs = 1 + max(1, round(np.log(width / finest_px) / np.log(_STEP_UP)))
    return tuple(float(p) for p in np.geomspace(width, finest_px, rungs))


def beats_px(*, width: float, finest_px: float) -> tuple[float, float, float]:
    """Three close periods whose beats' beat is a little longer than the projector is wide.

    The beats of neighbours are the geometric mean of the finest period and the width.
    """
    width = longest_px(width=width)
    beat = 1.0 / np.sqrt(finest_px * width)
    first = 1.0 / finest_px
    second = first - beat
    third = second - (beat - 1.0 / width)
    return 1.0 / first, 1.0 / second, 1.0 / third


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


def refine(u_px: Floats, phase: Phase) -> tuple[Floats, Floats]:
    """The column with this phase nearest to ``u_px``, and how far that is."""
    moved = (phase.offset_px - u_px + 0.5 * phase.period_px) % phase.period_px - 0.5 * phase.period_px
    return u_px + moved, np.abs(moved)


def accept(
    u_px: Floats,
    finest: Phase,
    doubtful: Bools,
    phases: tuple[Phase, ...],
    *,
    width: int,
    max_sigma_px: float,
) -> Correspondence:
    """A correspondence with the finest phase's sigma; clipped, coarse, doubtful, outside is masked."""
    mask = ~doubtful & (finest.sigma_px <= max_sigma_px) & (u_px > -0.5) & (u_px < width - 0.5)
    for phase in phases:
        mask &= ~phase.clipped
    nan = np.float32(np.nan)
    return Correspondence(
        np.where(mask, u_px, nan).astype(np.float32), np.where(mask, finest.sigma_px, nan), mask
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
    for coarse, fine in pairwise(phases):
        u_px, moved = refine(u_px, fine)
        noise = np.hypot(coarse.sigma_px, fine.sigma_px)
        doubtful |= (z * noise > 0.5 * fine.period_px) | (moved > z * noise + 0.05 * fine.period_px)
    return accept(u_px, phases[-1], doubtful, phases, width=width, max_sigma_px=max_sigma_px)


def decode_beats(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    periods_px: tuple[float, float, float],
    steps: int,
    max_sigma_px: float,
    z: float = 4.0,
) -> Correspondence:
    """Beat of beats, then beat, then the finest period."""
    phases = phases_of(images, camera, periods_px=periods_px, steps=steps)
    first, second, third = phases
    near, far = _beat(first, second), _beat(second, third)
    longest = _beat(near, far)
    coarse, moved = refine(start(longest), near)
    doubtful = (z * longest.sigma_px > 0.5 * near.period_px) | (moved > z * longest.sigma_px + 1.0)
    u_px, moved = refine(coarse, first)
    doubtful |= (z * near.sigma_px > 0.5 * first.period_px) | (moved > z * near.sigma_px + 1.0)
    return accept(u_px, first, doubtful, phases, width=width, max_sigma_px=max_sigma_px)


def _beat(fine: Phase, coarse: Phase) -> Phase:
    """The difference of two phases, a phase of the beat's period."""
    period = 1.0 / (1.0 / fine.period_px - 1.0 / coarse.period_px)
    turns = fine.offset_px / fine.period_px - coarse.offset_px / coarse.period_px
    sigma = period * np.hypot(fine.sigma_px / fine.period_px, coarse.sigma_px / coarse.period_px)
    return Phase(
        ((turns % 1.0) * period).astype(np.float32),
        sigma.astype(np.float32),
        fine.amplitude_dn,
        fine.mean_dn,
        fine.clipped | coarse.clipped,
        float(period),
    )


def ladder(*, width: int, finest_px: float = 16.0, steps: int = 8, max_sigma_px: float = 0.4) -> Code:
    """Hierarchical multi-frequency phase shifting: each period a quarter of the one before."""
    periods = ladder_px(width=width, finest_px=finest_px)
    light, names = encode(width=width, periods_px=periods, steps=steps)
    read = partial(decode_ladder, width=width, periods_px=periods, steps=steps, max_sigma_px=max_sigma_px)
    return Code(light, names, read)


def heterodyne(*, width: int, finest_px: float = 16.0, steps: int = 8, max_sigma_px: float = 0.4) -> Code:
    """Three close periods, unwrapped by their beats."""
    periods = beats_px(width=width, finest_px=finest_px)
    light, names = encode(width=width, periods_px=periods, steps=steps)
    read = partial(decode_beats, width=width, periods_px=periods, steps=steps, max_sigma_px=max_sigma_px)
    return Code(light, names, read)
