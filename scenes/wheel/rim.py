"""Burrs that stand on an edge, along an arc of the circumference."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from scenes.wheel.outline import Outline
from scenes.wheel.spec import RimBurr
from scenes.wheel.tool import OVERLAP_MM, SINK_MM, Tool, varying_heights
from scenes.wheel.truth import deviation_mm

_INSET_MM = 0.05
_FACES = 0.5
_STEPS = 30
_EXCESS_MM = 1e-6


def rim_tool(burr: RimBurr, outline: Outline, *, section_deg: float) -> Tool:
    """The solid of a rim burr: a triangle in the (z, r) plane, turned along its arc.

    Its base lies on that surface at the edge which faces the burr's direction, from 0.05 mm off the edge (the
    end of its fillet), so that no face of it coincides with the wheel's. The height is along the normal of
    that surface.

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
    near, along, normal, direction = _standing_surface(burr, outline, vertex)
    b_near = near + along * _INSET_MM
    b_far = b_near + along * burr.width_mm
    middle = (b_near + b_far) / 2.0
    angles = _angles(burr, section_deg)
    arc_mm = np.radians(angles - angles[0]) * middle[1]
    heights = varying_heights(
        arc_mm, height_mm=burr.height_mm, variation=burr.height_variation, seed=burr.seed
    )
    left = np.array([-normal[1], normal[0]])
    ends = (b_far, b_near) if along @ left > 0.0 else (b_near, b_far)
    rises = _rises(middle, direction, float(direction @ normal), heights, outline)
    rings = _rings(ends, middle, normal, direction * rises[:, None], heights)
    z = np.array([b_near[0], b_far[0], *rings[:, 0, 0]])
    return Tool(
        stations_mm=_turned(rings, angles),
        side="protrusion",
        angle_deg=burr.angle_deg,
        z_start_mm=float(z.min()),
        z_end_mm=float(z.max()),
        width_mm=burr.width_mm,
        length_mm=float(arc_mm[-1]),
        arc_deg=burr.arc_deg,
    )


def _rises(middle: Floats, direction: Floats, facing: float, heights: Floats, outline: Outline) -> Floats:
    """(N,) how far to go in the direction to be ``heights`` above the surface and no farther."""
    rises = heights / facing
    for _ in range(_STEPS):
        z, r = (middle + direction * rises[:, None]).T
        above = deviation_mm(np.stack([r, np.zeros_like(r), z], axis=1), outline.curve_zr)
        if (above <= heights + _EXCESS_MM).all():
            break
        rises = np.where(above > heights, rises * heights / above, rises)
    return np.asarray(rises)


def _vertex(burr: RimBurr, outline: Outline) -> int:
    count = len(outline.vertices_zr)
    if isinstance(burr.edge, int):
        if burr.edge >= count:
            raise InputError(f"rim: no vertex {burr.edge}; the generatrix has vertices 0 to {count - 1}")
        return burr.edge
    return int(np.argmin(np.linalg.norm(outline.vertices_zr - np.array(burr.edge), axis=1)))


def _standing_surface(burr: RimBurr, outline: Outline, vertex: int) -> tuple[Floats, Floats, Floats, Floats]:
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
    if length < burr.width_mm + _INSET_MM:
        raise InputError(
            f"{where}: a base {burr.width_mm:g} mm wide does not fit a surface {length:.3g} mm long"
        )
    return edges[which, 0], along / length, normals[which], axis * np.sign(facing[which])


def _turn(before: Floats, after: Floats) -> float:
    return float(before[0] * after[1] - before[1] * after[0])


def _angles(burr: RimBurr, section_deg: float) -> Floats:
    count = max(2, int(np.ceil(burr.arc_deg / section_deg)) + 1)
    half = burr.arc_deg / 2.0
    return np.linspace(burr.angle_deg - half, burr.angle_deg + half, count)


def _rings(
    ends: tuple[Floats, Floats], middle: Floats, normal: Floats, rise: Floats, heights: Floats
) -> Floats:
    """(N, 5, 2) apex, base, root, root, base in (z, r), counter-clockwise."""
    apex = middle + rise
    onward = (OVERLAP_MM / heights)[:, None]
    bases = [end + (end - apex) * onward for end in ends]
    roots = [np.broadcast_to((end + middle) / 2.0 - normal * SINK_MM, apex.shape) for end in ends]
    return np.stack([apex, bases[0], roots[0], roots[1], bases[1]], axis=1)


def _turned(rings_zr: Floats, angles_deg: Floats) -> Floats:
    angle = np.radians(angles_deg)[:, None]
    z, r = rings_zr[..., 0], rings_zr[..., 1]
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
