"""What of a part one pose of the scanner would show, by its shape alone, and how the light would fall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, freeze
from burrscan.cell.chart import Chart
from burrscan.pose import placed
from burrscan.rig import Rig

STEEPEST_DEG = 83.0
"""Surfaces seen or lit under more than this are not counted on. Of cells in sight 79 to 97 % of the points
were measured in every step of angles up to this, on ground, turned and polished metal, then 59 and 45 % (15
rendered looks of two wheels)."""
ASIDE_DEG = 30.0
"""Seen from farther aside, across its line, a burr hides its other flank, which is as steep as 60 degrees and
measured by what it mirrors well before: heights of such looks were two or three times too large."""
_SHOWN_DEG = (55.0, 90.0), (45.0, 75.0)
"""Up to the first, across its line, a burr is called where it is measured, from the second on not: with the
baseline along it, and across it. Of 484 rendered burrs along 0.99 were called up to 55 degrees, then 0.92,
0.69 and 0.19 in steps of ten; of 90 across all up to 45, then 0.75, 0.58, 0.17 and none (27 cells of three
wheels)."""


@dataclass(frozen=True)
class Outlook:
    """Of each cell of a :class:`Chart`, (S, N) for N cells around.

    Parameters
    ----------
    seen
        Whether camera and projector both reach it.
    tilt_deg
        Angle between its normal and the middle of the directions to camera and projector: where it is zero,
        the cell mirrors the projector into the camera.
    slope_deg
        Angle between its normal and the camera.
    shows
        (2, S, N) probability that a burr on metal that is measured there is called, less what no look finds:
        one along the generatrix, and one around the axis.
    along
        (2, S, N) whether the baseline lies along such a burr rather than across it.
    faces
        (2, S, N) whether it faces a burr there that lies along the generatrix, or around the axis: sees both
        of its flanks (:func:`facing`).

    """

    seen: Bools
    tilt_deg: Floats
    slope_deg: Floats
    shows: Floats
    along: Bools
    faces: Bools

    def __post_init__(self) -> None:
        freeze(self, seen=self.seen, tilt_deg=self.tilt_deg, slope_deg=self.slope_deg)
        freeze(self, shows=self.shows, along=self.along, faces=self.faces)


def outlook(chart: Chart, rig: Rig, T_camera_part: Floats, angles: Floats) -> Outlook:
    """What a pose shows of the cells at ``angles`` (N,), radians."""
    return leaning(chart, rig, T_camera_part, angles, leans_deg=(0.0,))[0]


def leaning(
    chart: Chart, rig: Rig, T_camera_part: Floats, angles: Floats, *, leans_deg: Sequence[float]
) -> tuple[Outlook, ...]:
    """What a pose shows of flanks that stand on the cells.

    Parameters
    ----------
    chart, rig, T_camera_part
        The part, the scanner, and the pose.
    angles
        (N,) of cells around the axis, radians.
    leans_deg
        Of flanks: their normals are the surface's, leant over towards growing angles by so much.

    Notes
    -----
    O(S² N), once for all flanks: each ray meets the frusta of all cells. A cell counts as its chord's middle.

    """
    points, upright = chart.points_mm(angles), chart.normals(angles)
    around = np.stack([-np.sin(angles), np.cos(angles), np.zeros_like(angles)], axis=1)[None]
    normals = [np.cos(lean) * upright + np.sin(lean) * around for lean in np.radians(leans_deg)]
    seen_by = placed(T_camera_part, points)
    eyes = rig.centres_mm(np.linalg.inv(T_camera_part))
    ways = [eye - points for eye in eyes]
    ways = [way / np.linalg.norm(way, axis=-1, keepdims=True) for way in ways]
    cosines = [[(way * normal).sum(axis=-1) for way in ways] for normal in normals]
    not_steep = [np.minimum(*each) > np.cos(np.radians(STEEPEST_DEG)) for each in cosines]
    free = np.any(not_steep, axis=0)
    free &= _inside(rig.camera.project(seen_by), rig.camera.shape)
    free &= _inside(rig.correspond(seen_by), rig.projector.shape)
    for eye in eyes:
        free[free] = chart.between(free, angles, eye) < 0
    half = ways[0] + ways[1]
    half /= np.linalg.norm(half, axis=-1, keepdims=True)
    lines = np.broadcast_to(around, upright.shape), np.cross(upright, around)
    over, baseline = (ways[0] * upright).sum(axis=-1), eyes[1] - eyes[0]
    away = [(ways[0] * line).sum(axis=-1) for line in lines]
    around_mm, along_mm = (np.abs(line @ baseline) for line in lines)
    aside, along = aside_deg(over, np.stack(away)), np.stack([along_mm >= around_mm, around_mm >= along_mm])
    shows, faces = _shown(aside, along), facing(aside, along)
    return tuple(
        Outlook(free & fair, _degrees((half * normal).sum(axis=-1)), _degrees(cosine[0]), shows, along, faces)
        for fair, normal, cosine in zip(not_steep, normals, cosines, strict=True)
    )


def _shown(aside: Floats, along: Bools) -> Floats:
    lengthways, crossways = (np.interp(aside, ends, (1.0, 0.0)) for ends in _SHOWN_DEG)
    return np.where(along, lengthways, crossways)


def aside_deg(over: Floats, across: Floats) -> Floats:
    """Angle between the surface's normal and the way to the camera, as it lies across a burr's line."""
    return np.asarray(np.degrees(np.arctan2(np.abs(across), over)))


def facing(aside: Floats, along: Bools) -> Bools:
    """Whether a look sees both flanks of a burr, and neither by what it mirrors.

    Parameters
    ----------
    aside
        :func:`aside_deg` of the look.
    along
        Whether the baseline lies along the burr: a flank mirrors the part inside the plane of the baseline
        and the ray, where nothing tells the mirrored light from its own.

    """
    return np.asarray((aside <= ASIDE_DEG) & along)


def _inside(pixels: Floats, shape: tuple[int, int]) -> Bools:
    u, v = pixels[..., 0], pixels[..., 1]
    with np.errstate(invalid="ignore"):
        return np.asarray((u >= 0) & (v >= 0) & (u <= shape[1] - 1) & (v <= shape[0] - 1))


def _degrees(cosine: Floats) -> Floats:
    return np.asarray(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))))
