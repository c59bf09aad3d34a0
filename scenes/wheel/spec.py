"""What a wheel and its burrs are made of, as written in TOML."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import AliasChoices, Field

from burrscan.documents import STRICT
from scenes.finish import LocalFinishKey

Length = Annotated[float, Field(gt=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Share = Annotated[float, Field(ge=0.0, le=0.95)]
Lean = Annotated[float, Field(ge=-60.0, le=60.0)]
Curl = Annotated[float, Field(ge=100.0, le=180.0)] | Annotated[float, Field(ge=-180.0, le=-100.0)]
Vertex = tuple[float, float] | tuple[float, float, Annotated[float, Field(ge=0.0)]]


@dataclass(frozen=True, kw_only=True)
class Shape:
    """What a burr's cross-section is, how it varies along the burr, and how its flanks reflect.

    Gillespie's kinds of burr (Gillespie & Blotter, J. Eng. Ind. 98, 66, 1976), made of these keys: a Poisson
    burr, metal bulged out sideways, is ``rounded`` and wide; a rollover burr, a chip bent over instead of
    cut, is ``rolled``; a tear burr is a ``flake`` with ``height_rms``, ``lean_rms_deg`` and ``gap_share``; a
    cut-off burr, the stump left where a part falls off, is a short thick ``flake``. ISO 13715 calls each of
    them an edge state "+" of the size ``height_mm``.

    Parameters
    ----------
    section
        ``triangle`` (a prism: the control), ``rounded`` (a parabola), ``rolled`` (a strip curled over, with
        an undercut), ``flake`` (a thin trapezoid). ``width_mm`` is the thickness at the root of each; that of
        a rolled burr is at most 1.5 of its height.
    tip_mm
        Thickness at the tip: of a flake 0.3 of its width by default, of a rolled burr 0.6 of its width and at
        most 0.3 of its height.
    curl_deg
        By how much a rolled burr turns over, 100 to 180, towards growing angles (on a rim: outwards over the
        edge); negative: the other way.
    height_rms, thickness_rms
        Standard deviation along the burr as a share of the mean; the largest height stays.
    lean_rms_deg
        Standard deviation of the lean.
    correlation_mm
        Correlation length ℓ of all of these; the spectrum is that of :mod:`scenes.wheel.course`.
    gap_share
        Share of the length that is torn off.
    finish
        Of its flanks: ``wheel`` for the wheel's own, a name or a table (:class:`scenes.finish.LocalFinish`);
        without it :func:`scenes.finish.torn`, rougher than the wheel's.

    """

    section: Literal["triangle", "rounded", "rolled", "flake"] = "triangle"
    tip_mm: Length | None = None
    curl_deg: Curl = 150.0
    height_rms: Annotated[float, Field(ge=0.0, le=0.6)] = 0.0
    lean_rms_deg: Annotated[float, Field(ge=0.0, le=30.0)] = 0.0
    thickness_rms: Annotated[float, Field(ge=0.0, le=0.6)] = 0.0
    correlation_mm: Annotated[float, Field(ge=0.2)] = 2.0
    gap_share: Annotated[float, Field(ge=0.0, le=0.7)] = 0.0
    finish: LocalFinishKey = None


@dataclass(frozen=True)
class AxialRidge(Shape):
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
        Chooses the course of everything that varies.

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
class RimBurr(Shape):
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
    lean_deg
        Angle of the flap from its direction, positive outwards over the edge.

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
    lean_deg: Lean = 0.0


@dataclass(frozen=True)
class Nick:
    """Missing material: a notch parallel to the axis in the outermost surface.

    Parameters
    ----------
    angle_deg
        atan2 angle of the middle of the notch.
    depth_mm, width_mm
        Largest depth along the normal of the surface; width of the mouth. A file may say ``height_mm`` for
        the depth, as results do, so that a suite can vary the size of burrs of all kinds by one path.
    z_start_mm, z_end_mm
        Extent along the axis; it may run out over the end faces, which nicks the edge.
    depth_variation, seed
        As ``height_variation`` and ``seed`` of :class:`AxialRidge`.
    finish
        Of its flanks, as of :class:`Shape`.

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    depth_mm: Annotated[Length, Field(validation_alias=AliasChoices("depth_mm", "height_mm"))]
    width_mm: Length
    z_start_mm: float
    z_end_mm: float
    depth_variation: Share = 0.0
    seed: Annotated[int, Field(ge=0)] = 0
    kind: Literal["nick"] = "nick"
    finish: LocalFinishKey = None


def tip_thickness_mm(burr: AxialRidge | RimBurr) -> float:
    """Thickness at the tip: as stated, or by the section's rule."""
    if burr.tip_mm is not None:
        return burr.tip_mm
    return min(0.6 * burr.width_mm, 0.3 * burr.height_mm) if burr.section == "rolled" else 0.3 * burr.width_mm


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
