"""An image beside itself, to compare pixels with their neighbours."""

from __future__ import annotations

from typing import TypeVar

import numpy as np

from burrscan.arrays import Floats, Floats32

_Picture = TypeVar("_Picture", Floats, Floats32)


def shifted(image: _Picture, rows: int, columns: int) -> _Picture:
    """The image (h, w) as seen from (rows, columns) further on; NaN beyond the border."""
    height, width = image.shape
    moved = np.full_like(image, np.nan)
    y, x = max(rows, 0), max(columns, 0)
    cut = image[y : height + min(rows, 0), x : width + min(columns, 0)]
    moved[max(-rows, 0) : height - y, max(-columns, 0) : width - x] = cut
    return moved
