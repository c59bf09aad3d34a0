"""From a rough curve to the robust least-squares curve of all data: its creases, its bends and its ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.generatrix.polyline import Candidates, Foot, Polyline, candidates, feet
from burrscan.generatrix.profile import Profile
from burrscan.generatrix.refine import Step, smooth_tangents, step
from burrscan.generatrix.tracing.bends import halved
from burrscan.generatrix.tracing.cells import Scale
from burrscan.generatrix.tracing.creases import borne_out, creases, moved, sharpened
from burrscan.generatrix.tracing.ends import cut_back

_REACH = 0.05
"""Deviations are looked for within this share of the largest radius."""
_TUKEY_STEPS = 2
"""Steps on the data: Gauss-Newton is linear in the offsets, and the first has set the weights right."""
_HALVINGS = 3
"""Of a node spacing, two vertices wide: an eighth of it is what many rows at different places show."""
_NODE_SIGMAS = 5.0
"""Shortest segment: :attr:`burrscan.generatrix.tracing.cells.Scale.node_mm` says why."""


def exact(line: Polyline, data: Profile, scale: Scale, *, stated_mm: float) -> tuple[Step, Foot]:
    """Fit a rough curve to all data, with creases where they bear them out and more nodes where they bend.

    Parameters
    ----------
    line
        Evenly spaced nodes within a cell of the data.
    data, scale
        The data and what resolution they allow.
    stated_mm
        Standard deviation that the data are said to have; 0 where nothing was said.

    Returns
    -------
    tuple
        The last step of the fit, and the nearest places of the data on its line.

    Notes
    -----
    O(V + K) for each of a few fits; a crease costs O(V) more.

    """
    fitter = _Fitter(data, scale, stated_mm)
    fit, foot = fitter.fitted(line)
    found = creases(line)
    if found:
        creased, nodes = sharpened(line, found)
        first = fitter.fitted(creased)
        places = moved(found, first[0].line, nodes)
        again = sharpened(line, places)[0]
        second = fitter.fitted(again)
        tries = [(at, (fit.line, foot)) for at, (fit, foot) in ((found, first), (places, second))]
        kept = borne_out(data, scale, rounded=(fit.line, foot), sharp=tries)
        if kept:
            sharp = sharpened(line, kept)[0]
            fit, foot = second if _alike(sharp, again) else fitter.fitted(sharp)
    for _ in range(_HALVINGS):
        finer = halved(fit.line, foot, data.angle, scale.arc, _NODE_SIGMAS * scale.noise_mm)
        if len(finer.nodes_mm) == len(fit.line.nodes_mm):
            break
        fit, foot = fitter.fitted(finer)
    return fit, foot


def reach_from(line: Polyline, scale: Scale) -> float:
    """How far from a line its deviations are looked for, mm."""
    return max(4.0 * scale.cell_mm, _REACH * float(line.nodes_mm[:, 1].max()))


def feet_near(data: Profile, line: Polyline, scale: Scale) -> tuple[Foot, Candidates]:
    """Nearest places of data on a line, and the lists that find them while its nodes move a little."""
    side, reach = scale.cell_mm, reach_from(line, scale)
    near = candidates(data.z_mm, data.r_mm, line, side_mm=side / 3.0, slack_mm=0.1 * side, reach_mm=reach)
    return feet(data.z_mm, data.r_mm, line, near, overshoot_mm=0.5 * side), near


class _Fitter:
    """Fits lines to the same data."""

    def __init__(self, data: Profile, scale: Scale, stated_mm: float) -> None:
        self._data, self._scale, self._stated = data, scale, stated_mm
        self._side = scale.cell_mm

    def fitted(self, line: Polyline) -> tuple[Step, Foot]:
        """A line after the Tukey steps, its ends where the data end."""
        foot, near = feet_near(self._data, line, self._scale)
        start = self._start(foot, line)
        fit, tangents = Step(line, np.ones(len(start)), start), smooth_tangents(line)
        least = max(0.5 * self._stated, 0.01 * self._side)
        for _ in range(_TUKEY_STEPS):
            fit = step(fit.line, foot, scale_mm=np.maximum(fit.scale_mm, least), tangents=tangents)
            foot = feet(self._data.z_mm, self._data.r_mm, fit.line, near, overshoot_mm=0.5 * self._side)
        ended = cut_back(fit.line, foot, self._data.angle, self._scale.arc)
        if _alike(ended, fit.line):
            return fit, foot
        foot = feet(self._data.z_mm, self._data.r_mm, ended, near, overshoot_mm=0.5 * self._side)
        return replace(fit, line=ended), foot

    def _start(self, foot: Foot, line: Polyline) -> Floats:
        """(K,) scales of the first weights."""
        known = np.abs(foot.distance_mm[foot.valid])
        near = known[known < self._side]
        scale = 1.5 * float(np.median(near)) if len(near) else self._side
        return np.full(len(line.nodes_mm), max(scale, self._stated, 0.01 * self._side))


def _alike(line: Polyline, other: Polyline) -> bool:
    """Whether two lines have the same nodes."""
    return np.array_equal(line.nodes_mm, other.nodes_mm) and np.array_equal(line.starts, other.starts)
