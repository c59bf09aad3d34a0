"""Random streams: one per source of randomness, spawned from a case's identity.

Values come from a counter: the n-th value of a stream is a hash of (key, n), so any thread can make any value
and the bits do not depend on how the work was split. The hash is the output function of SplitMix64 (Steele,
Lea & Flood 2014).
"""

from __future__ import annotations

import math
import zlib

import numba as nb
import numpy as np

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
"""2^64 over the golden ratio, odd: SplitMix64's increment."""
_MIX1 = np.uint64(0xBF58476D1CE4E5B9)
"""First multiplier of SplitMix64's output function."""
_MIX2 = np.uint64(0x94D049BB133111EB)
"""Second multiplier of SplitMix64's output function."""


def stream_key(identity: tuple[int, ...], source: str) -> np.uint64:
    """The key of the stream of ``source`` in the case ``identity``."""
    sequence = np.random.SeedSequence(identity, spawn_key=(zlib.crc32(source.encode()),))
    key: np.uint64 = sequence.generate_state(1, np.uint64)[0]
    return key


@nb.njit(cache=True, inline="always")
def uniform(key: np.uint64, counter: np.uint64) -> float:
    """The value of stream ``key`` at ``counter``, uniform on (0, 1)."""
    z = key + (counter + np.uint64(1)) * _GOLDEN
    z = (z ^ (z >> np.uint64(30))) * _MIX1
    z = (z ^ (z >> np.uint64(27))) * _MIX2
    z = z ^ (z >> np.uint64(31))
    return (float(z >> np.uint64(11)) + 0.5) * (1.0 / 9007199254740992.0)


@nb.njit(cache=True, inline="always")
def normal_pair(key: np.uint64, counter: np.uint64) -> tuple[float, float]:
    """Two independent standard normal values (Box & Muller 1958)."""
    radius = math.sqrt(-2.0 * math.log(uniform(key, np.uint64(2) * counter)))
    angle = 2.0 * math.pi * uniform(key, np.uint64(2) * counter + np.uint64(1))
    return radius * math.cos(angle), radius * math.sin(angle)
