"""How height, lean and thickness run along a burr, and where it is torn off: random processes by seed.

The process is stationary, Gaussian, of unit variance, with the Matérn 3/2 correlation
ρ(d) = (1 + λ d) exp(-λ d), λ = √3 / ℓ, that is the power spectrum S(k) = 4 λ³ / (λ² + k²)² over the angular
spatial frequency k (rad/mm): flat up to about 1 / ℓ, then falling as k⁻⁴. It has a slope everywhere and no
curvature, as a torn edge has (Matérn 1960; Rasmussen & Williams 2006, section 4.2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

from burrscan.arrays import Floats
from scenes.wheel.spec import AxialRidge, RimBurr, tip_thickness_mm

_KNOT_MM = 4.0
"""Between the random heights of a varying burr."""
_KNOTS = 8
"""Per correlation length, at which the process is drawn exactly; cubics in value and slope join them."""
_FLOOR = 0.02
"""Of the nominal height: the process has no lower end, and a burr of no height is a gap."""
_THINNEST = 0.3
"""Least thickness as a multiple of the nominal one."""
THICKEST = 2.0
"""Largest thickness as a multiple of the nominal one, and 0.3 the least: the process is cut off there."""
_STEEPEST_DEG = 60.0
"""The lean is cut off there: flatter, a burr would lie on the wheel and cut into it."""
_TORN_HEIGHT = 0.15
"""Share of the height left at a tear."""
_TEAR_MM = 0.4
"""Length over which the height falls towards a tear."""
_SHORTEST_MM = 0.2
"""Pieces and gaps shorter than that are none: a station's step of 0.25 mm would hardly show them."""
_STATIONS = 5
"""Per correlation length, so that straight lines between them follow the process."""
_STREAMS = {"height": 1, "lean": 2, "thickness": 3, "tears": 4}
"""Numbers of the seeds' streams: changing one changes every random burr."""

Stream = Literal["height", "lean", "thickness", "tears"]


@dataclass(frozen=True)
class Course:
    """A burr along its length.

    Parameters
    ----------
    heights_mm
        (N,) the largest exactly the burr's.
    leans_deg, widths_mm, tips_mm
        (N,) lean, thickness at the root and at the tip.

    """

    heights_mm: Floats
    leans_deg: Floats
    widths_mm: Floats
    tips_mm: Floats


def course_of(burr: AxialRidge | RimBurr, positions_mm: Floats, pieces_mm: Floats) -> Course:
    """The course of a burr at positions along it; O(N + length / correlation).

    Parameters
    ----------
    burr
        The specification.
    positions_mm
        (N,) ascending, from its start at 0 to its end.
    pieces_mm
        (P, 2) where there is material: :func:`whole_pieces`.

    """
    shares = varying_heights(positions_mm, height_mm=1.0, variation=burr.height_variation, seed=burr.seed)
    shares = shares * np.maximum(1.0 + burr.height_rms * _random(burr, "height", positions_mm), _FLOOR)
    shares = shares * _towards_tears(positions_mm, pieces_mm)
    thick = np.clip(1.0 + burr.thickness_rms * _random(burr, "thickness", positions_mm), _THINNEST, THICKEST)
    leans = burr.lean_deg + burr.lean_rms_deg * _random(burr, "lean", positions_mm)
    there = np.any([(positions_mm >= a) & (positions_mm <= b) for a, b in pieces_mm], axis=0)
    return Course(
        heights_mm=burr.height_mm * shares / shares[there].max(),
        leans_deg=np.clip(leans, -_STEEPEST_DEG, _STEEPEST_DEG),
        widths_mm=burr.width_mm * thick,
        tips_mm=tip_thickness_mm(burr) * thick,
    )


def station_step_mm(burr: AxialRidge | RimBurr, coarsest_mm: float) -> float:
    """How close stations must be to follow the burr's course."""
    random = burr.height_rms or burr.lean_rms_deg or burr.thickness_rms or burr.gap_share
    return min(coarsest_mm, burr.correlation_mm / _STATIONS) if random else coarsest_mm


def whole_pieces(burr: AxialRidge | RimBurr, length_mm: float) -> Floats:
    """(P, 2) start and end, along the burr, of what is not torn off.

    Torn off is the ``gap_share`` of the length where a process of its own is lowest; the two ends stay, so
    that the burr's extent is as written. Pieces and gaps shorter than 0.2 mm do not count.
    """
    if burr.gap_share == 0.0:
        return np.array([[0.0, length_mm]])
    count = int(np.ceil(length_mm / burr.correlation_mm * 4.0 * _KNOTS)) + 1
    positions = np.linspace(0.0, length_mm, count)
    from_end = np.minimum(positions, length_mm - positions)
    level = _random(burr, "tears", positions) + 6.0 * np.exp(-from_end / burr.correlation_mm)
    whole = level > np.quantile(level, burr.gap_share)
    whole[[0, -1]] = True
    edges = np.flatnonzero(np.diff(whole.astype(int)))
    limits = positions[edges] + (positions[1] - positions[0]) / 2.0
    gaps = limits.reshape(-1, 2)
    gaps = gaps[gaps[:, 1] - gaps[:, 0] > _SHORTEST_MM]
    pieces = np.concatenate([[0.0], gaps.ravel(), [length_mm]]).reshape(-1, 2)
    return np.asarray(pieces[pieces[:, 1] - pieces[:, 0] > _SHORTEST_MM])


def random_course(positions_mm: Floats, *, correlation_mm: float, seed: tuple[int, ...]) -> Floats:
    """(N,) the process of this module at ascending positions from 0 on; the same seed, the same course.

    Value and slope are drawn exactly at knots an eighth of the correlation length apart, as a Markov chain in
    both (Hartikainen & Särkkä 2010), and joined by cubics.
    """
    step = correlation_mm / _KNOTS
    knots = np.arange(int(np.ceil(float(positions_mm[-1]) / step)) + 2) * step
    decay = np.sqrt(3.0) / correlation_mm
    forward = np.exp(-decay * step) * np.array(
        [[1.0 + decay * step, step], [-(decay**2) * step, 1.0 - decay * step]]
    )
    spread = np.diag([1.0, decay**2])
    noise = np.linalg.cholesky(spread - forward @ spread @ forward.T)
    drawn = np.random.default_rng(seed).standard_normal((len(knots), 2))
    states = np.empty_like(drawn)
    states[0] = np.sqrt(np.diag(spread)) * drawn[0]
    for i in range(1, len(knots)):
        states[i] = forward @ states[i - 1] + noise @ drawn[i]
    return np.asarray(CubicHermiteSpline(knots, states[:, 0], states[:, 1])(positions_mm))


def varying_heights(positions_mm: Floats, *, height_mm: float, variation: float, seed: int) -> Floats:
    """(N,) heights along a burr: smooth, pseudo-random, the largest exactly ``height_mm``.

    Random knots 4 mm apart, joined monotonically (Fritsch & Carlson 1980), fill the span from
    ``height_mm * (1 - variation)`` to ``height_mm``.
    """
    span = float(positions_mm[-1] - positions_mm[0])
    knots = max(4, int(np.ceil(span / _KNOT_MM)) + 1)
    values = np.random.default_rng(seed).uniform(size=knots)
    course = PchipInterpolator(np.linspace(positions_mm[0], positions_mm[-1], knots), values)(positions_mm)
    course = (course - course.min()) / max(float(np.ptp(course)), 1e-12)
    course = course if variation > 0.0 else np.ones_like(course)
    return np.asarray(height_mm * (1.0 - variation * (1.0 - course)))


def _random(burr: AxialRidge | RimBurr, stream: Stream, positions_mm: Floats) -> Floats:
    seed = (burr.seed, _STREAMS[stream])
    return random_course(positions_mm, correlation_mm=burr.correlation_mm, seed=seed)


def _towards_tears(positions_mm: Floats, pieces_mm: Floats) -> Floats:
    """(N,) share of the height that is left: it falls to 15 % over the last 0.4 mm before a tear."""
    tears = np.concatenate([pieces_mm[1:, 0], pieces_mm[:-1, 1]])
    if not len(tears):
        return np.ones_like(positions_mm)
    away = np.abs(positions_mm[:, None] - tears).min(axis=1)
    return np.asarray(np.minimum(_TORN_HEIGHT + (1.0 - _TORN_HEIGHT) * away / _TEAR_MM, 1.0))
