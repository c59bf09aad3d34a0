"""From a specification to a watertight wheel with burrs, and everything known of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32, freeze
from burrscan.errors import InputError
from scenes.wheel.carve import carve
from scenes.wheel.mill import Cut
from scenes.wheel.outline import Outline, divided, wheel_outline
from scenes.wheel.revolve import sections_for
from scenes.wheel.ridge import nick_tool, ridge_tool
from scenes.wheel.rim import rim_tool
from scenes.wheel.spec import AxialRidge, BurrSpec, Nick, RimBurr, WheelSpec
from scenes.wheel.tool import Tool
from scenes.wheel.truth import TrueBurr, deviation_mm

_TRUTH_CHORD_MM = 1e-5
"""Of the outline that truth is measured on: a hundredth of a micrometre, below all that is scored."""
_SHARES = 5
"""Places per pair of stations at which a burr's height is looked for, both ends among them."""
_ALIKE_MM = 1e-6
"""Points of a section this near to the farthest are as far: they differ by rounding."""


@dataclass(frozen=True)
class Wheel:
    """A wheel ready to be rendered, in its part frame: millimetres, the axis is +z.

    Parameters
    ----------
    vertices_mm
        (V, 3); repeated at creases and seams, where one point has several normals or uv.
    faces
        (T, 3) counter-clockwise from outside.
    normals
        (V, 3) unit outward normals of the exact surface (not of the facets).
    uvs
        (V, 2) u along the circumference on the wheel itself.
    face_burr
        (T,) index into ``burrs`` of the burr that a face belongs to, -1 for the wheel itself.
    generatrix_zr_mm
        (K, 2) the ideal outline within 0.01 µm, outside to the left; from axis to axis for a solid wheel,
        closed (first point repeated) for one with a bore.
    burrs
        The truth, in the order of the specification.
    name
        Of the wheel.

    """

    vertices_mm: Floats
    faces: Ints32
    normals: Floats
    uvs: Floats
    face_burr: Ints32
    generatrix_zr_mm: Floats
    burrs: tuple[TrueBurr, ...]
    name: str

    def __post_init__(self) -> None:
        freeze(self, vertices_mm=self.vertices_mm, faces=self.faces, normals=self.normals, uvs=self.uvs)
        freeze(self, face_burr=self.face_burr, generatrix_zr_mm=self.generatrix_zr_mm)

    def welded(self) -> tuple[Floats, Ints32]:
        """Vertices and faces of the closed surface, each point once."""
        vertices, index = np.unique(self.vertices_mm, axis=0, return_inverse=True)
        return vertices, index.reshape(-1)[self.faces].astype(np.int32)


def build_wheel(
    spec: WheelSpec,
    burrs: Sequence[BurrSpec] | None = None,
    *,
    facet_error_mm: float = 0.001,
    sections: int | None = None,
    cuts_mm: Sequence[float] = (),
    milled: Sequence[Cut] = (),
) -> Wheel:
    """Turn the generatrix, unite burrs, cut nicks, and state the truth.

    Parameters
    ----------
    spec
        The wheel.
    burrs
        The burrs to put on; those of the specification when None. Nicks are cut last.
    facet_error_mm
        Largest distance of a facet's chord from the exact curve, along the circumference and along fillets
        each, so the surface is nowhere off by more than twice this.
    sections
        Number of facets round the circumference; from ``facet_error_mm`` when None.
    cuts_mm
        Positions along the axis at which faces shall end, for finishes that do.
    milled
        Passes of a mill over the finished wheel. The truth of ``burrs`` stays what it was before them.

    Raises
    ------
    InputError
        When no body can be turned from the outline or a burr does not fit the wheel.

    """
    outline = divided(wheel_outline(spec, chord_error_mm=facet_error_mm), cuts_mm)
    exact = wheel_outline(spec, chord_error_mm=_TRUTH_CHORD_MM)
    count = sections or sections_for(float(outline.curve_zr[:, 1].max()), chord_error_mm=facet_error_mm)
    chosen = tuple(spec.burr if burrs is None else burrs)
    tools = tuple(_tool(burr, exact, i, 360.0 / count) for i, burr in enumerate(chosen))
    parts, volumes = carve(outline, tools, sections=count, cuts=milled)
    return Wheel(
        vertices_mm=np.concatenate([part.points_mm for part in parts]),
        faces=_joined([part.faces for part in parts], [len(part.points_mm) for part in parts]),
        normals=np.concatenate([part.normals for part in parts]),
        uvs=np.concatenate([part.uvs for part in parts]),
        face_burr=np.concatenate([part.face_burr for part in parts]),
        generatrix_zr_mm=exact.curve_zr,
        burrs=tuple(map(_truth, chosen, tools, volumes, [exact] * len(tools))),
        name=spec.name,
    )


def _joined(faces: list[Ints32], counts: list[int]) -> Ints32:
    offsets = np.concatenate([[0], np.cumsum(counts[:-1])])
    return np.concatenate([part + offset for part, offset in zip(faces, offsets, strict=True)]).astype(
        np.int32
    )


def _tool(burr: BurrSpec, outline: Outline, index: int, section_deg: float) -> Tool:
    try:
        if isinstance(burr, AxialRidge):
            return ridge_tool(burr, outline)
        if isinstance(burr, RimBurr):
            return rim_tool(burr, outline, section_deg=section_deg)
        return nick_tool(burr, outline)
    except InputError as error:
        raise InputError(f"burr {index}: {error}") from error


def _truth(burr: BurrSpec, tool: Tool, volume_mm3: float, outline: Outline) -> TrueBurr:
    crest, deviation = _crest(tool, outline)
    there = np.any([_between(tool.position_mm, *ends) for ends in _piece_ends(tool)], axis=0)
    inside = deviation < 0.0 if tool.side == "nick" else there
    return TrueBurr(
        kind=burr.kind,
        side=tool.side,
        angle_deg=tool.angle_deg,
        z_start_mm=tool.z_start_mm,
        z_end_mm=tool.z_end_mm,
        height_mm=_height(tool, outline),
        width_mm=tool.width_mm,
        length_mm=tool.length_mm,
        area_mm2=volume_mm3 / tool.length_mm,
        volume_mm3=volume_mm3,
        ridge_mm=crest[inside],
        deviation_mm=deviation[inside],
        arc_deg=tool.arc_deg,
        section="triangle" if isinstance(burr, Nick) else burr.section,
        position_mm=tool.position_mm[inside],
        thickness_mm=tool.thickness_mm[inside],
        pieces_mm=_piece_ends(tool),
    )


def _piece_ends(tool: Tool) -> Floats:
    """(P, 2) start and end of each piece along the burr."""
    return np.asarray(tool.position_mm[np.array(tool.pieces)])


def _between(positions: Floats, first: float, last: float) -> Bools:
    return np.asarray((positions >= first) & (positions <= last))


def _crest(tool: Tool, outline: Outline) -> tuple[Floats, Floats]:
    """(N, 3) per station the point of the section that is farthest from the outline, and (N,) how far."""
    flanks = tool.flanks_mm
    deviation = deviation_mm(flanks.reshape(-1, 3), outline.curve_zr).reshape(flanks.shape[:2])
    off = deviation if tool.side == "protrusion" else -deviation
    # of several alike, as on a flake's flat tip, the middle one
    alike = off >= off.max(axis=1, keepdims=True) - _ALIKE_MM
    farthest = np.round(alike @ np.arange(alike.shape[1]) / alike.sum(axis=1)).astype(int)
    station = np.arange(len(flanks))
    return flanks[station, farthest], deviation[station, farthest]


def _height(tool: Tool, outline: Outline) -> float:
    """Largest distance from the outline, between the stations too."""
    flanks, whole = tool.flanks_mm, tool.whole
    shares = np.linspace(0.0, 1.0, _SHARES)[:, None, None, None]
    dense = flanks[:-1][whole] * (1.0 - shares) + flanks[1:][whole] * shares
    deviation = deviation_mm(dense.reshape(-1, 3), outline.curve_zr)
    return float(-deviation.min() if tool.side == "nick" else deviation.max())
