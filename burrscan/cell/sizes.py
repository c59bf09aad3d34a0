"""A burr's sizes from the vertices of all looks at once.

Pixels of one look meet a narrow burr in two or three rows, which tell no cross-section from another, and of
two flanks one is hidden or mirrors the part. Rows of several looks lie between one another, and each flank
answers some of them: over the curve that all looks share they are one section.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Floats
from burrscan.burrs.describe import NO_TRIANGLE
from burrscan.burrs.height import combined, volume
from burrscan.burrs.light.shine import walls_share
from burrscan.burrs.pose import turned_by
from burrscan.burrs.shape.along import height_of
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import first_ridge, fit_ridge
from burrscan.cell.chart import beside, line_of
from burrscan.inspection import Axis, Burr, Side, Value, side_of

_BESIDE_MM = 3.0
"""Of the surface beside a base: as wide as the widest burr that is looked for, for a call may be of one
flank only. With 1.6 mm two of 103 rendered ridges, called twice in parts, were cut in half."""
_FEWEST = 20
"""Vertices along a burr with which a look has measured it: fewer are strays."""
_ABOVE_MM = 5.0
"""What is farther off its middle, along the normal, is another surface."""


class _Fit(NamedTuple):
    """Middle of the base across, height, width and area; (4,) what the fit knows of their errors."""

    values: Floats
    sigmas: Floats


class Shown(NamedTuple):
    """A burr of one side as several looks show it together.

    Parameters
    ----------
    burr
        Of that side, joined of its calls.
    values, sigma
        (4,) middle of its base across, height, width, mm, and area, mm²; by how much they err as far as the
        looks differ and the fit knows.
    looks
        How many measured it.

    """

    burr: Burr
    values: Floats
    sigma: Floats
    looks: int

    @property
    def log_odds(self) -> float:
        """Of a height against none: Student's, with as many degrees of freedom as the jackknife has."""
        clear = max(float(self.values[1]), 0.0) / float(self.sigma[1])
        return 0.5 * self.looks * float(np.log1p(clear**2 / (self.looks - 1)))


class Cloud(NamedTuple):
    """What a look measured.

    Parameters
    ----------
    points_mm
        (V, 3) in the part frame.
    deviation_mm, sigma_mm
        (V,) from the generatrix, and the stated standard deviation.
    px_mm
        Size of a camera pixel on the part.

    """

    points_mm: Floats
    deviation_mm: Floats
    sigma_mm: Floats
    px_mm: float


def sides(called: Burr, T_part_burr: Floats, clouds: Sequence[Cloud]) -> dict[Side, Shown]:
    """What the vertices of all looks show of a burr, as a protrusion and as a nick.

    Parameters
    ----------
    called
        Joined of its calls.
    T_part_burr
        (4, 4) its pose in the part frame.
    clouds
        One per look.

    Returns
    -------
    dict
        Without a side on which nothing rises. Empty where the burr goes around the axis (it lies on an edge,
        beside which nothing is unrolled), and where fewer than two looks have measured it.

    Notes
    -----
    What a look errs by, its vertices share, so the fit's own covariance knows little of it. The jackknife
    over looks does (Efron & Stein, Annals of Statistics 9, 1981), but for what they all share: light between
    the walls of a nick. O(looks² vertices near the burr).

    """
    if line_of(T_part_burr):
        return {}
    looks = [(_near(called, T_part_burr, cloud), cloud.px_mm) for cloud in clouds]
    patches = [patch for patch, _ in looks if patch is not None]
    if len(patches) < 2:
        return {}
    pitch_mm = float(np.median([px_mm for patch, px_mm in looks if patch is not None]))
    either = [replace(called, side=side_of(sign)) for sign in (1.0, -1.0)]
    shown = [_shown(burr, patches, pitch_mm) for burr in either]
    return {one.burr.side: one for one in shown if one is not None}


def _shown(burr: Burr, patches: Sequence[Patch], pitch_mm: float) -> Shown | None:
    whole = _fitted(patches, burr, pitch_mm)
    if whole is None:
        return None
    without = [_fitted([*patches[:n], *patches[n + 1 :]], burr, pitch_mm) for n in range(len(patches))]
    rest = np.array([np.zeros(4) if one is None else one.values for one in without])
    alike = NO_TRIANGLE * whole.values[[2, 1, 2, 3]]  # a middle is off by a share of the width
    sigma = np.sqrt((len(rest) - 1) * rest.var(axis=0) + alike**2 + whole.sigmas**2)
    return Shown(burr, whole.values, sigma, len(patches))


def sided(called: Burr, log_odds: float, on: Mapping[Side, Shown]) -> Shown | None:
    """A burr on the side that calls and vertices tell together.

    Parameters
    ----------
    called
        Joined of its calls.
    log_odds
        Of a protrusion against a nick, as the calls have it.
    on
        What the vertices show on either side: :func:`sides`.

    Returns
    -------
    Shown or None
        Of the other side than the calls', where the vertices outweigh them; then nothing is left of the
        calls' sizes. None where the vertices show nothing on that side.

    """
    shown = on.get(side_of(log_odds + sum(one.burr.sign * one.log_odds for one in on.values())))
    if shown is None or shown.burr.side == called.side:
        return shown
    height, width, area = (Value(float(value), float("inf")) for value in shown.values[1:])
    return shown._replace(burr=replace(shown.burr, height_mm=height, width_mm=width, area_mm2=area))


def sized(shown: Shown, axis: Axis, T_part_burr: Floats) -> Burr:
    """A burr with angle, height, width, area and volume as all looks show them together.

    The calls' own sizes keep their weight beside that: where one rolled over has several heights at one place
    no section is like it. What walls that light each other do to a nick, all looks share.

    Parameters
    ----------
    shown
        What looks show of it.
    axis
        Of the part, in the burr's frame of reference.
    T_part_burr
        (4, 4) its pose in the part frame.

    """
    burr = shown.burr
    walls = walls_share(burr) * np.array([0.0, 1.0, 0.0, 1.0]) * shown.values
    sigma = np.hypot(shown.sigma, walls)
    own = [Value(float(value), float(one)) for value, one in zip(shown.values, sigma, strict=True)]
    (x, y), (dx, dy) = T_part_burr[:2, 3], T_part_burr[:2, 1]
    r_mm = float(np.hypot(x, y))
    angle = Value(0.0, float(np.radians(burr.angle_deg.sigma)) * r_mm)
    called = angle, burr.height_mm, burr.width_mm, burr.area_mm2
    across, height, width, area = (combined(one, other) for one, other in zip(own, called, strict=True))
    sense = 1.0 if dy * x > dx * y else -1.0  # across a burr along the generatrix is around, or back
    burr = turned_by(burr, Value(sense * across.value / r_mm, across.sigma / r_mm), axis)
    return replace(
        burr,
        height_mm=height,
        width_mm=width,
        area_mm2=area,
        volume_mm3=volume(area, burr.length_mm),
    )


def _near(burr: Burr, T_part_burr: Floats, cloud: Cloud) -> Patch | None:
    """A look's vertices around a burr, outwards up; None where it has not measured it."""
    u, v, above = beside(T_part_burr, cloud.points_mm).T
    reach = 0.5 * burr.length_mm.value, 0.5 * burr.width_mm.value + _BESIDE_MM
    near = (np.abs(u) < reach[0] + _BESIDE_MM) & (np.abs(v) < reach[1]) & (np.abs(above) < _ABOVE_MM)
    near &= np.isfinite(cloud.deviation_mm)
    if np.count_nonzero(np.abs(u[near]) < reach[0]) < _FEWEST:
        return None
    sigma = np.hypot(cloud.sigma_mm[near], NO_TRIANGLE * burr.height_mm.value)
    return Patch(u[near], v[near], cloud.deviation_mm[near], sigma)


def _fitted(patches: Sequence[Patch], burr: Burr, pitch_mm: float) -> _Fit | None:
    """The ridge of the vertices of several looks; None where nothing rises."""
    u, v, lift, sigma = (
        np.concatenate(each)
        for each in zip(*((p.u_mm, p.v_mm, p.lift_mm, p.sigma_mm) for p in patches), strict=True)
    )
    patch, half = Patch(u, v, burr.sign * lift, sigma), 0.5 * burr.length_mm.value
    spacing_mm = pitch_mm / len(patches)
    first = first_ridge(patch, spacing_mm=spacing_mm, start=(-half, half))
    if first is None:
        return None
    ridge = fit_ridge(patch, first, spacing_mm=spacing_mm, footprint_mm=pitch_mm)
    height, height_sigma = height_of(patch, ridge, row_mm=pitch_mm)
    across_sigma = ridge.sigma_of([0.0, 1.0, 0.0, 0.0, ridge.parameters[3]])
    return _Fit(
        np.array([ridge.base_middle_mm(0.0), height, ridge.width_mm, ridge.area_mm2]),
        np.array([across_sigma, np.hypot(height_sigma, ridge.open_mm), 0.0, 0.0]),
    )
