"""What the camera sees, for the page: its pictures with a screen's gamma, and its direction of view."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.plotting.pictures import brightened, window
from bench.reproduction.parts import number
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Levels

OPPOSITE = np.diag([1.0, -1.0, -1.0])
"""(3, 3) rows right, up, towards the viewer: a camera frame seen from the camera."""


def seen_photo(image: NDArray[Any], scan: Scanned) -> Levels:
    """A camera picture (h, w), cut to the part and as bright as a screen shows it."""
    full = number(scan.arrays, "full_dn")
    levels = np.round(np.clip(image / full, 0.0, 1.0) * 255.0).astype(np.uint8)
    return brightened(levels[window({"measurable": scan.arrays["measurable"]})])
