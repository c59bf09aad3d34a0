"""What a wheel and its burrs are made of, as written in TOML."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from burrscan.documents import STRICT

Length = Annotated[float, Field(gt=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Share = Annotated[float, Field(ge=0.0, le=0.95)]
Lean = Annotated[float, Field(ge=-60.0, le=60.0)]
Vertex = tuple[float, float] | tuple[float, float, Annotated[float, Field(ge=0.0)]]


@dataclass(frozen=True)
class AxialRidge:
    """The paper's burr: a ridge parallel to the axis on the outermost surface.

    Parameters
    ----------
    angle_deg
        atan2 angle of its base middle.
    height_mm
        Largest height along the normal of the wheel's surface.
    width_mm
        Width of the base on the surface.
    z_start_mm, z_end_mm
        Extent along the axis; the ridge ends in plane faces there.
    lean_deg
        Angle of the flap from the surface normal, positive towards growing angles; the height stays.
    height_variation
        Share by which the height falls below its largest value along the ridge: 0 for an even ridge.
    seed
        Chooses the course of the height variation.

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    height_mm: Length
    width_mm: Length
    z_start_mm: float
    z_end_mm: float
    lean_deg: Lean = 0.0
    height_variation: Share = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    kind: Literal["axial_ridge"] = "axial_ridge"


@dataclass(frozen=True)
class RimBurr:
    """An arc of burr standing on an edge of the wheel.

    Parameters
    ----------
    angle_deg
        atan2 angle of the middle of the arc.
    arc_deg
        Extent of the arc.
    height_mm, width_mm
        Largest height along the normal of the surface it stands on; width of its base.
    edge
        Which edge: the index of a vertex of the generatrix, counted from 0 as listed, or the ``[z, r]`` of a
        point, for the nearest vertex.
    direction
        ``radial`` stands up away from the axis (or into a bore), ``axial`` along it.
    height_variation, seed
        As of :class:`AxialRidge`.

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    arc_deg: Annotated[float, Field(gt=0.0, le=340.0)]
    height_mm: Length
    width_mm: Length
    edge: Annotated[int, Field(ge=0)] | tuple[float, float]
    direction: Literal["radial", "axial"] = "radial"
    height_variation: Share = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    kind: Literal["rim"] = "rim"


@dataclass(frozen=True)
class Nick:
    """Missing material: a notch parallel to the axis in the outermost surface.

    Parameters
    ----------
    angle_deg
        atan2 angle of the middle of the notch.
    depth_mm, width_mm
        Largest depth along the normal of the surface; width of the mouth.
    z_start_mm, z_end_mm
        Extent along the axis; it may run out over the end faces, which nicks the edge.
    depth_variation, seed
        As ``height_variation`` and ``seed`` of :class:`AxialRidge`.

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    depth_mm: Length
    width_mm: Length
    z_start_mm: float
    z_end_mm: float
    depth_variation: Share = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    kind: Literal["nick"] = "nick"


BurrSpec = Annotated[AxialRidge | RimBurr | Nick, Field(discriminator="kind")]
"""A burr as written in TOML; the key ``kind`` says which."""


@dataclass(frozen=True)
class WheelSpec:
    """A wheel: the outline of its half section, and the burrs it comes with.

    Parameters
    ----------
    name
        Short name.
    generatrix
        The outline's vertices ``[z, r]`` or ``[z, r, fillet radius]`` in mm, in either sense of rotation. The
        last vertex joins the first. An edge that lies on the axis (two neighbours with r = 0) makes no
        surface: the wheel is solid there. Without one the wheel has a bore.
    description
        One line for people.
    burr
        The burrs it comes with.

    """

    __pydantic_config__ = STRICT

    name: str
    generatrix: tuple[Vertex, ...]
    description: str = ""
    burr: tuple[BurrSpec, ...] = ()
