"""How the loops over points are compiled: cached, one thread, no checks for division by zero."""

from __future__ import annotations

from typing import Any

from numba import njit

kernel: Any = njit(cache=True, nogil=True, error_model="numpy")
"""Decorator. Nothing is reordered or fused: a kernel gives the same bits when it is inlined into another and
when it is called, and which of them happens depends on what numba's cache holds."""
