"""Does something stand there, or is it missing, and how high? Ridges and nicks laid beside what the scan saw.

Both are dark on metal, and both show depths above and below the surface, for light bounces: a ridge's flank
mirrors the wheel beside it, a nick's walls mirror each other. What tells them apart is which flank is bright,
where light comes from that bounced, and what hides what: :mod:`burrscan.burrs.light.section` has all of it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Ints, freeze
from burrscan.axis.basis import perpendicular_basis
from burrscan.burrs.light.medians import column_medians, measured_share
from burrscan.burrs.light.section import BOUNCE_TILTS_DEG, TILTS_DEG, misfits
from burrscan.burrs.light.unrolled import Unrolled
from burrscan.inspection import Value
from burrscan.turns import turn_deg, turn_rad

_BESIDE_MM = 2.0
"""What is compared reaches so far beyond the place: there the light of its flanks is mirrored."""
_CENTRES = 9
"""Places of the burr that are tried, over the width of what is disturbed: about a cell apart."""
_NARROWEST = 1.5
"""Cells: the narrowest burr that is tried, to the widest that is looked for."""
_WIDTHS = 6
"""Tried, each about a third wider than the last."""
_ASPECTS = np.geomspace(0.12, 1.2, 8)
"""Heights over widths that are tried for a side: flanks of 13 to 67 degrees."""
_BEYOND = 2
"""More of them on either end, 7 to 78 degrees, for heights that were measured. They tell nothing of the side:
so steep a nick explains nearly everything."""
_NEAR = 1.2
"""A height is as tried as those within this factor: half a step of the aspects."""
_ROUGHER_DEG = (0.0, 10.0, 25.0)
"""Widenings of the flanks' lobe: as the wheel, as what was torn or cut coarsely, and nearly matt."""
_DEPTH_SIGMA = 0.6
"""Error of the model's depth, in cells: a pixel sees that much to both sides of an edge."""
_CONTRADICTS = 4.0
"""Difference of the misfits from which a height is contradicted: a likelihood ratio of two
standard deviations."""


@dataclass(frozen=True)
class Looks:
    """What the scan saw of the unrolled surface, each (rows, columns).

    Parameters
    ----------
    light, predicted
        Logarithm of the light, NaN where it is not known, and what its parallel tells of it.
    deviation_mm
        Depth off the surface, NaN where nothing was measured.

    """

    light: Floats
    predicted: Floats
    deviation_mm: Floats

    def __post_init__(self) -> None:
        freeze(self, light=self.light, predicted=self.predicted, deviation_mm=self.deviation_mm)


@dataclass(frozen=True)
class Told:
    """What ridges and nicks of many widths and heights make of a place.

    Parameters
    ----------
    widths_mm, aspects
        (W,) widths and (A,) heights over widths; the first and last two tell nothing of the side.
    misfits
        (2, W, A) of ridges and of nicks, at the best centre and roughness of each: sums of squares, in
        standard deviations.
    centres_rad
        (C,) angles of their middles, evenly spaced, part frame.
    at
        (2, C) misfits at the best width, aspect and roughness of each centre.

    """

    widths_mm: Floats
    aspects: Floats
    misfits: Floats
    centres_rad: Floats
    at: Floats

    def __post_init__(self) -> None:
        freeze(self, widths_mm=self.widths_mm, aspects=self.aspects, misfits=self.misfits)
        freeze(self, centres_rad=self.centres_rad, at=self.at)

    @property
    def ridge_over_nick(self) -> float:
        """By how much a ridge explains a place better than a nick: difference of the misfits."""
        ridge, nick = self.misfits[:, :, _BEYOND:-_BEYOND].min(axis=(1, 2))
        return float(nick - ridge)

    def angle_rad(self, *, side: int, depth: Value | None = None) -> Value:
        """Mean angle over the burrs of a side, each as likely as it explains the place.

        ``depth`` is where its depth shows it, and to which error. What lies between two centres that are
        tried counts as an error, too.
        """
        misfits = self.at[int(side < 0)]
        if depth is not None:
            misfits = misfits + turn_rad(self.centres_rad - depth.value) ** 2 / depth.sigma**2
        likely = np.exp(-0.5 * (misfits - misfits.min()))
        mean = float(likely @ self.centres_rad / likely.sum())
        spread = float(np.sqrt(likely @ (self.centres_rad - mean) ** 2 / likely.sum()))
        step = float(self.centres_rad[1] - self.centres_rad[0]) / np.sqrt(12.0)
        return Value(mean, float(np.hypot(spread, step)))

    def contradicts(self, height_mm: float, *, side: int) -> bool:
        """Whether burrs of that side and height explain the place clearly worse than others of that side."""
        misfits = self.misfits[int(side < 0)]
        heights = self.widths_mm[:, None] * self.aspects
        like = np.abs(np.log(heights / height_mm)) <= np.log(_NEAR)
        return bool(misfits[like].min(initial=np.inf) - misfits.min() >= _CONTRADICTS)

    def height(self, *, side: int) -> Value:
        """Mean height over the burrs of a side, each as likely as it explains the place; mm.

        Of widths and of heights over widths nothing is held beforehand: they are even in their logarithms.
        What lies between two aspects that are tried counts as an error, too.
        """
        misfits = self.misfits[int(side < 0)]
        likely = np.exp(-0.5 * (misfits - misfits.min()))
        heights = self.widths_mm[:, None] * self.aspects
        mean = float((likely * heights).sum() / likely.sum())
        spread = float(np.sqrt((likely * (heights - mean) ** 2).sum() / likely.sum()))
        step = float(np.log(self.aspects[1] / self.aspects[0])) / np.sqrt(12.0)
        return Value(mean, float(np.hypot(spread, step * mean)))


def told_of(cells: Bools, looks: Looks, surface: Unrolled, *, widest_mm: float) -> Told | None:
    """Lay ridges and nicks beside a place; None where that cannot be done.

    Only for places that run along the axis. O(hypotheses · columns of the place · bounces), 0.2 s.
    """
    rows, columns = np.nonzero(cells)
    used = np.unique(rows)
    middle = int(np.median(rows))
    r = float(surface.r_mm[middle])
    turn = float(surface.angle[1] - surface.angle[0])
    across = (int(columns.max()) - int(columns.min()) + 1) * turn * r
    if across > len(used) * surface.step_mm:
        return None
    beside = int(_BESIDE_MM / (turn * r)) + 1
    near = slice(max(int(columns.min()) - beside, 0), int(columns.max()) + beside + 1)
    parallel = column_medians(looks.predicted[used])
    tilt = tilts_deg(surface, np.array([middle]))[0]
    lobe = _lobe(tilt, parallel)
    if lobe is None:
        return None
    measured = measured_share(looks.deviation_mm[used, near])
    at = 0.5 * (surface.angle[columns.max()] + surface.angle[columns.min()])
    centres = at + np.linspace(-0.5, 0.5, _CENTRES) * across / r
    widths = np.geomspace(
        _NARROWEST * surface.step_mm, max(widest_mm, 2.0 * _NARROWEST * surface.step_mm, across), _WIDTHS
    )
    step, more = _ASPECTS[1] / _ASPECTS[0], np.arange(1, _BEYOND + 1)
    aspects = np.concatenate([_ASPECTS[0] * step ** -more[::-1], _ASPECTS, _ASPECTS[-1] * step**more])
    best = np.full((2, len(widths), len(aspects)), np.inf)
    there = np.full((2, _CENTRES), np.inf)
    for rougher in _ROUGHER_DEG:
        lobes, bounces = _materials(lobe, rougher)
        sized, placed = misfits(
            surface.angle[near],
            column_medians(looks.light[used, near]),
            column_medians(looks.deviation_mm[used, near]),
            measured,
            r,
            centres,
            widths,
            aspects,
            lobes,
            bounces,
            0.5 * float(lobe.min()),
            surface.camera_mm - (0.0, 0.0, surface.z_mm[middle]),
            surface.projector_mm - (0.0, 0.0, surface.z_mm[middle]),
            perpendicular_basis(surface.columns),
            _DEPTH_SIGMA * surface.step_mm,
        )
        best, there = np.minimum(best, sized), np.minimum(there, placed)
    return Told(widths, aspects, best, centres, there)


def tilts_deg(surface: Unrolled, rows: Ints) -> Floats:
    """(rows, columns) degrees from the half-way direction to the normal of some rows, square to the axis."""
    angle, r, z = surface.angle, surface.r_mm[rows, None], surface.z_mm[rows, None]
    x, y, z = np.broadcast_arrays(r * np.cos(angle), r * np.sin(angle), z)
    points = np.stack([x, y, z], axis=-1)
    towards = [centre - points for centre in (surface.camera_mm, surface.projector_mm)]
    half = sum(one / np.linalg.norm(one, axis=-1, keepdims=True) for one in towards)
    return turn_deg(np.degrees(angle - np.arctan2(half[..., 1], half[..., 0])))


def _lobe(tilt: Floats, brightness: Floats) -> Floats | None:
    """(181,) light over the tilt: what is not seen on one side is as on the other, beyond both as at the end.

    None where nothing is known.
    """
    known = np.isfinite(brightness)
    if not known.any():
        return None
    order = np.argsort(tilt[known])
    table = np.interp(TILTS_DEG, tilt[known][order], brightness[known][order], left=np.nan, right=np.nan)
    table = np.where(np.isfinite(table), table, table[::-1])
    there = np.isfinite(table)
    return np.exp(np.interp(TILTS_DEG, TILTS_DEG[there], table[there])) if there.any() else None


def _materials(lobe: Floats, rougher_deg: float) -> tuple[Floats, Floats]:
    """Lobes (2, 181) and shares of bounces (2, 21) of the wheel and of flanks that are so much rougher."""
    mirrored = np.interp(BOUNCE_TILTS_DEG, TILTS_DEG, lobe)
    # what does not change with the tilt is diffuse, and mirrors nothing
    mirrored = np.maximum(mirrored - lobe.min(), 1e-9 * lobe.max())
    flank, bounced = lobe, mirrored
    if rougher_deg > 0.0:
        flank = ndimage.gaussian_filter1d(lobe, rougher_deg / (TILTS_DEG[1] - TILTS_DEG[0]), mode="nearest")
        cells = rougher_deg / (BOUNCE_TILTS_DEG[1] - BOUNCE_TILTS_DEG[0])
        bounced = ndimage.gaussian_filter1d(mirrored, cells, mode="constant")
    return np.stack([lobe, flank]), np.stack([mirrored / mirrored.sum(), bounced / bounced.sum()])
