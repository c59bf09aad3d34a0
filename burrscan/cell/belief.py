"""What may still be hidden: the probability that a burr lies where no view would have shown it.

This is the theory of optimal search (Koopman, Search and Screening, 1946; Stone 1975): a burr lies anywhere
on the part with even density; a look that covers a cell finds what lies there with a stated probability; the
next look goes where it finds most per second, and the search ends when little is left to find.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Bools, Floats
from burrscan.cell.chart import AROUND, Chart
from burrscan.cell.outlook import Outlook

SURE = 0.95
"""Share of burrs from 0.3 mm up that one look finds on metal it has measured: what the suite ``standard``
shows at 95 % confidence (40 of 40 allow 92.8 %; with the 16 of 16 beside them 94.8)."""
_BINS_DEG = np.array([0.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 50.0, 90.0])
"""Of the tilt: metal's light changes fastest near the mirror direction."""
_WORTH = 10.0
"""Cells that what the tilt says is worth beside what a row of cells has shown."""
_PRIOR = (3.0, 1.0)
"""Cells measured and not, as if seen before any look: a scanner is bought to measure."""


@dataclass
class Belief:
    """What has been learnt so far.

    Parameters
    ----------
    hidden
        (2, S, AROUND) probability that a burr there would have been missed by every look so far: one lying
        along the generatrix, and one around the axis.
    measured, missed
        (bins,) cells that were in sight and measured, or not, by the tilt of their normal: how this metal
        answers.
    rows
        (S,) how much more or less often than its tilt says a row of cells along the generatrix is measured: a
        groove that mirrors itself answers from nowhere.
    suspicion
        (2, S, AROUND) weight of places where something was found that is not yet sure: what lies along the
        generatrix, and what lies around the axis.
    unfaced
        (2, S, AROUND) weight of places where something is known that was seen from aside only.
    found
        (2,) expected number of burrs among the places called so far, along and around.

    """

    hidden: Floats
    suspicion: Floats
    unfaced: Floats
    rows: Floats
    measured: Floats = field(default_factory=lambda: np.full(len(_BINS_DEG) - 1, _PRIOR[0]))
    missed: Floats = field(default_factory=lambda: np.full(len(_BINS_DEG) - 1, _PRIOR[1]))
    found: Floats = field(default_factory=lambda: np.zeros(2))

    @property
    def lines(self) -> Floats:
        """(2,) probability that a burr lies along the generatrix, or around the axis: as those found do.

        Laplace's rule of succession (1774).
        """
        return np.asarray((1.0 + self.found) / (2.0 + self.found.sum()))

    @property
    def left(self) -> Floats:
        """(S, AROUND) probability that a burr there would have been missed by every look so far."""
        return np.asarray(np.tensordot(self.lines, self.hidden, 1))

    def answer(self, tilt_deg: Floats) -> Floats:
        """(S, N) probability that a cell in sight is measured, by its tilt and its row."""
        return np.minimum(self._by_tilt(tilt_deg) * self.rows[:, None], 1.0)

    def _by_tilt(self, tilt_deg: Floats) -> Floats:
        share = self.measured / (self.measured + self.missed)
        return np.asarray(share[np.digitize(tilt_deg, _BINS_DEG[1:-1])])

    def learn(self, looks: Sequence[tuple[Outlook, Floats]]) -> None:
        """Take in looks: what each had in sight, and (S, AROUND) which share of each cell it measured."""
        for seen, density in looks:
            self._learn_tilts(seen, density)
        got = sum(np.where(seen.seen, density, 0.0).sum(axis=1) for seen, density in looks)
        expected = sum(
            np.where(seen.seen, self._by_tilt(seen.tilt_deg), 0.0).sum(axis=1) for seen, _ in looks
        )
        self.rows = np.asarray((got + _WORTH) / (expected + _WORTH))

    def _learn_tilts(self, seen: Outlook, density: Floats) -> None:
        place = np.digitize(seen.tilt_deg, _BINS_DEG[1:-1])[seen.seen]
        share = np.clip(density[seen.seen], 0.0, 1.0)
        self.measured += np.bincount(place, share, len(self.measured))
        self.missed += np.bincount(place, 1.0 - share, len(self.missed))

    def rate(self, chart: Chart, *, burrs: float) -> float:
        """Expected number of burrs on a whole part like this one: where some were found, there are more.

        Burrs fall like raindrops, at a rate that differs from part to part; of rates with the mean ``burrs``
        the exponential distribution supposes least. What was found on the share of the part that was covered
        makes it a gamma distribution (Gelman et al., Bayesian Data Analysis, section 2.6).
        """
        return float(1.0 + self.found.sum()) / self._covered(chart, burrs)

    def left_in(self, chart: Chart, *, burrs: float, sights: Bools | None = None) -> float:
        """Probability that a burr is left in what can be seen at all.

        Parameters
        ----------
        chart
            The part.
        burrs
            Expected number of burrs on it, before any look.
        sights
            (S, AROUND) True where some pose shows the cell; all of them by default.

        """
        covered = self._covered(chart, burrs)
        return float(1.0 - (covered / (covered + self._share(chart, sights))) ** (1.0 + self.found.sum()))

    def _covered(self, chart: Chart, burrs: float) -> float:
        """Parts that speak for the rate: what is supposed of it counts as much as 1 / ``burrs`` of one."""
        return 1.0 / burrs + 1.0 - self._share(chart, None)

    def _share(self, chart: Chart, sights: Bools | None) -> float:
        """Of the part's area what no look would have shown, in sight."""
        area = np.broadcast_to(chart.area_mm2[:, None], chart.shape)
        left = area * self.left if sights is None else np.where(sights, area * self.left, 0.0)
        return float(left.sum() / area.sum())


def belief_of(chart: Chart, looks: Sequence[tuple[Outlook, Floats]]) -> Belief:
    """The belief after some looks: outlooks of the whole chart and densities, (S, AROUND) each."""
    belief = Belief(
        np.ones((2, *chart.shape)),
        np.zeros((2, *chart.shape)),
        np.zeros((2, *chart.shape)),
        np.ones(chart.shape[0]),
    )
    belief.learn(looks)
    for seen, density in looks:
        belief.hidden *= 1.0 - SURE * np.clip(density, 0.0, 1.0) * seen.shows
    return belief


def density_of(chart: Chart, points_mm: Floats, seen: Outlook, *, px_mm: float) -> Floats:
    """(S, AROUND) measured points of each cell as a share of those that its area should give.

    Parameters
    ----------
    chart, points_mm
        The part, and (N, 3) measured points in its frame.
    seen
        Outlook of the look, for the slope of each cell.
    px_mm
        Size of a camera pixel on the part.

    """
    along, around = chart.cells_of(points_mm)
    known = along >= 0
    count = np.zeros(chart.shape)
    np.add.at(count, (along[known], around[known]), 1.0)
    expected = chart.area_mm2[:, None] * np.cos(np.radians(np.minimum(seen.slope_deg, 80.0))) / px_mm**2
    return np.asarray(np.clip(count / np.maximum(expected, 1.0), 0.0, 1.0))


def shifted(values: NDArray[Any], cells: int) -> NDArray[Any]:
    """A map turned by so many cells around the axis."""
    return np.roll(values, cells % AROUND, axis=-1)
