"""Zones and blemishes as written in TOML: what is on a wheel and is no burr."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from burrscan.documents import STRICT
from scenes.finish import LocalFinish, LocalFinishKey

Length = Annotated[float, Field(gt=0.0)]
Angle = Annotated[float, Field(ge=-360.0, le=360.0)]
Share = Annotated[float, Field(gt=0.0, le=1.0)]


@dataclass(frozen=True, kw_only=True)
class Zone:
    """A stretch of the wheel along its axis with a finish of its own, such as a ground rim on a turned hub.

    Parameters
    ----------
    z_start_mm, z_end_mm
        From where to where; every surface of the wheel there, the bore too. Its edges are edges of the mesh.
    finish
        A name, or what differs from the wheel's (:class:`scenes.finish.LocalFinish`).

    """

    __pydantic_config__ = STRICT

    z_start_mm: float
    z_end_mm: float
    finish: LocalFinishKey


@dataclass(frozen=True, kw_only=True)
class Patch:
    """What stain and bright spot share: an ellipse with a wavy rim.

    Parameters
    ----------
    angle_deg
        atan2 angle of its middle.
    z_mm
        Its middle along the axis, on the outermost surface there; with ``r_mm``, the outline's nearest
        point.
    length_mm, width_mm
        Across the circumference (along the wheel's outline), and along it. A length along the circumference
        is one at the radius of the middle.
    waviness
        Standard deviation of the rim's radius as a share of it: five harmonics with phases by ``seed``.

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    z_mm: float
    r_mm: Annotated[float, Field(ge=0.0)] | None = None
    length_mm: Length = 6.0
    width_mm: Length = 6.0
    waviness: Annotated[float, Field(ge=0.0, le=0.3)] = 0.12
    seed: Annotated[int, Field(ge=0)] = 0


@dataclass(frozen=True, kw_only=True)
class Stain(Patch):
    """Dried coolant, rust or dirt: a diffuse film over part of the metal.

    Parameters
    ----------
    cover
        Share of the metal that it covers in its middle.
    reflectance
        Of the film.

    """

    cover: Share = 0.7
    reflectance: Annotated[float, Field(ge=0.0, le=1.0)] = 0.25
    kind: Literal["stain"] = "stain"


@dataclass(frozen=True, kw_only=True)
class BrightSpot(Patch):
    """A place rubbed smooth, as by a clamp or a roller.

    Parameters
    ----------
    finish
        Of the spot; polished metal without it.

    """

    finish: LocalFinishKey = LocalFinish(name="polished")
    kind: Literal["bright_spot"] = "bright_spot"


@dataclass(frozen=True, kw_only=True)
class Scratch:
    """A straight shallow groove: too shallow to be a nick.

    Its depth turns the normals only: at a few µm no camera here sees the displacement itself.

    Parameters
    ----------
    angle_deg, z_mm, r_mm
        Of its middle, as of :class:`Patch`.
    length_mm, width_mm
        Along and across the scratch.
    depth_um
        Of its middle line; its profile is a cosine.
    direction_deg
        0 along the circumference, 90 across it.
    finish
        Inside; without it what a burr has (:func:`scenes.finish.torn`).

    """

    __pydantic_config__ = STRICT

    angle_deg: Angle
    z_mm: float
    r_mm: Annotated[float, Field(ge=0.0)] | None = None
    length_mm: Length = 15.0
    width_mm: Annotated[float, Field(ge=0.02)] = 0.15
    depth_um: Annotated[float, Field(ge=0.0, le=10.0)] = 3.0
    direction_deg: Annotated[float, Field(ge=-180.0, le=180.0)] = 60.0
    finish: LocalFinishKey = None
    kind: Literal["scratch"] = "scratch"


@dataclass(frozen=True, kw_only=True)
class Chatter:
    """Marks of a vibrating tool: a ripple along the circumference, and a rougher cut.

    The ripple turns the normals only: below 10 µm it is no shape that a scanner here resolves. A whole number
    of waves fits the circumference, the nearest to the wavelength.

    Parameters
    ----------
    z_start_mm, z_end_mm
        Where on the outermost surface.
    angle_deg, arc_deg
        Middle and extent along the circumference: all round, or at most 170 degrees.
    wavelength_mm
        At the band's middle.
    height_um
        From the bottom of a wave to its top.
    roughness
        The finish's alpha is multiplied by this.

    """

    __pydantic_config__ = STRICT

    z_start_mm: float
    z_end_mm: float
    angle_deg: Angle = 0.0
    arc_deg: Annotated[float, Field(gt=0.0, le=170.0)] | Literal[360] = 360
    wavelength_mm: Annotated[float, Field(ge=0.2)] = 2.5
    height_um: Annotated[float, Field(ge=0.0, le=10.0)] = 6.0
    roughness: Annotated[float, Field(ge=0.2, le=5.0)] = 1.5
    kind: Literal["chatter"] = "chatter"


Blemish = Annotated[Stain | BrightSpot | Scratch | Chatter, Field(discriminator="kind")]
"""A blemish as written in TOML; the key ``kind`` says which."""
