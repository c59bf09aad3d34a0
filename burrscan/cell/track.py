"""Where a burr that is known to be there is in one look: by its light, or by a matched filter of its depths.

A detector must decide; a servo knows what it looks for and wants the place. The light tells it where it can
(:mod:`burrscan.cell.shade`). Where it does not, the deviations around the expected place are compared with a
hump of the burr's width, and the place is where such a hump explains most (the matched filter: North 1943;
Kay, Fundamentals of Statistical Signal Processing II, section 4.3). A flank that mirrors the part is measured
wrongly and says so by its standard deviations: it counts little.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.chart import line_of
from burrscan.cell.rim import Edge, Face, along_edge, edge_near, pose_over
from burrscan.cell.shade import PIECES, shade_centre, top_of
from burrscan.generatrix.deviation import feet_of
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Burr, Value
from burrscan.pipeline import Outcome
from burrscan.pose import placed
from burrscan.rig import Rig
from burrscan.sight import sight_of

_STEP_MM = 0.05
"""Between the places that are tried; between them the gain is a parabola."""
_STANDS_OUT = 5.0
"""Standard deviations of its height by which the burr must stand out."""
_CREST = 0.8
"""Quantile of the points over a burr's base that stands for its crest: most are on its flanks, and of a burr
that mirrors the part a third may lie as low as the part."""
_HIGH = 0.4
"""Share of the burr's height that it must reach (a thin flake is measured at six tenths): what stands out by
less is what a flank mirrors beside it."""
_LEAST = 12
"""Points near the place."""
_VAGUE = 0.25
"""Share of the burr's width to which its place must be known: else this is no view of it."""
_BOTH = 0.25
"""Of what one flank tells the other must tell at least: its points may be twice as uncertain."""
_ROUNDS = 3
"""Of the fit; from one to the next its noise is known better."""
_SYMMETRIC = 0.03
"""Largest share of the flanks' tilt in the rays' plane (10 degrees) for which both look alike."""
_NOT_YET_MM = 3.0
"""What may be farther off has not been found yet. Along an edge a burr is moved then only: where its few
points seem to end changes by a millimetre from look to look, and with it the normal of a round face, and the
mill goes on for as much behind its ends."""


@dataclass(frozen=True)
class Tracked:
    """A burr found again.

    Parameters
    ----------
    burr
        With its pose in the look's camera frame, on the fitted surface.
    across_sigma_mm
        Standard deviation of its place across its length.

    """

    burr: Burr
    across_sigma_mm: float


def tracked(
    outcome: Outcome, burr: Burr, T_camera_burr: Floats, *, rig: Rig, gate_mm: float, pixel_mm: float
) -> Tracked | None:
    """Where the burr is in this look; None where nothing stands out near its place.

    Parameters
    ----------
    outcome
        Of the look.
    burr
        As it was found: its side, width, length and height.
    T_camera_burr
        (4, 4) where it is expected.
    rig
        Of the scanner.
    gate_mm
        How far across and along it may be from there.
    pixel_mm
        What a pixel spans there: no hump looks narrower.

    Notes
    -----
    O(vertices × places tried). The pose lies on the fitted surface, its x in the sense of the one expected.
    A burr that goes around the axis is sought on an edge of the part; its z, as it is expected, says on which
    of the two faces.

    """
    surface, inspection = outcome.surface, outcome.inspection
    if line_of(T_part_mesh(inspection.axis.point_mm, inspection.axis.direction) @ T_camera_burr):
        return _over_edge(outcome, burr, T_camera_burr, gate_mm=gate_mm)
    local = placed(np.linalg.inv(T_camera_burr), surface.vertices_mm)
    deviation = burr.sign * inspection.deviation_mm
    width, half = burr.width_mm.value, 0.5 * burr.length_mm.value
    high = burr.height_mm.value
    near = np.isfinite(deviation) & (np.abs(local[:, 2]) < gate_mm + 2.0 * high)
    near &= np.abs(local[:, 0]) < half
    called = _called(inspection.burrs, burr, T_camera_burr, gate_mm)
    middle, reach = (0.0, gate_mm) if called is None else (called, 0.5 * width)
    near &= np.abs(local[:, 1] - middle) < 2.0 * reach + width
    if near.sum() < _LEAST:
        return None
    found = _shaded(outcome, burr, T_camera_burr, gate_mm, rig=rig, pixel_mm=pixel_mm)
    if found is None:
        hump = _Hump(
            local[near, 0], local[near, 1], deviation[near], surface.vertex_sigma_mm[near],
            half_mm=float(np.hypot(0.5 * width, 0.5 * pixel_mm)), middle_mm=middle, reach_mm=reach,
        )  # fmt: skip
        depth = hump.place(least_mm=_HIGH * high if called is None else 0.0)
        found = _known(depth, more_mm=0.5 * width * _aside(rig, T_camera_burr))
    if found is None or found.sigma > _VAGUE * width:
        return None
    across = found.value
    on_crest = np.isfinite(deviation) & (np.abs(local[:, 1] - across) < 0.5 * width)
    on_crest &= (np.abs(local[:, 0]) < half + gate_mm) & (np.abs(local[:, 2]) < gate_mm + 2.0 * high)
    along, length = _extent(local[on_crest, 0], deviation[on_crest], half, high)
    pose = _on_surface(outcome, T_camera_burr @ _shift(along, across))
    seen = replace(burr, T_mesh_burr=pose, length_mm=Value(length, burr.length_mm.sigma))
    return Tracked(seen, found.sigma)


def edge_now(outcome: Outcome, T_camera_burr: Floats, *, gate_mm: float) -> Floats | None:
    """(4, 4) a place on the part's edge in a look, camera frame; None where no edge is near.

    Parameters
    ----------
    outcome
        Of the look.
    T_camera_burr
        (4, 4) where on the edge, about; its x goes around the axis, its z is near the normal of a face.
    gate_mm
        How far off the edge it may be.

    """
    found = _edge(outcome, T_camera_burr, gate_mm)
    if found is None:
        return None
    T_part_camera, expected, edge, face = found
    return np.asarray(np.linalg.inv(T_part_camera) @ pose_over(edge, face, expected), float)


def _edge(
    outcome: Outcome, T_camera_burr: Floats, gate_mm: float
) -> tuple[Floats, Floats, Edge, Face] | None:
    """The part frame, the pose in it, the edge near that, and the face to whose normal its z is nearest."""
    axis, generatrix = outcome.inspection.axis, outcome.inspection.generatrix
    T_part_camera = T_part_mesh(axis.point_mm, axis.direction)
    expected = np.asarray(T_part_camera @ T_camera_burr, float)
    x, y, z = expected[:3, 3]
    place, outward = np.array([z, np.hypot(x, y)]), expected[:2, 2] @ [x, y] / np.hypot(x, y)
    edge = edge_near(generatrix, place, within_mm=gate_mm)
    if edge is None:
        return None
    face = max(edge.faces, key=lambda one: float(one.normal @ [expected[2, 2], outward]))
    return T_part_camera, expected, edge, face


def _over_edge(outcome: Outcome, burr: Burr, T_camera_burr: Floats, *, gate_mm: float) -> Tracked | None:
    """A burr that goes around the axis: it stands on an edge, which its faces tell (:mod:`.rim`)."""
    found, inspection = _edge(outcome, T_camera_burr, gate_mm), outcome.inspection
    if found is None:
        return None
    T_part_camera, expected, edge, face = found
    known = np.isfinite(inspection.deviation_mm)
    along = along_edge(
        edge,
        expected,
        placed(T_part_camera, outcome.surface.vertices_mm[known]),
        inspection.deviation_mm[known],
        outcome.surface.vertex_sigma_mm[known],
        high_mm=burr.height_mm.value,
        half_mm=0.5 * burr.length_mm.value,
        gate_mm=gate_mm,
    )
    if along is None:
        return None
    along = along if gate_mm > _NOT_YET_MM else 0.0
    pose = np.linalg.inv(T_part_camera) @ pose_over(edge, face, expected, along_mm=along)
    return Tracked(replace(burr, T_mesh_burr=np.asarray(pose, float)), edge.sigma_mm)


def _called(burrs: tuple[Burr, ...], wanted: Burr, T_camera_burr: Floats, gate_mm: float) -> float | None:
    """Where across the burr the detector calls one of its side, nearest to its place; None if it calls none.

    The detector has the light as well: it sees the burr where a flank that mirrors the part shows no height.
    """
    half = 0.5 * wanted.length_mm.value + gate_mm
    places = [
        (np.linalg.inv(T_camera_burr) @ one.T_mesh_burr)[:2, 3] for one in burrs if one.side == wanted.side
    ]
    across = [float(y) for x, y in places if abs(x) < half and abs(y) < gate_mm]
    return min(across, key=abs, default=None)


def _aside(rig: Rig, T_camera_burr: Floats) -> float:
    """Square of the sine between the baseline and the burr: the share of its flanks' tilt in a ray's plane.

    A flank that mirrors the part does so in the plane of camera, projector and point. Where that lies across
    the burr, one flank mirrors and the other does not, and the place is off by up to half the width.
    """
    baseline = T_camera_burr[:3, :2].T @ rig.projector_centre_mm
    return float(baseline[1] ** 2 / max(float(baseline @ baseline), 1e-12))


def _shaded(
    outcome: Outcome, burr: Burr, T_camera_burr: Floats, gate_mm: float, *, rig: Rig, pixel_mm: float
) -> Value | None:
    """Where the light has the burr; None where it does not tell."""
    sight = sight_of(outcome.scan.radiance, outcome.surface, rig)
    if sight is None or _aside(rig, T_camera_burr) > _SYMMETRIC:
        return None
    return shade_centre(
        sight, outcome.inspection, T_camera_burr, width_mm=burr.width_mm.value,
        length_mm=burr.length_mm.value, reach_mm=gate_mm, pixel_mm=pixel_mm,
    )  # fmt: skip


def _known(depth: Value | None, *, more_mm: float) -> Value | None:
    """A place with what it may be off by besides."""
    return None if depth is None else Value(depth.value, float(np.hypot(depth.sigma, more_mm)))


class _Hump:
    """A parabola of given width over a constant, fitted at every place across the burr at once."""

    def __init__(
        self, x: Floats, y: Floats, deviation: Floats, sigma: Floats, *,
        half_mm: float, middle_mm: float, reach_mm: float,
    ) -> None:  # fmt: skip
        self._places = middle_mm + np.arange(-reach_mm, reach_mm + 0.5 * _STEP_MM, _STEP_MM)
        self._shape = np.clip(1.0 - ((y - self._places[:, None]) / half_mm) ** 2, 0.0, None)
        self._y, self._deviation, self._sigma = y, deviation, sigma
        piece = np.floor(PIECES * (x - x.min()) / (np.ptp(x) + 1e-9))
        self._pieces = [piece == number for number in range(PIECES)]

    def place(self, *, least_mm: float) -> Value | None:
        """The place that explains most; None where that is no burr, or only one flank is measured well.

        A burr's hump is significant and higher than ``least_mm``.

        Its standard deviation is the jackknife's over pieces of the length (Efron & Tibshirani 1993, chapter
        11): what errs together errs in one of them. Points scatter by more than their stated noise where the
        burr is no parabola; what they scatter by beside it is added to all alike.
        """
        more = 0.0
        for _ in range(_ROUNDS):
            weight = 1.0 / (self._sigma**2 + more)
            number, at, height, level = self._best(weight)
            off = self._deviation - height * self._shape[number] - level
            chi2 = float((off**2 / self._sigma**2).sum())
            more = max(0.0, (chi2 - (len(off) - 3)) / float((1.0 / self._sigma**2).sum()))
        shape = self._shape[number]
        mean = float(weight @ shape / weight.sum())
        sigma = 1.0 / np.sqrt(float(weight @ (shape - mean) ** 2))
        if height < max(_STANDS_OUT * sigma, least_mm):
            return None
        if self._one_sided(number, weight):
            return None
        without = np.array([self._best(np.where(piece, 0.0, weight))[1] for piece in self._pieces])
        spread = (PIECES - 1) / PIECES * float(((without - without.mean()) ** 2).sum())
        return Value(at, float(np.sqrt(spread)))

    def _one_sided(self, number: int, weight: Floats) -> bool:
        """Whether nearly all that tells the place comes from one flank: the other's shape is a guess then."""
        # the hump falls by twice the distance from its middle: a point tells by that squared
        away = self._y - self._places[number]
        tells = np.where(self._shape[number] > 0.0, weight * away**2, 0.0)
        left, right = float(tells[away < 0.0].sum()), float(tells[away > 0.0].sum())
        return min(left, right) < _BOTH * max(left, right)

    def _best(self, weight: Floats) -> tuple[int, float, float, float]:
        """Number and place of the best hump, its height, and the constant under it."""
        total, shape, square = weight.sum(), self._shape @ weight, self._shape**2 @ weight
        data, both = weight @ self._deviation, self._shape @ (weight * self._deviation)
        spread = total * square - shape**2
        known = spread > 1e-9 * total**2
        height = np.where(known, (total * both - shape * data) / np.where(known, spread, 1.0), 0.0)
        gain = np.where(height > 0.0, height**2 * spread / total, 0.0)
        best = int(np.argmax(gain))
        at = float(self._places[best])
        if 0 < best < len(gain) - 1:
            at += _STEP_MM * top_of(gain, best)
        level = float((data - height[best] * shape[best]) / total)
        return best, at, float(height[best]), level


def _extent(x: Floats, deviation: Floats, half: float, high: float) -> tuple[float, float]:
    """Middle and length of the burr, by the stretch that stands out; as expected where that cannot be told.

    Of a burr that mirrors the part one look may show a piece; the looks from all around saw all of it. What
    stands out therefore makes it longer, never shorter: of a piece it is known that the burr reaches over it.
    Where hardly anything stands out, noise does, wherever the surface was measured.
    """
    inner = np.abs(x) < 0.5 * half
    crest = float(np.quantile(deviation[inner], _CREST)) if inner.any() else 0.0
    if len(x) < _LEAST or crest < _HIGH * high:
        return 0.0, 2.0 * half
    level = 0.5 * crest
    out = np.sort(x[deviation > level])
    if len(out) < _LEAST:
        return 0.0, 2.0 * half
    start, end = (float(one) for one in np.quantile(out, [0.02, 0.98]))
    if end - start >= 2.0 * half:
        return 0.5 * (start + end), end - start
    return float(np.clip(0.0, end - half, start + half)), 2.0 * half


def _shift(along: float, across: float) -> Floats:
    step = np.eye(4)
    step[:2, 3] = along, across
    return step


def _on_surface(outcome: Outcome, T_camera_burr: Floats) -> Floats:
    """The pose put down on the fitted surface: origin on it, z along its normal."""
    axis, generatrix = outcome.inspection.axis, outcome.inspection.generatrix
    frame = T_part_mesh(axis.point_mm, axis.direction)
    pose = frame @ T_camera_burr
    x, y, z = pose[:3, 3]
    angle = float(np.arctan2(y, x))
    line = polyline_of(generatrix)
    foot = feet_of(np.array([z]), np.array([np.hypot(x, y)]), line)
    if not foot.valid[0]:
        return T_camera_burr
    segment = foot.segment[0]
    at = line.places_mm(foot.segment, foot.t)[0]
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    # the normal over a burr's surroundings, not of one short segment
    beside = np.hypot(*(line.nodes_mm[line.starts] - at).T) < 2.0
    mean = line.lengths_mm[beside] @ line.normals[beside] if beside.any() else line.normals[segment]
    normal = (mean[1] * radial + mean[0] * np.array([0.0, 0.0, 1.0])) / np.linalg.norm(mean)
    along = pose[:3, 0] - (pose[:3, 0] @ normal) * normal
    along /= np.linalg.norm(along)
    on_curve = np.eye(4)
    on_curve[:3, :3] = np.stack([along, np.cross(normal, along), normal], axis=1)
    on_curve[:3, 3] = at[1] * radial + [0.0, 0.0, at[0]]
    return np.asarray(np.linalg.inv(frame) @ on_curve)
