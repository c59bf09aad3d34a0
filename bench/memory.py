"""Freed memory is kept for the next array instead of being handed back to the system.

The stages make and drop arrays of 1 to 100 MB by the hundred. glibc has each of them from the system page by
page and zeroed (mallopt(3), M_MMAP_THRESHOLD), which takes an eighth of the time from mesh to burrs.
"""

from __future__ import annotations

import ctypes
import sys
from contextlib import suppress

KEPT_BYTES = 256 << 20
"""Larger arrays than this come from the system, and more than this of free memory goes back to it."""
_M_TRIM_THRESHOLD, _M_MMAP_THRESHOLD = -1, -3
"""Their numbers in glibc's malloc.h."""


def keep_freed() -> None:
    """Ask this process's allocator to; another C library than glibc is left as it is."""
    if not sys.platform.startswith("linux"):
        return
    with suppress(OSError, AttributeError):  # musl has no mallopt
        allocator = ctypes.CDLL(None)
        allocator.mallopt(_M_MMAP_THRESHOLD, KEPT_BYTES)
        allocator.mallopt(_M_TRIM_THRESHOLD, KEPT_BYTES)
