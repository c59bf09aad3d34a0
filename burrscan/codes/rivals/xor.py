"""XOR codes: Gray code without wide stripes.

Every bit is combined with the finest one by exclusive or before it is shown, and again after it is read, so
that all patterns are of high frequency and interreflected light tells no bit (Gupta, Agrawal,
Veeraraghavan, Narasimhan 2011, logical codes).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.codes.code import Code
from burrscan.codes.gray import cells_of, gray_bits
from burrscan.codes.gray_phase import unwrap
from burrscan.codes.phase import decode_phase, encode_phase
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet


def encode_xor(*, width: int, cell_px: int) -> tuple[Floats, tuple[str, ...]]:
    """Light (2 bits, width) and names: each narrow bit, then its inverse."""
    bits = gray_bits(width=width, cell_px=cell_px)
    bits[:-1] ^= bits[-1]
    light = np.stack([bits, ~bits], axis=1).reshape(-1, width).astype(float)
    return light, tuple(f"xor-u-{i:02d}{tail}" for i in range(len(bits)) for tail in ("", "-inverse"))


def decode(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    period_px: int,
    max_sigma_px: float,
    doubtful_z: float = 3.0,
) -> Correspondence:
    """Cells from the bits, columns from the phase; a pixel with a doubtful bit is masked.

    At a border of the finest bit all bits change together, so that the footprints on it are lost.
    """
    bits = len(encode_xor(width=width, cell_px=period_px // 2)[1])
    on, off = images[0:bits:2].astype(float), images[1:bits:2].astype(float)
    noise = np.hypot(camera.noise_dn(on), camera.noise_dn(off))
    sure = np.abs(on - off) >= doubtful_z * noise
    shown = on > off
    phase = decode_phase(images[bits:], camera=camera, period_px=float(period_px))
    weights = 1 << np.arange(len(shown) - 1, -1, -1)
    gray = np.concatenate([shown[:-1] ^ shown[-1], shown[-1:]])
    cell = cells_of(np.tensordot(weights, gray, axes=1))
    u_px, agrees = unwrap(phase, cell.astype(np.int32), cell_px=period_px // 2)
    mask = agrees & sure.all(axis=0) & ~phase.clipped & (phase.sigma_px <= max_sigma_px)
    mask &= (u_px > -0.5) & (u_px < width - 0.5)
    nan = np.float32(np.nan)
    return Correspondence(
        np.where(mask, u_px, nan).astype(np.float32), np.where(mask, phase.sigma_px, nan), mask
    )


def xor_phase(*, width: int, period_px: int = 16, steps: int = 8, max_sigma_px: float = 0.4) -> Code:
    """XOR code with inverses to half the period, then ``steps`` sine frames."""
    bits, bit_names = encode_xor(width=width, cell_px=period_px // 2)
    sines, sine_names = encode_phase(width=width, period_px=float(period_px), steps=steps)
    read = partial(decode, width=width, period_px=period_px, max_sigma_px=max_sigma_px)
    return Code(np.concatenate([bits, sines]), bit_names + sine_names, read)
