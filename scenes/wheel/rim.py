"""Burrs that stand on an edge, along an arc of the circumference."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel.course import THICKEST, Course, course_of, station_step_mm, whole_pieces
from scenes.wheel.outline import Outline
from scenes.wheel.section import Section, section_of
from scenes.wheel.spec import RimBurr
from scenes.wheel.tool import (
    LONGEST_ONWARD,
    OVERLAP_MM,
    SINK_MM,
    Tool,
    mean_thickness_mm,
    piece_stations,
    ring_smooth,
)
from scenes.wheel.truth import deviation_mm

_INSET_MM = 0.05
"""Of the base from the edge: a base that ends exactly on the edge has Boolean operations decide by
rounding."""
_FACES = 0.5
"""Cosine between the surface beside an edge and the burr's direction, 60°: steeper, nothing stands on it."""
_STEPS = 30
"""Of bisecting by how much a section is scaled down so that it is nowhere too far from the wheel."""
_EXCESS_MM = 1e-6
"""A nanometre over the height is rounding."""


def rim_tool(burr: RimBurr, outline: Outline, *, section_deg: float) -> Tool:
    """The solid of a rim burr: its section in the (z, r) plane, turned along its arc.

    Its base lies on that surface at the edge which faces the burr's direction, from 0.05 mm off the edge (the
    end of its fillet), so that no face of it coincides with the wheel's. The height is along the normal of
    that surface, and nothing of the section is farther from the wheel than that. The section's +x is outwards
    over the edge.

    Parameters
    ----------
    burr
        The specification.
    outline
        Of the wheel.
    section_deg
        Largest step along the arc.

    Raises
    ------
    InputError
        When there is no such edge, no surface at it faces the direction, or the surface is too narrow.

    """
    vertex = _vertex(burr, outline)
    widest_mm = burr.width_mm * (THICKEST if burr.thickness_rms else 1.0)
    near, along, normal, direction = _standing_surface(burr, outline, vertex, widest_mm)
    middle = near + along * (_INSET_MM + burr.width_mm / 2.0)
    length_mm = float(np.radians(burr.arc_deg)) * float(middle[1])
    pieces_mm = whole_pieces(burr, length_mm)
    arc_mm = _positions(burr, length_mm, section_deg, pieces_mm)
    course = course_of(burr, arc_mm, pieces_mm)
    section = _from_the_edge(section_of(burr, course), burr)
    flanks = _placed(section, course, middle, -along, direction / float(direction @ normal), outline)
    rings = _rings(flanks, middle, normal)
    if _left_handed(rings[0]):
        rings, section = np.concatenate([rings[:, -3::-1], rings[:, :-3:-1]], axis=1), section.reversed()
    angles = burr.angle_deg + (arc_mm / length_mm - 0.5) * burr.arc_deg
    return Tool(
        stations_mm=_turned(rings, angles),
        smooth=ring_smooth(section),
        pieces=piece_stations(arc_mm, pieces_mm),
        position_mm=arc_mm,
        thickness_mm=mean_thickness_mm(section),
        side="protrusion",
        angle_deg=burr.angle_deg,
        z_start_mm=float(flanks[..., 0].min()),
        z_end_mm=float(flanks[..., 0].max()),
        width_mm=float(np.ptp(section.points_mm[:, [0, -1], 0], axis=1).max()),
        length_mm=length_mm,
        arc_deg=burr.arc_deg,
    )


def _positions(burr: RimBurr, length_mm: float, section_deg: float, pieces_mm: Floats) -> Floats:
    """(N,) stations along the arc, the ends of its pieces among them."""
    step_mm = station_step_mm(burr, length_mm * section_deg / burr.arc_deg)
    even = np.linspace(0.0, length_mm, max(2, int(np.ceil(length_mm / step_mm)) + 1))
    return np.union1d(even, np.concatenate([pieces_mm[1:, 0], pieces_mm[:-1, 1]]))


def _from_the_edge(section: Section, burr: RimBurr) -> Section:
    """The section moved so that a base of any width begins where the nominal one does, off the edge."""
    points = section.points_mm.copy()
    points[..., 0] += burr.width_mm / 2.0 - points[:, -1:, 0]
    return Section(points, section.smooth)


def _placed(
    section: Section, course: Course, middle: Floats, outwards: Floats, rise: Floats, outline: Outline
) -> Floats:
    """(N, K, 2) the section in (z, r), as high as it may be without being farther from the wheel anywhere.

    A lower section leans over by less: over the edge it is the lean that takes it away from the wheel.
    """
    x, y = section.points_mm[..., :1], section.points_mm[..., 1:]
    heights, over = course.heights_mm, y * np.tan(np.radians(course.leans_deg))[:, None, None]
    low, high = np.zeros(len(heights)), np.ones(len(heights))
    share = high
    for _ in range(_STEPS):
        kept = share[:, None, None]
        flanks = middle + outwards * (x - (1.0 - kept) * over) + rise * y * kept
        z, r = flanks.reshape(-1, 2).T
        off = deviation_mm(np.stack([r, np.zeros_like(r), z], axis=1), outline.curve_zr)
        above = off.reshape(flanks.shape[:2]).max(axis=1)
        as_high = (share == 1.0) | (above >= heights - _EXCESS_MM)
        if (as_high & (above <= heights + _EXCESS_MM)).all():
            break
        low, high = np.where(above > heights, low, share), np.where(above > heights, share, high)
        share = np.where(low < 1.0, 0.5 * (low + high), 1.0)
    return np.asarray(flanks)


def _left_handed(ring_zr: Floats) -> bool:
    """Whether a ring runs clockwise in the (z, r) plane."""
    z, r = ring_zr.T
    return bool(np.sum(z * np.roll(r, -1) - np.roll(z, -1) * r) < 0.0)


def _vertex(burr: RimBurr, outline: Outline) -> int:
    count = len(outline.vertices_zr)
    if isinstance(burr.edge, int):
        if burr.edge >= count:
            raise InputError(f"rim: no vertex {burr.edge}; the generatrix has vertices 0 to {count - 1}")
        return burr.edge
    return int(np.argmin(np.linalg.norm(outline.vertices_zr - np.array(burr.edge), axis=1)))


def _standing_surface(
    burr: RimBurr, outline: Outline, vertex: int, widest_mm: float
) -> tuple[Floats, Floats, Floats, Floats]:
    """Where the surface begins at the edge, along it, its outward normal, and the burr's direction."""
    axis = np.array([0.0, 1.0]) if burr.direction == "radial" else np.array([1.0, 0.0])
    edges = np.stack([outline.edge_after[vertex], outline.edge_before[vertex]])
    normals = np.stack([outline.edge_normal_after[vertex], outline.edge_normal_before[vertex]])
    facing = normals @ axis
    which = int(np.argmax(np.abs(facing)))
    z, r = outline.vertices_zr[vertex]
    where = f"rim: the edge at vertex {vertex} (z {z:g}, r {r:g})"
    if r == 0.0:
        raise InputError(f"{where} is a point on the axis; choose an edge")
    if _turn(normals[1], normals[0]) >= 0.0:
        raise InputError(f"{where} is an inner corner; a burr stands on an outer edge")
    if abs(facing[which]) < _FACES:
        raise InputError(f"{where} has no surface that faces the {burr.direction} direction")
    along = edges[which, 1] - edges[which, 0]
    length = float(np.linalg.norm(along))
    if length < widest_mm + _INSET_MM:
        raise InputError(f"{where}: a base {widest_mm:g} mm wide does not fit a surface {length:.3g} mm long")
    return edges[which, 0], along / length, normals[which], axis * np.sign(facing[which])


def _turn(before: Floats, after: Floats) -> float:
    return float(before[0] * after[1] - before[1] * after[0])


def _rings(flanks: Floats, middle: Floats, normal: Floats) -> Floats:
    """(N, K + 2, 2) the section in (z, r), its ends led on through the surface, and the root."""
    led, roots = [], []
    for end, beside in ((0, 1), (-1, -2)):
        steep = (flanks[:, beside] - flanks[:, end]) @ normal
        onward = np.minimum(OVERLAP_MM / np.maximum(steep, 1e-12), LONGEST_ONWARD)[:, None]
        b = flanks[:, end] + (flanks[:, end] - flanks[:, beside]) * onward
        missing = np.maximum((b - flanks[:, end]) @ normal + OVERLAP_MM / 2.0, 0.0)
        led.append(b - normal * missing[:, None])
        roots.append((flanks[:, end] + middle) / 2.0 - normal * SINK_MM)
    ring = [led[0][:, None], flanks[:, 1:-1], led[1][:, None], roots[1][:, None], roots[0][:, None]]
    return np.concatenate(ring, axis=1)


def _turned(rings_zr: Floats, angles_deg: Floats) -> Floats:
    angle = np.radians(angles_deg)[:, None]
    z, r = rings_zr[..., 0], rings_zr[..., 1]
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
