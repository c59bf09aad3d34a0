"""How the loops over points are compiled: cached, one thread, no checks for division by zero."""

from __future__ import annotations

from typing import Any

from numba import njit

kernel: Any = njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz"})
"""Decorator. NaN and infinity keep their meaning; products may be fused; order of sums stays."""

summing: Any = njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz", "reassoc"}
)
"""The same for loops of few sums: each runs in several lanes, whose order is fixed when compiled."""
