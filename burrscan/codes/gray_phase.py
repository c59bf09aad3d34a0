"""Gray code and N-step phase shift: the classical combination.

The Gray code's cells are half a stripe period wide: a cell misread by one at its border then still names the
right period (Sansoni, Carocci, Rodella 1999 discuss the border; half cells are the usual remedy).
"""

from __future__ import annotations

from functools import partial

import numpy as np

from burrscan.arrays import Bools, Floats, Image, Ints32
from burrscan.codes.code import Code
from burrscan.codes.gray import decode_gray, encode_gray
from burrscan.codes.phase import Phase, decode_phase, encode_phase
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet


def decode(
    images: Image,
    camera: CameraSheet,
    *,
    width: int,
    period_px: int,
    max_sigma_px: float,
    mask_clipped: bool = True,
) -> Correspondence:
    """Columns from Gray cells and the phase within; doubt of any kind masks the pixel.

    A pixel is accepted when no step is clipped (unless ``mask_clipped`` is False), its sigma is at most
    ``max_sigma_px``, at most one Gray bit is doubtful and flipping it changes nothing, and cell and phase
    agree to within a quarter period.
    """
    bits = len(encode_gray(width=width, cell_px=period_px // 2)[1])
    phase = decode_phase(images[bits:], camera=camera, period_px=float(period_px))
    cell, other = decode_gray(images[:bits], camera=camera)
    u_px, agrees = unwrap(phase, cell, cell_px=period_px // 2)
    u_other, _ = unwrap(phase, other, cell_px=period_px // 2)
    mask = agrees & (other >= 0) & (u_px == u_other) & (phase.sigma_px <= max_sigma_px)
    if mask_clipped:
        mask &= ~phase.clipped
    mask &= (u_px > -0.5) & (u_px < width - 0.5)
    return Correspondence(
        np.where(mask, u_px, np.nan).astype(np.float32),
        np.where(mask, phase.sigma_px, np.float32(np.nan)),
        mask,
    )


def unwrap(phase: Phase, cell: Ints32, *, cell_px: int) -> tuple[Floats, Bools]:
    """The column with this phase nearest to the cell's middle, and whether it lies within half a cell of it.

    Half a cell more is allowed on either side: at a border the neighbouring cell is a right answer.
    """
    middle = cell * cell_px + 0.5 * (cell_px - 1)
    wraps = np.rint((middle - phase.offset_px) / phase.period_px)
    u_px = phase.offset_px + wraps * phase.period_px
    return u_px, np.abs(u_px - middle) <= 0.75 * cell_px


def gray_phase(
    *,
    width: int,
    period_px: int = 16,
    steps: int = 8,
    max_sigma_px: float = 0.4,
    mask_clipped: bool = True,
) -> Code:
    """Gray code with inverses to half the period, then ``steps`` sine frames."""
    bits, bit_names = encode_gray(width=width, cell_px=period_px // 2)
    sines, sine_names = encode_phase(width=width, period_px=float(period_px), steps=steps)
    read = partial(
        decode, width=width, period_px=period_px, max_sigma_px=max_sigma_px, mask_clipped=mask_clipped
    )
    return Code(np.concatenate([bits, sines]), bit_names + sine_names, read)
