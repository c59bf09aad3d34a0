"""Whether an alignment is a result, and what of it the surfaces do not say."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.csgraph import connected_components

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.registration.alignment import Alignment, Free, Pairs
from burrscan.robust import SIGMA_PER_MEDIAN

_FEWEST = 60
"""Points compared between two views: ten for each unknown of a pose."""
_LEFT = 0.25
"""A motion is free while the surfaces take less than three quarters off its variance, half of its sigma."""
_NOISE_TIMES = 3.0
"""Distances beyond this many times the noise of single points are no noise, nor the lens's errors."""
_PITCH_SHARE = 0.05
"""Of the pitch: what nearest points of a curved surface are apart without noise, at most."""
_GROWN = 1.1
"""Times the distance at the rough poses, besides noise."""
_STEP = 0.3
"""Last step in standard deviations of the poses, beyond which it was not the last one."""
_FAR = 5.0
"""Standard deviations that a pose may be off its rough one; 6 unknowns are within 5.0 by 0.9997."""


class Findings(NamedTuple):
    """What a judgement needs.

    Parameters
    ----------
    pairs
        What was compared last.
    noise_mm
        (N,) of single points.
    pitch_mm
        Of the points compared.
    before_mm, after_mm
        Median distance at the rough and at the final poses, within the same gate.
    step
        The last one in standard deviations per unknown.
    off
        (N,) how far each pose is from its rough one, in standard deviations.
    iterations
        Of the search.

    """

    pairs: Sequence[Pairs]
    noise_mm: Floats
    pitch_mm: float
    before_mm: float
    after_mm: float
    step: float
    off: Floats
    iterations: int


def doubts(found: Findings) -> tuple[str, ...]:
    """Why an alignment is no result, one sentence each that says what to do."""
    sentences = [*_apart(found), *_disagree(found), *_grown(found)]
    if found.step > _STEP:
        sentences.append(
            f"the poses still move by {found.step:.1g} of their standard deviations after {found.iterations} "
            "steps: give better rough poses"
        )
    far = (
        f"view {number + 1} ended {found.off[number]:.0f} standard deviations from its rough pose: check "
        "that pose, or state a larger sigma_mm and sigma_deg"
        for number in np.flatnonzero(found.off > _FAR)
    )
    return (*sentences, *far)


def refuse_doubtful(found: Alignment) -> None:
    """Refuse an alignment that its own data do not support.

    Raises
    ------
    InputError
        With its doubts.

    """
    if found.doubts:
        raise InputError(f"no alignment: {'; '.join(found.doubts)}")


def free_motions(covariance: Floats, alone: Floats, middle_mm: Floats, reach_mm: float) -> tuple[Free, ...]:
    """The motions (of one view against the first) that the rough poses decide.

    Parameters
    ----------
    covariance, alone
        (6, 6) of rotation vector and translation at ``middle_mm``, with the surfaces and without them.
    middle_mm
        (3,) where the translation is stated.
    reach_mm
        Half the size of the part: a turn that shifts its middle by more is called a shift.

    """
    share, motions = eigh(covariance, alone)
    found = []
    for ratio, motion in zip(share, motions.T, strict=True):
        if ratio > _LEFT:
            twist = alone @ motion  # one standard deviation of the rough poses along that motion
            found.append(_named(twist * float(np.sqrt(ratio)), middle_mm, reach_mm))
    return tuple(found)


def _named(twist: Floats, middle_mm: Floats, reach_mm: float) -> Free:
    turn, shift = twist[:3], twist[3:]
    angle = float(np.linalg.norm(turn))
    if angle * reach_mm < float(np.linalg.norm(shift - turn * (turn @ shift) / max(angle**2, 1e-300))):
        size = float(np.linalg.norm(shift))
        return Free("shift", middle_mm, _upwards(shift / size), size)
    point = middle_mm + np.cross(turn, shift) / angle**2
    return Free("turn", point, _upwards(turn / angle), float(np.degrees(angle)))


def _upwards(direction: Floats) -> Floats:
    """Of the two senses of a line the one whose largest part is positive."""
    return direction if direction[np.argmax(np.abs(direction))] > 0.0 else -direction


def _apart(found: Findings) -> list[str]:
    count = len(found.noise_mm)
    compared = np.zeros((count, count))
    for pair in found.pairs:
        compared[pair.moving, pair.fixed] += len(pair.samples)
    compared = compared + compared.T
    parts, label = connected_components(compared >= _FEWEST)
    if parts == 1:
        return []
    alone = [str(number + 1) for number in np.flatnonzero(label != np.bincount(label).argmax())]
    most = int(compared[np.ix_(label != label[0], label == label[0])].max(initial=0.0))
    words = (
        f"view {', '.join(alone)} shares hardly any surface with the others ({most} points compared, "
        f"at least {_FEWEST} are needed): take views that overlap by a third, or give rough poses that bring "
        "them together"
    )
    return [words]


def _disagree(found: Findings) -> list[str]:
    limit = _NOISE_TIMES * float(found.noise_mm.max()) + _PITCH_SHARE * found.pitch_mm
    if not SIGMA_PER_MEDIAN * found.after_mm > limit:
        return []
    words = (
        f"the views are {SIGMA_PER_MEDIAN * found.after_mm:.3g} mm apart where they overlap, and noise "
        f"explains {limit:.2g} mm: check that they show the same part, unmoved, and their rough poses"
    )
    return [words]


def _grown(found: Findings) -> list[str]:
    limit = _GROWN * found.before_mm + float(found.noise_mm.max())
    if not found.after_mm > limit:
        return []
    words = (
        f"the distance between the views grew from {found.before_mm:.3g} to {found.after_mm:.3g} mm: give "
        "better rough poses, or views that overlap more"
    )
    return [words]
