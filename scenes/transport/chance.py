"""Random numbers of light paths that depend on the path's number, the seed and what they are for, no more.

A sequential generator's state would have to travel with every path; these are ``sample_tea_float32`` of
Mitsuba (Zafar et al. 2010, "GPU random numbers via the tiny encryption algorithm") of two words, which lets
the paths that go on be gathered together, and gives the same numbers in passes of any size.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr

_KINDS = 64
"""Numbers that one path may ask for."""


class Chance(NamedTuple):
    """Numbers of some paths: ``number`` names each (UInt32), ``seed`` the tracing (UInt32)."""

    number: Any
    seed: Any

    def one(self, mi: Any, kind: int) -> Any:
        """Number ``kind`` of each path, uniform on [0, 1)."""
        return mi.sample_tea_float32(self.number, self.seed * _KINDS + kind)

    def two(self, mi: Any, kind: int) -> Any:
        """Numbers ``kind`` and ``kind + 1`` of each path, uniform on the unit square."""
        return mi.Point2f(self.one(mi, kind), self.one(mi, kind + 1))

    def of(self, mi: Any, kept: Any) -> Chance:
        """Those of the paths at places ``kept``."""
        return Chance(dr.gather(mi.UInt32, self.number, kept), self.seed)
