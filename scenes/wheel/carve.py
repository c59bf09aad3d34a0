"""Putting burrs on a wheel and cutting nicks, only where they are.

A boolean of the whole wheel costs seconds; a burr touches a few degrees of it. So the wheel is divided at
sections into runs with burrs and runs without. A run with burrs is closed by two plane caps, goes through the
booleans, and loses its caps again; its open ends then meet the neighbouring runs bit for bit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.errors import InputError
from burrscan.turns import turn_deg
from scenes.wheel.loft import loft
from scenes.wheel.mill import Cut
from scenes.wheel.outline import Outline
from scenes.wheel.revolve import caps, revolve
from scenes.wheel.solid import to_manifold
from scenes.wheel.tool import Tool

_MARGIN_SECTIONS = 2
"""To each side of a tool: Boolean operations there must cut whole facets and not touch the seam."""

_MILL = -2
"""Owner of faces that a mill left, until they become the wheel's."""
_TEXTURE_MM = 100.0
"""Length to which u and v of milled faces run from 0 to 1: any will do."""


@dataclass(frozen=True)
class Part:
    """A piece of the finished surface; the fields are those of :class:`scenes.wheel.Wheel`."""

    points_mm: Floats
    normals: Floats
    uvs: Floats
    faces: Ints32
    face_burr: Ints32


def carve(
    outline: Outline, tools: tuple[Tool, ...], *, sections: int, cuts: Sequence[Cut] = ()
) -> tuple[list[Part], list[float]]:
    """The surface of the wheel with its burrs, in parts, and the volume of each burr.

    Parameters
    ----------
    outline
        Of the wheel.
    tools
        In the order of the burrs; protrusions are united first, nicks cut last.
    sections
        Number of facets round the circumference.
    cuts
        Of a mill, after everything else.

    Returns
    -------
    Parts that together are closed, and per tool the volume in mm³ outside (a nick: inside) the bare wheel.

    """
    touched = [_touched(tool, sections) for tool in tools]
    milled = [_milled(cut, sections) for cut in cuts]
    parts = []
    volumes = [0.0] * len(tools)
    for first, count, burred in _runs(np.any([np.zeros(sections, np.bool_), *touched, *milled], axis=0)):
        if not burred:
            parts.append(_bare(outline, sections=sections, first=first, count=count))
            continue
        here = [
            i for i, cells in enumerate(touched) if cells[np.arange(first, first + count) % sections].any()
        ]
        run = np.arange(first, first + count) % sections
        mills = [cut for cut, cells in zip(cuts, milled, strict=True) if cells[run].any()]
        part, found = _carved(outline, tools, here, mills, sections=sections, first=first, count=count)
        parts.append(part)
        for i, volume in zip(here, found, strict=True):
            volumes[i] = volume
    return parts, volumes


def _touched(tool: Tool, sections: int) -> Bools:
    """(sections,) the sections that a tool reaches into, with a margin."""
    x, y = tool.stations_mm[..., 0], tool.stations_mm[..., 1]
    off = np.degrees(np.arctan2(y, x)) - tool.angle_deg
    spread = float(np.abs(turn_deg(off)).max())
    half = spread if tool.arc_deg < 180.0 else tool.arc_deg / 2.0
    step = 360.0 / sections
    low = int(np.floor((tool.angle_deg - half) / step)) - _MARGIN_SECTIONS
    high = int(np.ceil((tool.angle_deg + half) / step)) + _MARGIN_SECTIONS
    cells = np.zeros(sections, np.bool_)
    cells[np.arange(low, min(high, low + sections)) % sections] = True
    return cells


def _milled(cut: Cut, sections: int) -> Bools:
    """(sections,) the sections that a mill may reach into: as many beside its middle's as it is wide."""
    tips = np.asarray(cut.tips_mm)
    step = 360.0 / sections
    radius = float(np.hypot(tips[:, 0], tips[:, 1]).min())
    wide = np.degrees(np.arcsin(min(1.0, cut.radius_mm / max(radius, 1e-9))))
    beside = int(np.ceil(wide / step)) + _MARGIN_SECTIONS
    middles = np.floor(np.degrees(np.arctan2(tips[:, 1], tips[:, 0])) / step).astype(int)
    cells = np.zeros(sections, np.bool_)
    cells[(middles[:, None] + np.arange(-beside, beside + 1)).ravel() % sections] = True
    return cells


def _runs(cells: Bools) -> list[tuple[int, int, bool]]:
    """Circular runs of equal cells: first, count, value."""
    starts = np.flatnonzero(cells != np.roll(cells, 1))
    if not len(starts):
        return [(0, len(cells), bool(cells[0]))]
    counts = np.diff(np.append(starts, starts[0] + len(cells)))
    return [(int(s), int(c), bool(cells[s])) for s, c in zip(starts, counts, strict=True)]


def _bare(outline: Outline, *, sections: int, first: int, count: int) -> Part:
    solid = revolve(outline, sections=sections, first=first, count=count)
    faces = solid.faces.astype(np.int32)
    return Part(solid.points_mm, solid.normals, solid.uvs, faces, np.full(len(faces), -1, np.int32))


def _carved(
    outline: Outline,
    tools: tuple[Tool, ...],
    here: list[int],
    cuts: Sequence[Cut],
    *,
    sections: int,
    first: int,
    count: int,
) -> tuple[Part, list[float]]:
    run = revolve(outline, sections=sections, first=first, count=count)
    closing = caps(outline, count=count) if count < sections else None
    body, body_id = to_manifold(run, closing)
    solids = {i: _solids(tools[i]) for i in here}
    result = body
    for side, operation in (("protrusion", manifold3d.OpType.Add), ("nick", manifold3d.OpType.Subtract)):
        operands = [solid for i in here if tools[i].side == side for solid, _ in solids[i]]
        if operands:
            result = manifold3d.Manifold.batch_boolean([result, *operands], operation)
    owners = {body_id: -1} | {original: i for i, pieces in solids.items() for _, original in pieces}
    if cuts:
        swept = [cut.swept().as_original() for cut in cuts]
        owners |= {solid.original_id(): _MILL for solid in swept}
        result = manifold3d.Manifold.batch_boolean([result, *swept], manifold3d.OpType.Subtract)
    # what is cut off from the body falls off, crumbs that unions leave in a corner of two facets included
    result = max(result.decompose(), key=lambda piece: piece.volume())
    part = _read(result, owners, {i for i in here if tools[i].side == "nick"}, bare_faces=len(run.faces))
    lost = 0 if closing is None else len(closing)
    _check_ends(result, part, lost)
    return part, [sum(_volume(solid, body, tools[i]) for solid, _ in solids[i]) for i in here]


def _solids(tool: Tool) -> list[tuple[manifold3d.Manifold, int]]:
    """One solid per piece of a burr, with its id."""
    return [to_manifold(loft(tool.stations_mm[first : last + 1], tool.smooth)) for first, last in tool.pieces]


def _volume(solid: manifold3d.Manifold, body: manifold3d.Manifold, tool: Tool) -> float:
    """What a burr adds, or a nick takes: a strip that curls may run into itself and counts once."""
    changed = body - solid if tool.side == "nick" else body + solid
    return abs(float(changed.volume() - body.volume()))


def _read(result: manifold3d.Manifold, owners: dict[int, int], nicks: set[int], *, bare_faces: int) -> Part:
    """Arrays of the result without caps; manifold3d carried normals, uv and each face's origin through."""
    mesh = result.to_mesh64()
    properties = np.array(mesh.vert_properties)
    faces = np.array(mesh.tri_verts, dtype=np.int32)
    face_burr = np.repeat(
        np.array([owners[original] for original in mesh.run_original_id], np.int32),
        np.diff(np.array(mesh.run_index) // 3),
    )
    is_cap = (face_burr == -1) & (np.array(mesh.face_id) >= bare_faces)
    faces, face_burr = faces[~is_cap], face_burr[~is_cap]
    # a mill's faces come without: they get theirs below
    length = np.linalg.norm(properties[:, 3:6], axis=1, keepdims=True)
    normals = properties[:, 3:6] / np.maximum(length, 1e-300)
    # a nick's faces are its tool's, seen from the other side
    normals[np.unique(faces[np.isin(face_burr, list(nicks))])] *= -1.0
    used, index = np.unique(faces, return_inverse=True)
    properties, normals = properties[used], normals[used]
    faces = index.reshape(-1, 3).astype(np.int32)
    part = Part(properties[:, :3].copy(), normals, properties[:, 6:8].copy(), faces, face_burr)
    return _flat(part, face_burr == _MILL) if (face_burr == _MILL).any() else part


def _flat(part: Part, milled: Bools) -> Part:
    """The part with its milled faces as faces of the wheel, each with vertices and a normal of its own."""
    corners = part.points_mm[part.faces[milled]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    along = np.stack([corners[..., 0] + corners[..., 1], corners[..., 2]], axis=-1) / _TEXTURE_MM
    faces = part.faces.copy()
    faces[milled] = len(part.points_mm) + np.arange(3 * len(corners)).reshape(-1, 3)
    return Part(
        np.concatenate([part.points_mm, corners.reshape(-1, 3)]),
        np.concatenate([part.normals, np.repeat(normals, 3, axis=0)]),
        np.concatenate([part.uvs, along.reshape(-1, 2)]),
        faces,
        np.where(milled, np.int32(-1), part.face_burr),
    )


def _check_ends(result: manifold3d.Manifold, part: Part, lost: int) -> None:
    """The caps must come back as they went in, or the run would not meet its neighbours."""
    if int(result.num_tri()) - len(part.faces) != lost:
        raise InputError("a burr reaches right through the wheel; make it smaller or move it")
