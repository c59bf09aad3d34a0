"""Look until little is left to find: the loop of planning, moving, scanning and joining."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats
from burrscan.cell.belief import shifted
from burrscan.cell.choices import Arm, Choice, all_choices, arm_poses, outlooks, stand_of
from burrscan.cell.fusion import Fused, fused
from burrscan.cell.look import Look, of_several
from burrscan.cell.planners import METHODS
from burrscan.cell.planners.known import Known
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.station import Station, go
from burrscan.errors import InputError
from burrscan.inspection import Inspection
from burrscan.pipeline import Pipeline, run
from burrscan.registration.joint import PosePrior
from burrscan.variants import resolve

Planner = Callable[[Known], Sequence[int]]


@dataclass(frozen=True)
class Progress:
    """After a look.

    Parameters
    ----------
    looks
        So far.
    choices
        Where the scanner may stand: what a look's ``choice`` counts.
    fused
        What they say.
    coverage
        Share of the known part's area that some look has measured.
    left
        Probability that a burr is left where it could be seen.
    unseen
        Share of the known part's area that no pose of the arm shows.

    """

    looks: tuple[Look, ...]
    choices: tuple[Choice, ...]
    fused: Fused
    coverage: float
    left: float
    unseen: float


def look_around(
    station: Station,
    *,
    pipeline: Pipeline | None = None,
    planner: str = "expected",
    most: int = 8,
    enough: float = 0.02,
    burrs: float = 2.0,
    seed: int = 0,
) -> Iterator[Progress]:
    """Look at a part from all sides; each look's progress comes as it is made, the last one is the result.

    Parameters
    ----------
    station
        The cell.
    pipeline
        Which variant does what in each look.
    planner
        A short name of :data:`burrscan.cell.planners.METHODS`, or ``"module:function"``.
    most
        Looks at most.
    enough
        The looking ends when the probability that a burr is left is less, and no place is suspicious. A
        baseline that plans nothing (``ring``, ``random``) makes all its looks.
    burrs
        Expected number of burrs on a part before any look.
    seed
        For planners that draw.

    Raises
    ------
    InputError
        When no look shows a surface of revolution, or every pose is refused.

    """
    plan: Planner = resolve(planner, METHODS, stage="planner")
    mm, deg = station.lens_sigma
    prior = PosePrior(sigma_mm=mm, sigma_deg=deg)
    poses = arm_poses(station)
    choices = all_choices(poses)
    rng = np.random.default_rng(seed)
    looks: list[Look] = []
    after: Fused | None = None
    arms: tuple[Arm, ...] = ()
    while len(looks) < most:
        known = Known(
            station=station, choices=choices, taken=tuple(look.choice for look in looks), most=most,
            burrs=burrs, rng=rng,
            chart=after.chart if after else None, belief=after.belief if after else None, arms=arms,
        )  # fmt: skip
        looks.append(_look(station, plan(known), choices, poses, of_several(pipeline)))
        if all(look.outcome is None for look in looks):
            continue
        after = fused(looks, station.scanner.rig, prior=prior, burrs=burrs)
        arms = outlooks(
            after.chart,
            station.scanner.rig,
            station,
            poses,
            np.asarray(np.linalg.inv(after.T_part_plate), float),
        )
        progress = _progress(looks, after, arms, choices, burrs)
        yield progress
        settled = not (after.belief.suspicion.any() or after.belief.unfaced.any())
        if planner not in _TO_THE_END and progress.left < enough and settled:
            return
    if after is None:
        raise InputError(
            f"none of {len(looks)} looks shows a surface of revolution ({looks[-1].why}): is there a part on "
            "the table, and is the station's middle_mm right?"
        )


_TO_THE_END = frozenset({"ring", "random"})
"""Baselines that plan nothing: they stop at their number of looks."""


def inspection_of(progress: Progress) -> Inspection:
    """What all looks say of the part, in the frame of the plate as the arm knows it."""
    joint = progress.fused.joint
    sure = [place.burr for place in progress.fused.places if place.certain]
    return Inspection(
        axis=joint.axis,
        generatrix=joint.generatrix,
        burrs=tuple(sorted(sure, key=lambda burr: -burr.significance)),
        T_part_mesh=progress.fused.T_part_plate,
        deviation_mm=np.zeros(0),
    )


def _look(
    station: Station,
    ranked: Sequence[int],
    choices: Sequence[Choice],
    poses: Sequence[Floats],
    pipeline: Pipeline,
) -> Look:
    """Go to the first choice that the positioners take, and look.

    A pose of the arm that is refused is not tried again with another turn of the table: the part is round.
    """
    refused: dict[int, str] = {}
    for number in ranked:
        if choices[number].arm in refused:
            continue
        try:
            pose = go(station, stand_of(choices[number], poses))
        except OutOfReachError as error:
            refused[choices[number].arm] = str(error)
            continue
        try:
            return Look(number, pose, run(station.scanner, pipeline))
        except InputError as error:
            return Look(number, pose, None, str(error))
    raise InputError(
        f"the arm takes none of {len(refused)} poses ({next(iter(refused.values()), 'none is left')}): move "
        "the arm, the table or the standoff"
    )


def _progress(
    looks: Sequence[Look], after: Fused, arms: Sequence[Arm], choices: tuple[Choice, ...], burrs: float
) -> Progress:
    chart, belief = after.chart, after.belief
    shows = [arm.surface.seen & (belief.answer(arm.surface.tilt_deg) > _ANSWERS) for arm in arms]
    sights: Bools = np.any([shifted(shows[choice.arm], -choice.cells) for choice in choices], axis=0)
    area = np.broadcast_to(chart.area_mm2[:, None], chart.shape)
    return Progress(
        looks=tuple(looks),
        choices=choices,
        fused=after,
        coverage=float((area * (belief.left < _LOOKED)).sum() / area.sum()),
        left=belief.left_in(chart, burrs=burrs, sights=sights),
        unseen=float((area * ~sights).sum() / area.sum()),
    )


_ANSWERS = 0.2
"""A cell that is measured less often than this when it is in sight cannot be seen."""
_LOOKED = 0.5
"""A cell is covered where a burr would more likely have been found than not."""
