"""How the loops over points are compiled: cached, one thread, no checks for division by zero."""

from __future__ import annotations

from typing import Any

from numba import njit

kernel: Any = njit(cache=True, nogil=True, error_model="numpy")
"""Decorator. Nothing is reordered or fused: a kernel gives the same bits when it is inlined into another and
when it is called, and which of them happens depends on what numba's cache holds."""

summing: Any = njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"contract", "arcp", "nsz", "reassoc"}
)
"""The same for loops of few sums: each runs in several lanes, whose order is fixed when compiled. For kernels
that neither call others nor are called by them: these are compiled in one way only."""
