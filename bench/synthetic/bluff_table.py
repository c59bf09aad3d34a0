"""How often an axis that is grossly off is given as certain, and whether its intervals hold."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from bench.score.shape import OFF_DEG, axis_error
from bench.statistics.share import share_bounds
from bench.synthetic.axis_table import share_held, within_95
from bench.synthetic.axis_view import part_view
from bench.synthetic.revolution import RevolutionScan
from burrscan.axis import find_axis
from burrscan.errors import InputError
from burrscan.inspection import Axis

SIGMAS = 5.0
"""An axis off by more than so many of its stated deviations bluffs, whatever it is off by."""
OFF_SHARE = float(np.radians(OFF_DEG))
"""An axis off its place by more than this share of the scan's rms radius: what turning by 1° moves there."""


@dataclass(frozen=True)
class Verdict:
    """What a method said of one view, against the truth.

    Parameters
    ----------
    family, number, reach_px
        Of the view (:func:`bench.synthetic.axis_view.part_view`).
    ending
        ``refused``; ``flagged``, with what the data leave open; or ``given``, as certain.
    off_deg
        Angle to the true axis; of a refused axis, where the method tells it when it is asked to; else NaN.
    sigma_deg, gross_probability
        As the method states them; NaN where it states none.
    held
        Share of the four stated 95 % intervals that hold; NaN where none are stated.
    aside_mm, aside_sigmas
        Distance of the axis found from the true one where its place is stated, and the same in its stated
        deviations (Mahalanobis); NaN where the axis was refused, or states none.
    radius_mm
        Root mean square distance of the scan's points from the true axis.

    """

    family: str
    number: int
    reach_px: float
    ending: Literal["refused", "flagged", "given"]
    off_deg: float
    sigma_deg: float = float("nan")
    gross_probability: float = float("nan")
    held: float = float("nan")
    aside_mm: float = float("nan")
    aside_sigmas: float = float("nan")
    radius_mm: float = float("nan")

    @property
    def gross(self) -> bool:
        """Whether an axis off by more than 1 degree was given as certain."""
        return self.ending == "given" and self.off_deg > OFF_DEG

    @property
    def beyond(self) -> bool:
        """Whether it was, and its stated deviation does not explain it."""
        return self.gross and self.off_deg > SIGMAS * self.sigma_deg

    @property
    def misplaced(self) -> bool:
        """Whether an axis was given as certain that is off its place by more than its deviation explains."""
        far = self.aside_mm > OFF_SHARE * self.radius_mm
        return self.ending == "given" and far and self.aside_sigmas > SIGMAS

    @property
    def good(self) -> bool:
        """Whether the axis, given or refused, is within 1 degree."""
        return self.ending != "flagged" and self.off_deg <= OFF_DEG


@dataclass(frozen=True)
class Tally:
    """Counts over views; ``held`` and half its 95 % interval are NaN where no interval is stated."""

    views: int
    refused: int
    good: int
    good_refused: int
    flagged: int
    given: int
    gross: int
    beyond: int
    misplaced: int
    most_gross: float
    held: float
    held_within: float


def verdict(family: str, number: int, *, seed: int, method: str = "profile") -> Verdict:
    """Let a method find the axis of one view, and say how that ended."""
    view = part_view(family, number, seed=seed)
    about = (family, number, view.reach_px)
    try:
        axis = find_axis(view.scan.vertices_mm, view.scan.faces, method=method)
    except InputError:
        return Verdict(*about, "refused", _off_when_refused(view.scan, method))
    states = bool(np.isfinite(axis.covariance).all())
    aside_mm, aside_sigmas = _aside(axis, view.scan) if states else (math.nan, math.nan)
    return Verdict(
        *about,
        "flagged" if axis.undetermined else "given",
        off_deg=view.scan.angle_error_deg(axis.direction),
        sigma_deg=axis.sigma_deg,
        gross_probability=axis.gross_probability,
        held=float(within_95(axis, view.scan).mean()) if states else math.nan,
        aside_mm=aside_mm,
        aside_sigmas=aside_sigmas,
        radius_mm=_radius_mm(view.scan),
    )


def _aside(axis: Axis, scan: RevolutionScan) -> tuple[float, float]:
    """Distance from the true axis, mm and stated deviations, in the plane through the stated place."""
    off = axis_error(axis, point_mm=scan.point_mm, direction=scan.direction)[2:]
    squared = float(off @ np.linalg.pinv(axis.covariance[2:, 2:]) @ off)
    return math.hypot(*off), math.sqrt(max(squared, 0.0))


def _radius_mm(scan: RevolutionScan) -> float:
    aside = np.cross(scan.vertices_mm - scan.point_mm, scan.direction)
    return float(np.sqrt((aside**2).sum(axis=1).mean()))


def _off_when_refused(scan: RevolutionScan, method: str) -> float:
    """How far off the axis was that a method refused; NaN where it has none, or no ``most_doubt``."""
    try:
        axis: Axis = find_axis(scan.vertices_mm, scan.faces, method=method, most_doubt=1.0)
    except InputError:
        return float("nan")
    return scan.angle_error_deg(axis.direction)


def tally(verdicts: Sequence[Verdict]) -> Tally:
    """The counts; ``most_gross`` is the exact one-sided 95 % upper limit of gross among given."""
    given = [one for one in verdicts if one.ending == "given"]
    gross = sum(one.gross for one in given)
    held = [np.array([one.held]) for one in given if np.isfinite(one.held)]
    return Tally(
        views=len(verdicts),
        refused=sum(one.ending == "refused" for one in verdicts),
        good=sum(one.good for one in verdicts),
        good_refused=sum(one.good and one.ending == "refused" for one in verdicts),
        flagged=sum(one.ending == "flagged" for one in verdicts),
        given=len(given),
        gross=gross,
        beyond=sum(one.beyond for one in given),
        misplaced=sum(one.misplaced for one in given),
        most_gross=share_bounds(gross, len(given), sides=1)[1] if given else float("nan"),
        **dict(zip(("held", "held_within"), share_held(held), strict=True)),
    )


def by(verdicts: Iterable[Verdict], name: str) -> dict[Any, list[Verdict]]:
    """The verdicts of each value of a field, in the order in which they come."""
    groups = dict[Any, list[Verdict]]()
    for one in verdicts:
        groups.setdefault(getattr(one, name), []).append(one)
    return groups
