"""From a burr to the path of a mill that takes it off."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import ndtri

from burrscan.arrays import Bools, Floats, Ints, freeze
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.chart import line_of, walked
from burrscan.errors import InputError
from burrscan.generatrix.deviation import feet_of
from burrscan.generatrix.polyline import Foot, Polyline, polyline_of, turned
from burrscan.inspection import Axis, Burr, Generatrix

_STEP_MM = 1.0
"""Between stations along the burr."""
_OVERRUN_MM = 1.0
"""The mill goes on for so long behind both ends of the burr, whose extent is known to about as much."""
_UNDER_MM, _UNDER_SIGMAS = 0.03, 2.0
"""How far the mill's rim may reach under the fitted surface, and by how much more where that is not known so
well: beside a step, it stays away from the wall."""
_RIDES_MM = 0.05
"""How far the mill is lifted at most over what it would cut there, which leaves as much of the burr: a curve
fitted around a sharp edge stands 0.05 to 0.07 mm over it, and stated 0.006."""
_LIFTS = 3
"""A lifted rim is nearest to another place of the curve; the third lift is a hundredth of the first."""
_ROUNDING_MM = 1e-3
"""What is cut no deeper is not cut."""
_RIM = 16
"""Places on the mill's rim that are tried."""
_LANE = 1.5
"""Distance of neighbouring lanes in radii of the mill: they overlap by a quarter of it."""
_LINK_MM = 0.5
"""Between places on the way from lane to lane: straight on, the mill would go through a round part."""
_ON_FACE, _FLAT_MM, _REFITS = 5.0, 1e-3, 3
"""Times the median distance from the face, and at least so much of it, within which a place lies on it, and
how often the face is fitted to those: the first one leans by a segment's noise."""
_LAST_PASSES = 2
"""At the surface: the second cuts what the mill gave way to in the first."""
_RIGID = 0.5
"""Share of what a rigid mill would cut deeper in its deepest pose. A mill on an arm gives way (200 to 1000
N/mm): at 500 and poses that scatter by 0.027 mm it gouges 0.022 mm where a rigid one does 0.050. Which it is
is not known here, and half is wrong by half at most."""
_PIECES = 8.0
"""Of the curve, to a radius of the mill, that say how the mill stands on it."""


@dataclass(frozen=True)
class ToolPath:
    """A path over one burr, in whatever frame the burr was given in.

    Parameters
    ----------
    stations
        (N, 4, 4) poses of the tool along the final pass: origin in the middle of the mill's end, z out of
        the part, x along the feed. Lanes follow each other, every other one backwards.
    lane
        (N,) number of the lane.
    passes_mm
        Heights over the surface at which the stations are gone through, the last two alike.
    approach_mm
        Height over the surface from which the mill comes and to which it retreats.
    feed_mm_s
        Along the path.
    covered
        Share of the burr's length that the mill reaches; walls beside it may keep it away from an end.

    """

    stations: Floats
    lane: Ints
    passes_mm: tuple[float, ...]
    approach_mm: float
    feed_mm_s: float
    covered: float

    def __post_init__(self) -> None:
        freeze(self, stations=self.stations, lane=self.lane)

    def placed(self, T: Floats) -> ToolPath:
        """The path in another frame, by (4, 4) from its own."""
        return replace(self, stations=T @ self.stations)

    def above(self, station: int) -> Floats:
        """(4, 4) the mill over a station, at the height of approach and retreat."""
        return lift(self.stations[station], self.approach_mm)

    def travel(self) -> Iterator[tuple[int, Floats]]:
        """Number of the pass and (4, 4) pose, in order; every other pass backwards, so that none is idle."""
        for number, height in enumerate(self.passes_mm):
            for pose in self.stations if number % 2 == 0 else self.stations[::-1]:
                yield number, lift(pose, height)

    @property
    def last(self) -> int:
        """The station at which the last pass ends."""
        return -1 if len(self.passes_mm) % 2 else 0


def lift(pose: Floats, height_mm: float) -> Floats:
    """(4, 4) a pose moved along its own z."""
    lifted = np.array(pose)
    lifted[:3, 3] += height_mm * pose[:3, 2]
    return lifted


def tool_path(
    burr: Burr,
    *,
    axis: Axis,
    generatrix: Generatrix,
    radius_mm: float,
    scatter_mm: float = 0.0,
    bite_mm: float = 0.4,
    approach_mm: float = 20.0,
    feed_mm_s: float = 10.0,
) -> ToolPath:
    """The path that takes a burr off down to the fitted surface.

    The path keeps the distance from the surface that the burr's origin has, usually none: several looks may
    know better where the surface is than the one that ``generatrix`` is of. Its last passes stay over that by
    half of what the deepest of the poses that cut a place is expected to be deeper than their mean.

    Parameters
    ----------
    burr
        A protrusion, its pose in the frame of ``axis``.
    axis, generatrix
        Of the part.
    radius_mm
        Of the mill.
    scatter_mm
        Standard deviation of the mill's poses along its axis (:attr:`.station.Station.plunge_mm`).
    bite_mm
        Height of metal that one pass takes.
    approach_mm, feed_mm_s
        As in :class:`ToolPath`.

    Raises
    ------
    InputError
        For a nick, which no mill puts right, a burr without a pose, and one that the mill cannot reach.

    Notes
    -----
    O(stations × generatrix).

    """
    if burr.side != "protrusion":
        raise InputError("a nick is metal that is missing: a mill takes off protrusions only")
    if not np.isfinite(burr.T_mesh_burr).all():
        raise InputError("the burr has no pose (T_mesh_burr): choose a burr method that states one")
    frame = T_part_mesh(axis.point_mm, axis.direction)
    line = polyline_of(generatrix)
    T_part_burr = frame @ burr.T_mesh_burr
    half = 0.5 * burr.length_mm.value + _OVERRUN_MM
    along = np.linspace(-half, half, max(2, int(np.ceil(2.0 * half / _STEP_MM)) + 1))
    ways: list[Floats] = []
    lanes, reached = [], np.zeros(len(along), np.bool_)
    for number, across in enumerate(_lanes(burr, radius_mm)):
        lane = np.full(len(along), across)
        free = _longest(_standing(T_part_burr, line, generatrix, along, lane, radius_mm)[1])
        reached |= free
        way = np.stack([along, lane], axis=1)[free]
        way = way if number % 2 == 0 else way[::-1]
        if ways and len(way) and len(ways[-1]):
            way = np.concatenate([_link(ways[-1][-1], way[0]), way])
        ways.append(way)
        lanes.append(np.full(len(way), number))
    way = np.concatenate(ways)
    found, free = _standing(T_part_burr, line, generatrix, way[:, 0], way[:, 1], radius_mm)
    found, numbers = found[free], np.concatenate(lanes)[free]
    if len(found) < 2:
        raise InputError(
            f"a mill of {radius_mm:g} mm radius reaches the burr nowhere without cutting the part: take a "
            "smaller one"
        )
    found[:, :3, 3] += _over(T_part_burr, line, radius_mm) * found[:, :3, 2]
    back = np.linalg.inv(frame)
    on_burr = np.abs(along) <= half - _OVERRUN_MM
    return ToolPath(
        stations=back @ found,
        lane=numbers,
        passes_mm=_passes(burr, bite_mm, _RIGID * _deepest(len(ways), radius_mm) * scatter_mm),
        approach_mm=approach_mm,
        feed_mm_s=feed_mm_s,
        covered=float(reached[on_burr].mean()) if on_burr.any() else 0.0,
    )


def _passes(burr: Burr, bite_mm: float, last_mm: float) -> tuple[float, ...]:
    """Heights of the passes: down to the last one in bites, and once more."""
    high = burr.height_mm.value + 2.0 * (burr.height_mm.sigma if np.isfinite(burr.height_mm.sigma) else 0.0)
    steps = max(1, int(np.ceil((high - last_mm) / bite_mm)))
    down = np.linspace(max(high, last_mm), last_mm, steps + 1)[1:]
    return (*down.tolist(), *[last_mm] * (_LAST_PASSES - 1))


def _deepest(lanes: int, radius_mm: float) -> float:
    """How much deeper the deepest of the poses that cut a place is than their mean, in standard deviations.

    The expected largest of n normal numbers (Blom 1958), n the poses of the last passes whose mill covers it.
    """
    width = 2.0 * radius_mm if lanes == 1 else _LANE * radius_mm
    count = max(_LAST_PASSES * np.pi * radius_mm**2 / (_STEP_MM * width), 1.0)
    return float(ndtri((count - 0.375) / (count + 0.25)))


def _lanes(burr: Burr, radius_mm: float) -> Floats:
    """Offsets across the burr, mm: enough lanes for its base and for what leans over it."""
    wide = burr.width_mm.value + burr.height_mm.value
    count = max(1, int(np.ceil(wide / (_LANE * radius_mm))))
    return np.asarray((np.arange(count) - 0.5 * (count - 1)) * _LANE * radius_mm, float)


def _longest(free: Bools) -> Bools:
    """The longest stretch of free stations: between two of them there may be a wall."""
    ends = np.flatnonzero(np.diff(np.concatenate([[False], free, [False]])))
    starts, stops = ends[::2], ends[1::2]
    kept = np.zeros_like(free)
    if len(starts):
        longest = int(np.argmax(stops - starts))
        kept[starts[longest] : stops[longest]] = True
    return kept


def _link(here: Floats, there: Floats) -> Floats:
    """(N, 2) places between the end of a lane and the start of the next, both left out.

    Around the part: the way straight across would go through it.
    """
    count = max(1, int(np.ceil(float(np.linalg.norm(there - here)) / _LINK_MM)))
    share = np.arange(1, count)[:, None] / count
    return np.asarray(here + share * (there - here), float)


def _standing(
    T_part_burr: Floats,
    line: Polyline,
    generatrix: Generatrix,
    along: Floats,
    across: Floats,
    radius_mm: float,
) -> tuple[Floats, Bools]:
    """(N, 4, 4) poses of the mill on (N,) places along and across the burr, and where it cuts no wall.

    Where it leans over an edge, so that it would cut more under its face than what a curve that bulges makes
    it cut everywhere, it goes straight on instead. Over what the curve is off by, at a sharp edge say, the
    mill rides; of a wall no lifting clears it.
    """
    poses, on_part = _stations(T_part_burr, line, along, across, radius_mm)
    if not on_part.any():
        return poses, on_part
    under_mm = _cuts_mm(poses, line, generatrix, 0.5 * radius_mm)
    leans = under_mm - np.median(under_mm[on_part]) > _UNDER_MM
    if leans.any():
        poses = np.where(leans[:, None, None], _straight_on(poses, on_part & ~leans), poses)
    cuts_mm = _cuts_mm(poses, line, generatrix, radius_mm)
    lifted_mm = np.zeros_like(cuts_mm)
    for _ in range(_LIFTS):
        if not cuts_mm.any():
            break
        poses[:, :3, 3] += cuts_mm[:, None] * poses[:, :3, 2]
        lifted_mm += cuts_mm
        cuts_mm = _cuts_mm(poses, line, generatrix, radius_mm)
    return poses, on_part & (cuts_mm <= _ROUNDING_MM) & (lifted_mm <= _RIDES_MM)


def _straight_on(poses: Floats, stands: Bools) -> Floats:
    """(N, 4, 4) the mill at the same places, but on the plane of the nearest of those where it ``stands``.

    At a sharp edge the curve falls off, and a mill that leant with it would cut the edge.
    """
    places = poses[:, :3, 3]
    known = np.flatnonzero(stands)
    like = poses[known[cKDTree(places[known]).query(places)[1]]]
    over = ((places - like[:, :3, 3]) * like[:, :3, 2]).sum(axis=1)
    like[:, :3, 3] = places - over[:, None] * like[:, :3, 2]
    return like


def _stations(
    T_part_burr: Floats,
    line: Polyline,
    along: Floats,
    across: Floats,
    radius_mm: float,
) -> tuple[Floats, Bools]:
    """(N, 4, 4) on the surface, the burr's own line followed along the meridian and around the axis.

    And (N,) whether there is a surface.
    """
    x, y = T_part_burr[:2, 3]
    angle = float(np.arctan2(y, x))
    radial = np.array([np.cos(angle), np.sin(angle), 0.0])
    around = np.array([-np.sin(angle), np.cos(angle), 0.0])
    places = walked(T_part_burr, along, across)
    angles = np.arctan2(places[:, 1], places[:, 0])
    at = np.stack([places[:, 2], np.hypot(places[:, 0], places[:, 1])], axis=1)
    if line_of(T_part_burr):  # it stands on an edge, and its pose is that of the face on which the mill lies
        on_part = np.ones(len(at), np.bool_)
        normal = np.broadcast_to([T_part_burr[2, 2], T_part_burr[:3, 2] @ radial], at.shape)
    else:
        foot = feet_of(at[:, 0], at[:, 1], line)
        on_part = foot.valid
        at, normal = _levelled(line, foot, radius_mm)
    cosine, sine = np.cos(angles), np.sin(angles)
    tangent = np.stack([-sine, cosine, np.zeros_like(sine)], axis=1)
    feed = (T_part_burr[:3, 0] @ around) * tangent + T_part_burr[2, 0] * np.array([0.0, 0.0, 1.0])
    feed = feed + (T_part_burr[:3, 0] @ radial) * np.cross(tangent, [0.0, 0.0, 1.0])
    return _poses(turned(at, angles), turned(normal, angles), feed), on_part


def _over(T_part_burr: Floats, line: Polyline, radius_mm: float) -> float:
    """Distance of the burr's origin from the face that the mill stands on there; 0 where there is none.

    And 0 on an edge, where the mill stands on the burr's own plane.
    """
    if line_of(T_part_burr):
        return 0.0
    x, y, z = T_part_burr[:3, 3]
    place = np.array([[z, np.hypot(x, y)]])
    foot = feet_of(place[:, 0], place[:, 1], line)
    if not foot.valid[0]:
        return 0.0
    at, normal = _levelled(line, foot, radius_mm)
    return float((place[0] - at[0]) @ normal[0])


def _levelled(line: Polyline, foot: Foot, radius_mm: float) -> tuple[Floats, Floats]:
    """(N, 2) places on the curve and (N, 2) normals as a mill feels them: a line over its own width.

    The mean normal of the longer of two faces at a corner, by the median; then the line through what lies on
    it, for one segment leans by its noise. O(N), some ten places each.
    """
    middles, segment = line.every(radius_mm / _PIECES)
    at = line.places_mm(foot.segment, foot.t)
    normals = np.empty_like(at)
    for station, place in enumerate(at):
        near = np.hypot(*(middles - place).T) <= radius_mm
        offsets, leaning = middles[near] - place, line.normals[segment[near]]
        mean = leaning.mean(axis=0)
        turns = np.arctan2(mean[0] * leaning[:, 1] - mean[1] * leaning[:, 0], leaning @ mean)
        normal = _turned(mean / np.linalg.norm(mean), float(np.median(turns)))
        for _ in range(_REFITS):
            above = offsets @ normal
            off = np.abs(above - np.median(above))
            face = off <= _ON_FACE * max(float(np.median(off)), _FLAT_MM)
            beside = offsets[face] @ np.array([normal[1], -normal[0]])
            spread = float(((beside - beside.mean()) ** 2).sum())
            slope = float((beside - beside.mean()) @ above[face]) / spread if spread > 0.0 else 0.0
            normal = _turned(normal, float(np.arctan(slope)))
        normals[station] = normal
        at[station] = place + np.median(offsets[face] @ normal) * normal
    return at, normals


def _turned(normal: Floats, angle: float) -> Floats:
    """A direction (2,) in the (z, r) plane turned from z to r."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * normal[0] - s * normal[1], s * normal[0] + c * normal[1]])


def _poses(origins: Floats, z_axes: Floats, feed: Floats) -> Floats:
    x_axes = feed - (z_axes * feed).sum(axis=1, keepdims=True) * z_axes
    x_axes /= np.linalg.norm(x_axes, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (len(origins), 1, 1))
    poses[:, :3, :3] = np.stack([x_axes, np.cross(z_axes, x_axes), z_axes], axis=2)
    poses[:, :3, 3] = origins
    return poses


def _cuts_mm(poses: Floats, line: Polyline, generatrix: Generatrix, radius_mm: float) -> Floats:
    """(N,) how far a ring of the mill's face reaches into the part, beyond what its curve is known to."""
    turn = np.linspace(0.0, 2.0 * np.pi, _RIM, endpoint=False)
    rim = radius_mm * np.stack([np.cos(turn), np.sin(turn), np.zeros(_RIM)], axis=1)
    points = (np.einsum("nij,mj->nmi", poses[:, :3, :3], rim) + poses[:, None, :3, 3]).reshape(-1, 3)
    z, r = points[:, 2], np.hypot(points[:, 0], points[:, 1])
    foot = feet_of(z, r, line)
    nodes = np.stack([generatrix.z_mm, generatrix.r_mm, generatrix.sigma_mm], axis=1)
    nodes = nodes[np.isfinite(nodes).all(axis=1)]
    under = np.full(len(points), _UNDER_MM)
    if len(nodes):
        nearest = cKDTree(nodes[:, :2]).query(np.stack([z, r], axis=1))[1]
        under += _UNDER_SIGMAS * nodes[nearest, 2]
    # beyond the curve's ends nothing is known to be there
    deep = np.where(foot.valid, -foot.distance_mm - under, 0.0)
    return np.asarray(np.maximum(deep.reshape(len(poses), _RIM).max(axis=1), 0.0))
