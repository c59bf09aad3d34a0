"""Plain binary code with inverses: the ancestor of the Gray code (Posdamer & Altschuler 1982).

Its border between the middle cells flips every bit at once, so that a blurred edge can name any column;
doubtful bits therefore mask more pixels than Gray's do.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from burrscan.arrays import Image
from burrscan.codes.code import Code
from burrscan.codes.gray import bits_for
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet


def decode(
    images: Image, camera: CameraSheet, *, width: int, cell_px: int, doubtful_z: float = 3.0
) -> Correspondence:
    """The middle of the cell whose bits, each compared with its inverse, are all beyond doubt."""
    on, off = images[0::2].astype(float), images[1::2].astype(float)
    noise = np.hypot(camera.noise_dn(on), camera.noise_dn(off))
    sure = np.all(np.abs(on - off) >= doubtful_z * noise, axis=0)
    weights = 1 << np.arange(len(on) - 1, -1, -1)
    cell = np.tensordot(weights, on > off, axes=1)
    mask = sure & (cell * cell_px < width)
    u_px = np.where(mask, cell * cell_px + 0.5 * (cell_px - 1), np.nan)
    sigma = np.where(mask, cell_px / np.sqrt(12.0), np.nan)
    return Correspondence(u_px.astype(np.float32), sigma.astype(np.float32), mask)


def binary(*, width: int, cell_px: int = 1) -> Code:
    """Binary code with inverses down to cells of ``cell_px`` columns."""
    cells = np.arange(width) // cell_px
    count = bits_for(width=width, cell_px=cell_px)
    bits = (cells >> np.arange(count - 1, -1, -1)[:, None]) & 1
    light = np.stack([bits, 1 - bits], axis=1).reshape(-1, width).astype(float)
    names = tuple(f"binary-u-{i:02d}{tail}" for i in range(count) for tail in ("", "-inverse"))
    return Code(light, names, partial(decode, width=width, cell_px=cell_px))
