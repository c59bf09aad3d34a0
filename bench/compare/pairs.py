"""Pairing: which record of one arm belongs to which of the other, and what cannot be compared."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.run.directory import Run
from bench.run.records import Record
from burrscan.arrays import Floats, Ints
from burrscan.errors import InputError
from burrscan.variants import suggest


@dataclass(frozen=True)
class Arm:
    """One side of a comparison: a variant of a run.

    Parameters
    ----------
    label
        How tables call it.
    variant
        The variant.
    records
        One per case.
    metrics
        The run's metric definitions, with their versions.

    """

    label: str
    variant: str
    records: tuple[Record, ...]
    metrics: Mapping[str, Mapping[str, Any]]


@dataclass(frozen=True)
class Pairing:
    """Two arms laid side by side, case by case.

    Parameters
    ----------
    base, new
        Records of the cases that can be compared, in the same order.
    scene
        (N,) number of the scene of each pair: cases whose scenes have one hash share it.
    changed
        Cases whose scene is another one (its hash differs): not comparable.
    only_base, only_new
        Cases that one arm lacks.
    same_noise
        Whether every pair saw the same noise as well, so that the code alone makes the difference.

    """

    base: tuple[Record, ...]
    new: tuple[Record, ...]
    scene: Ints
    changed: tuple[str, ...]
    only_base: tuple[str, ...]
    only_new: tuple[str, ...]
    same_noise: bool

    @property
    def scenes(self) -> int:
        """How many scenes."""
        return len(np.unique(self.scene))

    def per_scene(self, values: Floats) -> Floats:
        """Mean over each scene's cases of a value per pair (N,); NaN and scenes of nothing else left out."""
        means = [values[(self.scene == k) & ~np.isnan(values)] for k in np.unique(self.scene)]
        return np.array([m.mean() for m in means if len(m)])


def arm_of(run: Run, variant: str, label: str) -> Arm:
    """An arm.

    Raises
    ------
    burrscan.errors.InputError
        When the run has no such variant.

    """
    names = [v.name for v in run.suite.variant]
    if variant not in names:
        raise InputError(f"{run.directory.path}: no variant '{variant}': {suggest(variant, names)}")
    records = tuple(record for record in run.records if record.variant == variant)
    return Arm(label, variant, records, run.manifest["metrics"])


def pair(base: Arm, new: Arm) -> Pairing:
    """Pair by case.

    Raises
    ------
    burrscan.errors.InputError
        When the arms have no case in common.

    """
    ours, theirs = ({record.case: record for record in arm.records} for arm in (base, new))
    common = [case for case in ours if case in theirs]
    if not common:
        raise InputError(
            f"nothing to compare: {base.label} and {new.label} have no case in common (different suites?)"
        )
    changed = [case for case in common if ours[case].scene_hash != theirs[case].scene_hash]
    kept = [case for case in common if case not in set(changed)]
    left, right = tuple(ours[case] for case in kept), tuple(theirs[case] for case in kept)
    return Pairing(
        left,
        right,
        _scenes(left),
        tuple(changed),
        tuple(case for case in ours if case not in theirs),
        tuple(case for case in theirs if case not in ours),
        all(a.identity == b.identity for a, b in zip(left, right, strict=True)),
    )


def _scenes(records: Sequence[Record]) -> Ints:
    """Scene numbers: cases whose scenes have one hash looked at one scene, with other noise.

    Cases that differ in the seed alone are scenes of their own where the seed draws the pose or the burrs.
    Where there is one scene only, all that is left are its seeds.
    """
    keys = [record.scene_hash for record in records]
    if len(set(keys)) == 1:
        keys = [record.case for record in records]
    return _numbered(keys)


def _numbered(keys: Iterable[str]) -> Ints:
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(key, len(numbers)) for key in keys], dtype=np.int64)
