"""Modulated phase shifting: long stripes carried by a fine one.

A long period is hidden in the amplitude of a fine carrier; shifting the carrier and demodulating leaves only
light that followed the fine stripes, hence came directly (Chen, Seidel, Lensch 2008). The long period then
tells the stripe of a fine phase shift.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.codes.code import Code
from burrscan.codes.phase import Phase, decode_phase, encode_phase
from burrscan.codes.rivals.multifrequency import longest_px, start
from burrscan.codes.unwrapping import accept, refine
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet

_CARRIER_STEPS = 4
"""Shifts of the carrier: four leave its amplitude free of a second harmonic."""
_LONG_STEPS = 3
"""Shifts of the long sine: the fewest that tell mean, amplitude and phase."""


def encode_modulated(*, width: int, long_px: float, carrier_px: float) -> tuple[Floats, tuple[str, ...]]:
    """Light (12, width): three shifts of the long sine, each carried by four shifts of the carrier."""
    u = np.arange(width)
    long = [0.5 + 0.5 * np.cos(2.0 * np.pi * (u / long_px - n / _LONG_STEPS)) for n in range(_LONG_STEPS)]
    carrier, _ = encode_phase(width=width, period_px=carrier_px, steps=_CARRIER_STEPS)
    light = np.concatenate([0.5 + envelope * (carrier - 0.5) for envelope in long])
    shifts = range(_LONG_STEPS)
    names = tuple(
        f"modulated-u-{long_px:.4g}px-{n}-carrier-{m}" for n in shifts for m in range(_CARRIER_STEPS)
    )
    return light, names


def decode_modulated(images: Image, camera: CameraSheet, *, long_px: float, carrier_px: float) -> Phase:
    """The long period's phase from the carrier's amplitude in each of its shifts.

    An amplitude's noise is that of a phasor's length; near the sine's dark end, where length and noise are
    alike, the length is biased by at most the noise.
    """
    blocks = images.reshape(_LONG_STEPS, _CARRIER_STEPS, *images.shape[1:])
    carriers = [decode_phase(block, camera=camera, period_px=carrier_px) for block in blocks]
    lengths = np.stack([c.amplitude_dn.astype(float) for c in carriers])
    turns = 2.0 * np.pi * np.arange(_LONG_STEPS)[:, None, None] / _LONG_STEPS
    a, b = (lengths * np.cos(turns)).sum(axis=0), (lengths * np.sin(turns)).sum(axis=0)
    mean = camera.noise_dn(np.stack([c.mean_dn.astype(float) for c in carriers]).mean(axis=0))
    length_noise = mean * np.sqrt(2.0 / _CARRIER_STEPS)
    with np.errstate(divide="ignore"):
        sigma = length_noise * np.sqrt(0.5 * _LONG_STEPS) / np.hypot(a, b)
    per_rad = long_px / (2.0 * np.pi)
    return Phase(
        ((np.arctan2(b, a) % (2.0 * np.pi)) * per_rad).astype(np.float32),
        (sigma * per_rad).astype(np.float32),
        np.hypot(a, b).astype(np.float32),
        carriers[0].mean_dn,
        np.logical_or.reduce([c.clipped for c in carriers]),
        long_px,
    )


def decode(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    periods: tuple[float, float, float],
    carrier_px: float,
    steps: int,
    max_sigma_px: float,
    z: float = 4.0,
) -> Correspondence:
    """Two modulated periods, then the fine one; doubtful where noise could name the wrong stripe."""
    count = _LONG_STEPS * _CARRIER_STEPS
    long, middle = (
        decode_modulated(
            images[i * count : (i + 1) * count], camera, long_px=periods[i], carrier_px=carrier_px
        )
        for i in (0, 1)
    )
    fine = decode_phase(images[2 * count : 2 * count + steps], camera=camera, period_px=periods[2])
    u_px = start(long)
    doubtful = np.zeros(u_px.shape, bool)
    for coarse, finer in ((long, middle), (middle, fine)):
        u_px, moved = refine(u_px, finer)
        noise = np.hypot(coarse.sigma_px, finer.sigma_px)
        doubtful |= (z * noise > 0.5 * finer.period_px) | (moved > z * noise + 0.1 * finer.period_px)
    return accept(u_px, fine, doubtful, (long, middle, fine), width=width, max_sigma_px=max_sigma_px)


def modulated(
    *,
    width: int,
    finest_px: float = 16.0,
    carrier_px: float = 8.0,
    steps: int = 8,
    max_sigma_px: float = 0.4,
) -> Code:
    """The whole width and its geometric mean with ``finest_px``, both carried, then ``steps`` fine frames."""
    longest = longest_px(width=width)
    periods = (longest, float(np.sqrt(longest * finest_px)), finest_px)
    parts = [encode_modulated(width=width, long_px=period, carrier_px=carrier_px) for period in periods[:2]]
    parts.append(encode_phase(width=width, period_px=finest_px, steps=steps))
    read = partial(
        decode, width=width, periods=periods, carrier_px=carrier_px, steps=steps, max_sigma_px=max_sigma_px
    )
    return Code(np.concatenate([p for p, _ in parts]), tuple(n for _, ns in parts for n in ns), read)
