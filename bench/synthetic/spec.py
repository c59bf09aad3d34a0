"""A synthetic scan as a suite writes it: shape, arc, noise, one burr; and what it makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from bench.synthetic.grids import MIDDLE_RADIUS_MM, grid_scan
from bench.synthetic.revolution import (
    SHAPES,
    Disturbance,
    RevolutionScan,
    RidgeBurr,
    profile_of,
    reached,
    revolution_scan,
)
from burrscan.arrays import Floats
from burrscan.documents import STRICT, build
from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.scene import content_hash

MESH_VERSION = 1
"""Raised when the same tables make another mesh: two of them are then no longer comparable."""

Count = Annotated[int, Field(ge=4, le=20_000)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]


@dataclass(frozen=True)
class MeshSpec:
    """A partial scan of a surface of revolution, without any rendering.

    Parameters
    ----------
    shape
        A name of :data:`bench.synthetic.revolution.SHAPES`.
    generatrix
        Points ``[z, r]`` in mm of a shape of one's own, instead of ``shape``.
    arc_deg
        How much of the circumference the scan shows.
    around, along
        Vertices of the grid; the default has 122,682 triangles.
    sigma_mm
        Noise along the normal.
    correlated_over
        Width in vertices over which the noise is averaged; 1 is independent noise.
    outlier_share
        Share of the vertices that are displaced by up to 20 mm.
    scale
        Multiplies everything, noise included.
    grid_deg
        Angle of the rows of vertices to the axis; without it they run along the axis, and along a burr.
    burr
        Ridges on it.

    """

    __pydantic_config__ = STRICT

    shape: str = "stepped_wheel"
    generatrix: tuple[tuple[float, float], ...] | None = None
    arc_deg: Annotated[float, Field(gt=0.0, le=360.0)] = 140.0
    around: Count = 484
    along: Count = 128
    sigma_mm: NotNegative = 0.05
    correlated_over: Annotated[int, Field(ge=1, le=99)] = 1
    outlier_share: Annotated[float, Field(ge=0.0, le=0.9)] = 0.0
    scale: Positive = 1.0
    grid_deg: Annotated[float, Field(ge=-90.0, le=90.0)] | None = None
    burr: tuple[RidgeBurr, ...] = ()

    @property
    def profile_zr_mm(self) -> Floats:
        """(K, 2) the shape's polyline, scale applied."""
        polyline = profile_of(self.shape) if self.generatrix is None else np.array(self.generatrix, float)
        return self.scale * polyline

    @property
    def burrs(self) -> tuple[RidgeBurr, ...]:
        """Those that have a height."""
        return tuple(burr for burr in self.burr if burr.height_mm > 0.0)


def mesh_from(document: Mapping[str, Any], *, source: str) -> MeshSpec:
    """A synthetic scan of plain tables.

    Raises
    ------
    InputError
        With every error in the tables.

    """
    spec = build(MeshSpec, document, source=source)
    if spec.generatrix is None and spec.shape not in SHAPES:
        raise InputError(f"{source}: unknown shape '{spec.shape}': {suggest(spec.shape, list(SHAPES))}")
    if spec.generatrix is not None and len(spec.generatrix) < 2:
        raise InputError(f"{source}: a generatrix needs two points at least")
    if spec.grid_deg is not None and (spec.scale != 1.0 or spec.correlated_over not in {1, 3}):
        raise InputError(f"{source}: with grid_deg, scale must be 1 and correlated_over 1 or 3")
    return spec


def mesh_hash(document: Mapping[str, Any]) -> str:
    """Hash of everything that the mesh depends on but its random stream."""
    return content_hash(mesh_from(document, source="mesh"), f"mesh {MESH_VERSION}")


def scanned(spec: MeshSpec, *, identity: tuple[int, ...]) -> RevolutionScan:
    """The mesh: pose, noise and outliers are drawn from the identity's own stream."""
    if spec.grid_deg is not None:
        return _turned_grid(spec, spec.grid_deg, identity)
    return revolution_scan(
        spec.profile_zr_mm / spec.scale,
        arc_deg=spec.arc_deg,
        shape=(spec.around, spec.along),
        sigma_mm=spec.sigma_mm,
        correlated_over=spec.correlated_over,
        seed=identity,
        burrs=spec.burrs,
        scale=spec.scale,
        outlier_share=spec.outlier_share,
    )


def _turned_grid(spec: MeshSpec, turn_deg: float, identity: tuple[int, ...]) -> RevolutionScan:
    """A square grid of about as many cells as the spec's rows and columns have, at an angle to the axis."""
    outline = spec.profile_zr_mm
    around_mm = float(np.radians(spec.arc_deg)) * MIDDLE_RADIUS_MM
    cells = (spec.around - 1) * (spec.along - 1)
    return grid_scan(
        outline,
        turn_deg=turn_deg,
        noise=Disturbance(spec.sigma_mm, spec.correlated_over, spec.outlier_share),
        seed=identity,
        arc_deg=spec.arc_deg,
        burrs=spec.burrs,
        spacing_mm=float(np.sqrt(around_mm * reached(outline)[-1] / cells)),
    )
