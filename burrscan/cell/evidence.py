"""Burrs called in several looks, joined before anything is decided."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats, Ints
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.belief import SURE
from burrscan.cell.chart import Chart, line_of, walked
from burrscan.inspection import Axis, Burr, Value, side_of

NOISE = 0.16, 0.7
"""Calls per look that are no burr, and that no other look confirms: with the baseline along their line, and
across it. Of 216 rendered looks (27 cells of three wheels) 35 and 149, beside 421 and 47 of burrs: inside the
plane of the rays what the part mirrors passes for height."""
BLEMISHES = 0.026
"""And those on blemishes, which other looks confirm: 3 on 120 wheels of the suite ``standard``."""
LEAST, CLEAR = 3.9, 20.5
"""Significance from which on anything is called, and by how much burrs exceed it, in the mean: 734 calls in
42 rendered cells."""
_FAINT, _MIRRORED = (2.3, 4.3), (0.07, 0.25)
"""By how much noise exceeds it, with the baseline along its line and across it, but for a share that is as
clear as burrs are: 47 and 208 calls. Of 139 more on 18 wheels drawn later the medians are 5.1 and 8.0 (6.1
and 8.4 before)."""
_SAME_MM = 3.0
"""Calls of one burr lie this near each other across it: more than the robot's word leaves open."""
_LITTLE = 0.3
"""A look that would have found a burr there with less probability says nothing by its silence."""
_SIDE_RIGHT = 0.99, 0.95
"""Share of calls in one look whose side is right: where it faces the burr (191 of 192 rendered ones), and
from aside (227 of 239)."""
_SIZED_DEG = 60.0
"""Up to here from aside a look tells a size too, beside one that faces the burr: it sees less of one flank,
but where both mirror the part from in front (one of 1.4 mm read 0.5 to 0.8), not from there (1.2 to 1.4)."""
UNFACED = 0.1
"""Worth, in burrs, of facing one that is called and was seen from aside only: its size, often its side."""
_UNSURE = 2.0
"""Standard deviations of where they are, within which two bases may overlap: 95 % of those that do."""
_ROUNDS, _AGREED = 50, 1e-4
"""Of the rates of noise and the probabilities that follow from each other: done when these change by less."""
_CERTAIN = 0.5
"""A burr is called from this probability on."""
_SUSPICIOUS = (0.02, 0.95)
"""Between these a place is worth another look."""


@dataclass(frozen=True)
class Call:
    """A burr called in one look.

    Parameters
    ----------
    look
        Which.
    burr
        As it was called.
    T_plate_burr
        (4, 4) its pose over the plate.
    aside_deg
        Angle between the surface's normal there and the camera, as it lies across the burr's line.
    faced
        Whether the look faced it (:func:`burrscan.cell.outlook.facing`).
    along
        Whether the baseline lies along it rather than across.
    bare
        Looks that measured bare metal under it (:func:`burrscan.cell.flatness.bare`).

    """

    look: int
    burr: Burr
    T_plate_burr: Floats
    aside_deg: float
    faced: bool
    along: bool
    bare: frozenset[int] = frozenset()


@dataclass(frozen=True)
class Place:
    """Calls of one place, and what they come to.

    Parameters
    ----------
    calls
        One or more, of different looks mostly.
    chances
        (n,) per look of the cell the probability that it would have found a burr there.
    probability
        That a burr is there.
    burr
        Joined, in the frame of the plate, its angle and extent in the part's.

    """

    calls: tuple[Call, ...]
    chances: Floats
    probability: float
    burr: Burr

    @property
    def certain(self) -> bool:
        """Whether it is called: on the word of one look from aside alone only where that settles it.

        And with the baseline along the burr: what is mirrored across it is as clear as a burr.
        """
        if self.faced or len(self.calls) > 1:
            return self.probability >= _CERTAIN
        return self.calls[0].along and self.probability >= _SUSPICIOUS[1]

    @property
    def faced(self) -> bool:
        """Whether a look that called it saw it from a direction that tells sizes and sides."""
        return any(call.faced for call in self.calls)

    @property
    def suspicion(self) -> float:
        """What another look at its flanks is worth, in burrs; 0 where the place is settled."""
        low, high = _SUSPICIOUS
        return self.probability * (1.0 - self.probability) if low < self.probability < high else 0.0

    @property
    def unfaced(self) -> float:
        """What a look that faces it is worth, in burrs; 0 where there was one.

        Of a place that is not called yet it is the burr itself, else its size.
        """
        if self.faced:
            return 0.0
        return self.probability * (UNFACED if self.certain else 1.0)


def joined(
    calls: Sequence[Call],
    *,
    axis: Axis,
    chart: Chart,
    chances: Floats,
    burrs: float,
) -> tuple[Place, ...]:
    """Calls of all looks by place, with the probability that a burr is there.

    A real burr is called in each look that would have found it, and one that measured bare metal under it
    would have; a false call comes of noise, and is called in one look, or of a blemish, and is called from
    some sides. The odds are those of the two rates. Noise comes in bunches, where a look meets the part at a
    bad angle: a look with many calls that no other confirms is believed less, see :func:`_probabilities`.

    Parameters
    ----------
    calls
        Of every look, their poses settled.
    axis
        In the frame of the plate.
    chart
        The part.
    chances
        (n, 2, S, AROUND) probability that each look would have found a burr in each cell that lies along
        the generatrix, or around the axis.
    burrs
        Expected number on the part.

    Notes
    -----
    O(calls²).

    """
    frame = T_part_mesh(axis.point_mm, axis.direction)
    groups = [[calls[i] for i in group] for group in _groups(calls)]
    told = [_told(group, frame, chart, chances, burrs) for group in groups]
    return tuple(
        Place(tuple(group), one.chances, float(probability), _burr(group, frame))
        for group, one, probability in zip(groups, told, _probabilities(told, len(chances)), strict=True)
    )


def _groups(calls: Sequence[Call]) -> list[list[int]]:
    """Calls that overlap, the most significant first; a look has one call in a group."""
    order = sorted(range(len(calls)), key=lambda i: -calls[i].burr.significance)
    groups: list[list[int]] = []
    for i in order:
        near = [
            group
            for group in groups
            if calls[i].look not in {calls[j].look for j in group} and _same(calls[group[0]], calls[i])
        ]
        if near:
            min(near, key=lambda group: _apart(calls[group[0]], calls[i])).append(i)
        else:
            groups.append([i])
    return groups


def _same(one: Call, other: Call) -> bool:
    reach = _SAME_MM + 0.5 * max(one.burr.width_mm.value, other.burr.width_mm.value)
    return _apart(one, other) < reach


def _apart(one: Call, other: Call) -> float:
    """Distance across the burrs, mm: of the middle of the shorter from the line of the longer."""
    long, step = _from_longer((one.burr, one.T_plate_burr), (other.burr, other.T_plate_burr))
    along = max(abs(float(step[0])) - 0.5 * float(long.length_mm.value), 0.0)
    return float(np.linalg.norm([along, *step[1:]]))


def _from_longer(*burrs: tuple[Burr, Floats]) -> tuple[Burr, Floats]:
    """The longer of two burrs with their poses, and where (3,) the middle of the shorter is in its axes."""
    (long, T_long), (_, T_short) = sorted(burrs, key=lambda one: -one[0].length_mm.value)
    return long, np.asarray((np.linalg.inv(T_long) @ T_short[:, 3])[:3])


class _Told(NamedTuple):
    """What looks say of a place.

    Parameters
    ----------
    real
        Logarithm of how likely that is of a burr, times how many there are.
    chances
        (n,) as those of :class:`Place`.
    looks
        How many of them called it, or would have.
    lone
        The look that alone called it, -1 where several did.
    along
        Whether its baseline lies along the burr rather than across.
    clear
        How much likelier a call as clear as the clearest is of a burr than of noise.
    line
        0 where it lies along the generatrix, 1 where it goes around the axis.

    """

    real: float
    chances: Floats
    looks: int
    lone: int
    along: bool
    clear: float
    line: int


def _told(calls: list[Call], frame: Floats, chart: Chart, chances: Floats, burrs: float) -> _Told:
    chance = np.max([_chance(call, frame, chart, chances) for call in calls], axis=0)
    called = np.zeros(len(chances), np.bool_)
    called[[call.look for call in calls]] = True
    against = list(frozenset.intersection(*(call.bare for call in calls)))
    chance[against] = np.maximum(chance[against], SURE)
    chance = np.where(called, np.maximum(chance, _LITTLE), chance)
    silent = ~called & (chance >= _LITTLE)
    real = np.log(burrs) + np.log(chance[called]).sum() + np.log1p(-chance[silent]).sum()
    lone = int(np.argmax(called)) if np.count_nonzero(called) == 1 else -1
    clear = _clearness(calls[0].burr.significance, along=calls[0].along)
    line = line_of(frame @ calls[0].T_plate_burr)
    return _Told(float(real), chance, int(called.sum() + silent.sum()), lone, calls[0].along, clear, line)


def _clearness(significance: float, *, along: bool) -> float:
    """How much likelier a call of that significance is of a burr than of noise: both are exponential."""
    excess = max(significance - LEAST, 0.0)
    faint, mirrored = (one[int(not along)] for one in (_FAINT, _MIRRORED))
    burr = np.exp(-excess / CLEAR) / CLEAR
    return float(burr / ((1.0 - mirrored) * np.exp(-excess / faint) / faint + mirrored * burr))


def _probabilities(told: Sequence[_Told], looks: int) -> Floats:
    """(P,) that a burr is at each place. O(P) a round.

    A false call has as many looks to arise in as say something of its place. Of a blemish that is there the
    other looks confirm it as often as not; of noise none does. Each look has a rate of noise of its own: of
    rates with the usual mean the exponential distribution supposes least, and what of the look's other lone
    calls is probably false makes it a gamma distribution (Gelman et al., Bayesian Data Analysis, section
    2.6), round by round until they agree. And burrs lie as the others do, along the generatrix or around the
    axis (:attr:`burrscan.cell.belief.Belief.lines`): up to twice as many as expected lie as all others, and
    fewer the other way.
    """
    real = np.array([one.real for one in told])
    count = np.array([one.looks for one in told], float)
    lone = np.array([one.lone for one in told], np.int64)
    along = np.array([one.along for one in told], np.bool_)
    clear = np.array([one.clear for one in told], float)
    line = np.array([one.line for one in told], np.int64)
    share = np.where(lone >= 0, np.where(along, *NOISE) / sum(NOISE), 0.0)
    noise, blemish = share * sum(NOISE), BLEMISHES * 0.5 ** (count - 1.0)
    probability: Floats = np.zeros(len(told))
    for _ in range(_ROUNDS):
        before, found = probability, np.bincount(line, probability, 2)
        alike = 2.0 * (1.0 + found[line] - probability) / (2.0 + found.sum() - probability)
        odds = np.log(count * (noise / clear + blemish)) - real - np.log(alike)
        probability = 1.0 / (1.0 + np.exp(np.clip(odds, -50.0, 50.0)))
        if np.abs(probability - before).max(initial=0.0) < _AGREED:
            break
        wrong = np.where(lone >= 0, 1.0 - probability, 0.0)
        of_look = np.bincount(np.maximum(lone, 0), wrong, looks)[lone]
        noise = share * (1.0 + of_look - wrong) / (1.0 / sum(NOISE) + 1.0)
    return probability


def _chance(call: Call, frame: Floats, chart: Chart, chances: Floats) -> Floats:
    """(n,) per look the mean chance over the cells that the burr crosses."""
    half = 0.5 * call.burr.length_mm.value
    along = np.linspace(-half, half, 7)
    pose = frame @ call.T_plate_burr
    cell, around = chart.cells_of(walked(pose, along), within_mm=10.0)
    known: Ints = np.flatnonzero(cell >= 0)
    if not len(known):
        return np.zeros(len(chances))
    return np.asarray(chances[:, line_of(pose), cell[known], around[known]].mean(axis=1))


def _burr(calls: list[Call], frame: Floats) -> Burr:
    """One burr of several calls: sides by vote, sizes by weight, place and extent of the fullest view.

    A size is told by looks that face the burr, and by those from not too far aside.
    """
    side = side_of(side_log_odds(calls))
    sided = _facing([call for call in calls if call.burr.side == side])
    sized = [call for call in calls if call.burr.side == side and _sizes(call)] or sided
    strong = max(call.burr.significance for call in sided)
    full = max(
        (call for call in sided if call.burr.significance >= 0.5 * strong),
        key=lambda call: call.burr.length_mm.value,
    )
    T_part_burr = frame @ full.T_plate_burr
    middle = T_part_burr[:3, 3]
    shift = float(middle[2]) - 0.5 * (full.burr.z_start_mm.value + full.burr.z_end_mm.value)
    start, end = (
        Value(value.value + shift, value.sigma) for value in (full.burr.z_start_mm, full.burr.z_end_mm)
    )
    return replace(
        full.burr,
        side=side,
        angle_deg=Value(float(np.degrees(np.arctan2(middle[1], middle[0]))), full.burr.angle_deg.sigma),
        z_start_mm=start,
        z_end_mm=end,
        height_mm=_weighted([call.burr.height_mm for call in sized]),
        width_mm=_weighted([call.burr.width_mm for call in sized]),
        area_mm2=_weighted([call.burr.area_mm2 for call in sized]),
        volume_mm3=_weighted([call.burr.volume_mm3 for call in sized]),
        T_mesh_burr=full.T_plate_burr,
        significance=float(np.sqrt(sum(call.burr.significance**2 for call in sided))),
    )


def _facing(calls: Sequence[Call]) -> list[Call]:
    """The calls whose looks tell sizes; where none does, the one from least aside."""
    faced = [call for call in calls if call.faced]
    return faced or [min(calls, key=lambda call: call.aside_deg)]


def _sizes(call: Call) -> bool:
    """Whether a look tells a burr's size, as one that faces it does: not from far aside, nor across it."""
    return call.along and call.aside_deg <= _SIZED_DEG


def distinct(places: Sequence[Place], T_part_plate: Floats) -> tuple[Place, ...]:
    """Places without those whose base may overlap that of a clearer one which is called. O(places²).

    Both walls of a wide nick may be called, and what a flank mirrors: one base carries one burr.
    """
    kept: list[Place] = []
    for place in sorted(places, key=lambda place: (not place.certain, -place.burr.significance)):
        if not any(other.certain and _overlap(place.burr, other.burr, T_part_plate) for other in kept):
            kept.append(place)
    return tuple(place for place in places if any(place is one for one in kept))


def _overlap(one: Burr, other: Burr, T_part_plate: Floats) -> bool:
    """Whether two bases may overlap, as far as their angles are known."""
    long, step = _from_longer((one, one.T_mesh_burr), (other, other.T_mesh_burr))
    x, y = (T_part_plate @ long.T_mesh_burr)[:2, 3]
    unsure_mm = np.radians(np.hypot(one.angle_deg.sigma, other.angle_deg.sigma)) * np.hypot(x, y)
    half = 0.5 * (one.width_mm.value + other.width_mm.value)
    reach = 0.5 * long.length_mm.value, half + _UNSURE * unsure_mm, _SAME_MM
    return bool(np.all(np.abs(step) < reach))


def side_log_odds(calls: Sequence[Call]) -> float:
    """Of a protrusion against a nick, as the calls have it.

    A look that faces the burr is right more often, and a faint call weighs less than a clear one. None from
    aside weighs more than the clearest that faced it.
    """
    clear = max(call.burr.significance for call in _facing(calls))
    faced, aside = (float(np.log(right / (1.0 - right))) for right in _SIDE_RIGHT)
    votes = [
        (faced if call.faced else aside) * min(call.burr.significance / clear, 1.0) * call.burr.sign
        for call in calls
    ]
    return float(sum(votes))


def _weighted(values: list[Value]) -> Value:
    """Mean by inverse variance, with the scatter between looks beside the stated one (DerSimonian 1986)."""
    value = np.array([v.value for v in values])
    sigma = np.array([v.sigma for v in values])
    known = np.isfinite(value) & np.isfinite(sigma) & (sigma > 0.0)
    if not known.any():
        return values[0]
    value, variance = value[known], sigma[known] ** 2
    weight = 1.0 / variance
    mean = float((weight * value).sum() / weight.sum())
    excess = float((weight * (value - mean) ** 2).sum()) - (len(value) - 1)
    spread = weight.sum() - (weight**2).sum() / weight.sum()
    between = max(excess / spread, 0.0) if spread > 0.0 else 0.0
    weight = 1.0 / (variance + between)
    return Value(float((weight * value).sum() / weight.sum()), float(np.sqrt(1.0 / weight.sum())))
