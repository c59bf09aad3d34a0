"""What ``capture.json`` and ``rig.json`` hold, as dataclasses that documents are read into."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.documents import STRICT
from burrscan.pose import rigid
from burrscan.rig import NO_DISTORTION, Rig, View

Positive = Annotated[float, Field(gt=0.0)]
Levels = Annotated[tuple[float, ...], Field(min_length=256, max_length=256)]
Pixels = Annotated[int, Field(gt=0, le=16384)]
"""As many as a scene's devices may have: what is built of a raster is bounded before it is allocated."""
Row = tuple[float, float, float, float]


@dataclass(frozen=True)
class ViewDocument:
    """One device of ``rig.json``; see :class:`burrscan.rig.View`."""

    __pydantic_config__ = STRICT

    width: Pixels
    height: Pixels
    fx: Positive
    fy: Positive
    cx: float
    cy: float
    distortion: tuple[float, float, float, float, float] = NO_DISTORTION


@dataclass(frozen=True)
class RigDocument:
    """``rig.json``."""

    __pydantic_config__ = STRICT

    camera: ViewDocument
    projector: ViewDocument
    T_projector_camera: tuple[Row, Row, Row, Row]
    unit: Literal["mm"] = "mm"

    def rig(self, *, source: str = "rig.json") -> Rig:
        """The calibration; :class:`burrscan.errors.InputError` where its pose is no rigid motion."""
        return Rig(
            camera=View(**vars(self.camera)),
            projector=View(**vars(self.projector)),
            T_projector_camera=rigid(np.array(self.T_projector_camera), what=f"{source}: T_projector_camera"),
        )


@dataclass(frozen=True)
class CameraDocument:
    """The camera of ``capture.json``; see :class:`burrscan.devices.CameraSheet`."""

    __pydantic_config__ = STRICT

    bit_depth: Annotated[int, Field(ge=1, le=16)]
    full_well_e: Positive
    read_noise_e: Annotated[float, Field(ge=0.0)]
    black_level_dn: Annotated[float, Field(ge=0.0)]
    exposure_range_ms: tuple[Positive, Positive]
    response: tuple[tuple[float, ...], ...] = ()
    crosstalk: tuple[tuple[float, ...], ...] = ()

    def sheet(self) -> CameraSheet:
        """The data sheet."""
        return CameraSheet(**vars(self))


@dataclass(frozen=True)
class CapturedCameraDocument:
    """The camera of a capture: as :class:`CameraDocument`, but what its pictures tell may be left out."""

    __pydantic_config__ = STRICT

    bit_depth: Annotated[int, Field(ge=1, le=16)]
    black_level_dn: Annotated[float, Field(ge=0.0)]
    exposure_range_ms: tuple[Positive, Positive]
    full_well_e: Positive | None = None
    read_noise_e: Annotated[float, Field(ge=0.0)] | None = None
    response: tuple[tuple[float, ...], ...] = ()
    crosstalk: tuple[tuple[float, ...], ...] = ()

    @property
    def complete(self) -> bool:
        """Whether nothing has to be estimated."""
        return self.full_well_e is not None and self.read_noise_e is not None

    def sheet(self, *, full_well_e: float = 0.0, read_noise_e: float = 0.0) -> CameraSheet:
        """The data sheet, with these values in place of what is left out."""
        noise = {
            "full_well_e": full_well_e if self.full_well_e is None else self.full_well_e,
            "read_noise_e": read_noise_e if self.read_noise_e is None else self.read_noise_e,
        }
        return CameraSheet(**{**vars(self), **noise})


@dataclass(frozen=True)
class ProjectorDocument:
    """The projector of ``capture.json``; see :class:`burrscan.devices.ProjectorSheet`."""

    __pydantic_config__ = STRICT

    light: Levels | tuple[Levels, ...]
    crosstalk: tuple[tuple[float, ...], ...] = ()

    def sheet(self) -> ProjectorSheet:
        """The data sheet."""
        return ProjectorSheet(np.array(self.light), self.crosstalk)


@dataclass(frozen=True)
class Shot:
    """One picture of a capture."""

    __pydantic_config__ = STRICT

    name: str
    exposure_ms: Positive
    pattern: str
    image: str


@dataclass(frozen=True)
class ScanDocument:
    """The strategy that chose the shots.

    Parameters
    ----------
    method
        A key of :data:`burrscan.scan.METHODS`, or ``"module:function"``.
    parameters
        What it was called with.
    version
        Of burrscan when it was recorded.

    """

    __pydantic_config__ = STRICT

    method: str
    parameters: Mapping[str, Any] = field(default_factory=dict)
    version: str = ""


@dataclass(frozen=True)
class CaptureDocument:
    """``capture.json``; ``scan`` is absent where the strategy is not known, ``channels`` where it is grey."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-capture"]
    version: Literal[1]
    camera: CapturedCameraDocument
    projector: ProjectorDocument
    shots: Annotated[tuple[Shot, ...], Field(min_length=1)]
    scan: ScanDocument | None = None
    channels: Literal["mono", "rgb"] = "mono"
