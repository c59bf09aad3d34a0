"""The paper's test of one orientation, opened up: the sections of a mesh and the circles through them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.rivals.seed import quality_of
from burrscan.axis.sections import fit_circles, sections, turned_to_z

PLANES = 10
"""The paper's P (section 3.2)."""
TOLERANCE_MM = 1.0
"""The paper's, of RANSAC's circles (section 3.2)."""

WHOLE = "whole_distance"
"""The distances to the circles, with outliers not cut off at the tolerance."""


@dataclass(frozen=True)
class Sectioned:
    """What the paper's test of an orientation sees.

    Parameters
    ----------
    turn
        (3, 3) takes the orientation to +z.
    points_mm
        (M, 3) intersection points in the turned frame.
    plane
        (M,) their planes, 1 to P - 1.
    circles
        (P + 1, 8) as :func:`burrscan.axis.sections.fit_circles`; NaN where there is none.

    """

    turn: Floats
    points_mm: Floats
    plane: Ints
    circles: Floats

    def quality(self, measure: str = "circle_distance") -> float:
        """The paper's f, by one of its three measures (section 5.1), or with outliers' whole distances."""
        if measure == WHOLE:
            return quality_of(self.circles, "circle_distance", outliers="distance")
        return quality_of(self.circles, measure)

    @property
    def good(self) -> Floats:
        """The circles there are."""
        return self.circles[np.isfinite(self.circles[:, 3])]


def angles_of(direction: Floats) -> Floats:
    """(θ, φ) of a direction, θ in [0, π) by choice of its sense."""
    upper = direction if direction[1] > 0.0 or (direction[1] == 0.0 and direction[0] > 0.0) else -direction
    return np.array([np.arctan2(upper[1], upper[0]), np.arccos(np.clip(upper[2], -1.0, 1.0))])


def direction_of(angles: Floats) -> Floats:
    """The direction (θ, φ)."""
    t, p = angles
    return np.array([np.cos(t) * np.sin(p), np.sin(t) * np.sin(p), np.cos(p)])


def sectioned(
    vertices_mm: Floats,
    faces: Ints32,
    angles: Floats,
    *,
    tolerance_mm: float = TOLERANCE_MM,
    rounds: int = 5,
    seed: int = 0,
) -> Sectioned:
    """Test one orientation as section 3.2 does."""
    turn = turned_to_z(float(angles[0]), float(angles[1]))
    points, plane = sections(vertices_mm, faces, turn, planes=PLANES)
    state: Ints = np.array([1 + seed], dtype=np.int64)
    circles = fit_circles(points, plane, PLANES, tolerance_mm, rounds, False, False, state)
    return Sectioned(turn, points, plane, circles)
