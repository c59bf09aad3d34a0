"""Reflected binary (Gray) code with inverses.

Each bit is shown and then its negative, so that a camera pixel decides by comparing two of its own values:
no threshold, no even light needed (Inokuchi, Sato, Matsuda 1984; inverses: Trobina 1995).
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numba import njit, prange

from burrscan.arrays import Bools, Floats, Floats32, Image, Ints, Ints32
from burrscan.codes.code import Code
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet


def bits_for(*, width: int, cell_px: int) -> int:
    """How many bits tell the cells of ``cell_px`` columns apart."""
    return max(1, int(np.ceil(np.log2(np.ceil(width / cell_px)))))


def gray_bits(*, width: int, cell_px: int) -> Bools:
    """(bits, width) the Gray code of each column's cell, the most significant bit first."""
    cells = np.arange(width) // cell_px
    code = cells ^ (cells >> 1)
    bits = bits_for(width=width, cell_px=cell_px)
    return np.asarray((code >> np.arange(bits - 1, -1, -1)[:, None]) & 1, bool)


def encode_gray(*, width: int, cell_px: int) -> tuple[Floats, tuple[str, ...]]:
    """Light (2 bits, width) and names: each bit, then its inverse. O(width log width)."""
    bits = gray_bits(width=width, cell_px=cell_px)
    light = np.stack([bits, ~bits], axis=1).reshape(-1, width).astype(float)
    names = tuple(f"gray-u-{i:02d}{tail}" for i in range(len(bits)) for tail in ("", "-inverse"))
    return light, names


def decode_gray(images: Image, *, camera: CameraSheet, doubtful_z: float = 3.0) -> tuple[Ints32, Ints32]:
    """Cells from images of bits and inverses.

    Parameters
    ----------
    images
        (2 bits, h, w) DN, in the order of :func:`encode_gray`.
    camera
        Gives the noise of a difference.
    doubtful_z
        A bit whose difference is within this many standard deviations of zero is doubtful.

    Returns
    -------
    cell, other
        (h, w) the decoded cell, and the cell that results if the one doubtful bit is flipped: equal to
        ``cell`` where no bit is doubtful, -1 where more than one is. At the border between two cells one
        bit is bound to be doubtful, and either answer is right.

    """
    cell, other = _cells(
        images,
        camera.black_level_dn,
        camera.gain_dn_per_e,
        (camera.gain_dn_per_e * camera.read_noise_e) ** 2 + 1.0 / 12.0,
        doubtful_z * doubtful_z,
    )
    return cell, other


def cells_of(code: Ints) -> Ints:
    """Plain numbers of Gray code words."""
    number = code.copy()
    shift = code >> 1
    while shift.any():
        number ^= shift
        shift >>= 1
    return number


@njit(cache=True, nogil=True)
def _plain(code: int, bits: int) -> int:
    """The number behind a Gray code."""
    shift = 1
    while shift < bits:
        code ^= code >> shift
        shift *= 2
    return code


@njit(cache=True, parallel=True, nogil=True)
def _cells(
    images: Image, black: float, gain: float, floor: float, doubtful_z2: float
) -> tuple[Ints32, Ints32]:
    bits, height, width = images.shape[0] // 2, images.shape[1], images.shape[2]
    cell = np.empty((height, width), np.int32)
    other = np.empty((height, width), np.int32)
    for r in prange(height):
        for c in range(width):
            code, flip, doubts = 0, 0, 0
            for b in range(bits):
                on, off = float(images[2 * b, r, c]), float(images[2 * b + 1, r, c])
                code = 2 * code + (1 if on > off else 0)
                variance = gain * (max(on - black, 0.0) + max(off - black, 0.0)) + 2.0 * floor
                doubtful = (on - off) ** 2 < doubtful_z2 * variance
                doubts += doubtful
                flip = 1 << (bits - 1 - b) if doubtful else flip
            cell[r, c] = _plain(code, bits)
            other[r, c] = _plain(code ^ flip, bits) if doubts <= 1 else -1
    return cell, other


def decode(
    images: Image, camera: CameraSheet, *, width: int, cell_px: int, doubtful_z: float = 3.0
) -> Correspondence:
    """The middle of each pixel's cell; sigma is that of an even spread over the cell."""
    cell, other = decode_gray(images, camera=camera, doubtful_z=doubtful_z)
    mask = (np.abs(cell - other) <= 1) & (other >= 0) & (cell * cell_px < width)
    u_px = np.where(mask, (cell + other) * (0.5 * cell_px) + 0.5 * (cell_px - 1), np.nan)
    return Correspondence(u_px.astype(np.float32), _spread(mask, cell_px), mask)


def _spread(mask: Bools, cell_px: int) -> Floats32:
    return np.where(mask, cell_px / np.sqrt(12.0), np.nan).astype(np.float32)


def gray(*, width: int, cell_px: int = 1) -> Code:
    """Gray code with inverses down to cells of ``cell_px`` columns."""
    light, names = encode_gray(width=width, cell_px=cell_px)
    return Code(light, names, partial(decode, width=width, cell_px=cell_px))
