"""The case as a type."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Case:
    """One scene to be scanned by every variant.

    Parameters
    ----------
    id
        Stable and readable, also a directory's name, such as ``finish=polished,burr.height_mm=1,seed=0``.
    parameters
        What distinguishes the case, as shown to people: swept paths and the seed.
    seed
        The suite's seed.
    document
        The scene as plain tables, sweep and jitter laid in.
    scene_hash
        Hash of the scene they make: two records are comparable only where it is equal.
    identity
        Content hash of (scene before jitter, seed, the run's seed), from which every random stream of the
        case is spawned.

    """

    id: str
    parameters: Mapping[str, Any]
    seed: int
    document: Mapping[str, Any]
    scene_hash: str
    identity: str
