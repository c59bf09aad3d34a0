"""Where the page's measurements are made and kept: scans of rendered wheels, results of sections."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np

import burrscan
import scenes
from bench.axis.revolution import axis_angle_deg
from bench.paper.parts import Numbers
from bench.paper.scenery import paper_scene
from bench.paper.sources import source_of, sources
from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.files import written_whole
from burrscan.inspection import Axis
from burrscan.meshing import surface
from burrscan.pipeline import Pipeline, Stage, stage_function
from scenes.scene import content_hash, scene_from
from scenes.simulate import Simulation, simulate
from scenes.transport.store import default_folder

SEED = Pipeline(scan=Stage("seed"), axis=Stage("seed"), generatrix=Stage("radius"), burrs=Stage("seed"))
"""The paper's method in every stage."""
DEFAULT = Pipeline()
PIPELINES: Mapping[str, Pipeline] = {"seed": SEED, "default": DEFAULT}
"""The two columns of the page."""
FULL_SCALE, QUICK_SCALE = 0.5, 0.2


@dataclass(frozen=True)
class Scanned:
    """A scan of a rendered scene as plain arrays, and the truth of its axis.

    Parameters
    ----------
    arrays
        ``vertices_mm``, ``faces``, ``sigma_mm``, ``pixels``, ``points_mm``, ``white``, ``image``,
        ``saturated``, ``u_error_px``, ``u_response_px``, ``measurable``, ``on_burr``,
        ``T_part_camera``, ``outline_zr_mm``, ``true_points_mm``, ``frames``, ``exposure_ms``, ``full_dn``.

    """

    arrays: Numbers

    @property
    def vertices_mm(self) -> Floats:
        """(V, 3) in the camera frame."""
        return np.ascontiguousarray(self.arrays["vertices_mm"])

    @property
    def faces(self) -> Ints32:
        """(T, 3)."""
        return np.ascontiguousarray(self.arrays["faces"])

    @property
    def sigma_mm(self) -> Floats:
        """(V,) stated standard deviation."""
        return np.ascontiguousarray(self.arrays["sigma_mm"], dtype=np.float64)

    @property
    def direction(self) -> Floats:
        """(3,) the true axis."""
        return np.ascontiguousarray(self.arrays["T_part_camera"][2, :3])

    @property
    def point_mm(self) -> Floats:
        """(3,) a point of the true axis."""
        T = self.arrays["T_part_camera"]
        return np.asarray(-T[:3, :3].T @ T[:3, 3])

    @cached_property
    def part_mm(self) -> Floats:
        """(V, 3) in the true part frame."""
        T = self.arrays["T_part_camera"]
        return np.asarray(self.vertices_mm @ T[:3, :3].T + T[:3, 3])

    def error_deg(self, direction: Floats) -> float:
        """Angle between a direction and the true axis."""
        return axis_angle_deg(direction, self.direction)

    def coverage(self, *, on_burr: bool = False) -> float:
        """Share of the measurable pixels, of all or of those on burrs, decoded within a projector pixel."""
        measurable = self.arrays["measurable"]
        if on_burr:
            measurable = measurable & self.arrays["on_burr"]
        right = np.abs(self.arrays["u_error_px"]) <= 1.0
        return float((right & measurable).sum() / max(measurable.sum(), 1))

    def wrong(self) -> float:
        """Share of the accepted pixels that are more than a projector pixel off."""
        error = self.arrays["u_error_px"]
        known = np.isfinite(error)
        return float((np.abs(error[known]) > 1.0).mean()) if known.any() else 0.0


def in_frame(vertices_mm: Floats, axis: Axis) -> Floats:
    """(V, 3) vertices in the part frame of an axis found."""
    T = T_part_mesh(axis.point_mm, axis.direction)
    return np.asarray(vertices_mm @ T[:3, :3].T + T[:3, 3])


@dataclass(frozen=True)
class Lab:
    """Makes scans and keeps every result in a work folder, so that an interrupted run goes on.

    Parameters
    ----------
    work
        The folder; what other code measured is never taken for this code's.
    quick
        A fifth of the raster and few repeats, to see that everything works.
    code
        What stands for the state of the code; by default a hash of its sources.

    """

    work: Path
    quick: bool = False
    code: str = field(default_factory=lambda: sources(Path(burrscan.__file__), Path(scenes.__file__)))

    @property
    def scale(self) -> float:
        """Of both rasters of the rig."""
        return QUICK_SCALE if self.quick else FULL_SCALE

    def repeats(self, full: int) -> int:
        """How many repeats stand for so many in a full run."""
        return max(full // 10, 3) if self.quick else full

    def kept(self, name: str, make: Callable[[], Numbers], *, also: str = "") -> Numbers:
        """Arrays by name: those of an earlier run, or made now and written for the next."""
        mark = hashlib.sha256(f"{self.code} {also} {self.quick}".encode()).hexdigest()[:12]
        path = self.work / f"{name}-{mark}.npz"
        if not path.exists():
            arrays: dict[str, Any] = {key: np.asarray(value) for key, value in make().items()}
            with written_whole(path) as beside:
                np.savez(beside, **arrays)
        with np.load(path, allow_pickle=False) as stored:
            return dict(stored)

    def of_section(self, name: str, module: ModuleType) -> Numbers:
        """What a section measured, kept as long as neither the code nor the section changes."""
        source = source_of(Path(str(module.__file__)))
        return self.kept(name, lambda: cast(Numbers, module.measure(self)), also=source)

    def scan(self, scene: str, method: str, *, spin_deg: float = 0.0, **parameters: Any) -> Scanned:
        """One scan of a scene of the page (:mod:`bench.paper.scenery`) by a strategy."""
        document = paper_scene(scene, scale=self.scale, spin_deg=spin_deg)
        key = f"scan-{scene}-{method}-{content_hash(document, parameters)}"
        return Scanned(self.kept(key, lambda: _scanned(document, Stage(method, parameters))))

    def pair(self, scene: str) -> dict[str, Scanned]:
        """The scan of both variants."""
        return {name: self.scan(scene, pipeline.scan.method) for name, pipeline in PIPELINES.items()}


_LAST: dict[str, Simulation] = {}


def _simulation(document: Mapping[str, Any]) -> Simulation:
    """The scene's light; the last one is kept, for several strategies look at it in turn."""
    key = content_hash(document)
    if key not in _LAST:
        _LAST.clear()
        _LAST[key] = simulate(scene_from(document, source="paper"), cache_dir=default_folder())
    return _LAST[key]


def _scanned(document: Mapping[str, Any], stage: Stage) -> Numbers:
    simulation = _simulation(document)
    scanner = simulation.scanner()
    scan = stage_function(stage, "scan")(scanner)
    mesh = surface(scan.correspondence, scanner.rig)
    truth = simulation.truth
    return {
        "vertices_mm": mesh.vertices_mm,
        "faces": mesh.faces,
        "sigma_mm": mesh.vertex_sigma_mm,
        "pixels": mesh.pixels,
        "points_mm": mesh.points_mm.astype(np.float32),
        "white": scan.white,
        "image": scan.image,
        "saturated": scan.saturated,
        "u_error_px": np.where(
            scan.correspondence.mask, scan.correspondence.u_px - truth.u_response_px, np.nan
        ).astype(np.float32),
        "u_response_px": truth.u_response_px.astype(np.float32),
        "measurable": truth.measurable,
        "on_burr": truth.burr_index >= 0,
        "T_part_camera": truth.T_part_camera,
        "outline_zr_mm": truth.wheel.generatrix_zr_mm,
        "true_points_mm": truth.points_mm.astype(np.float32),
        "frames": np.asarray(scan.frames),
        "exposure_ms": np.asarray(scan.exposures_ms[0]),
        "full_dn": np.asarray(scanner.camera.saturation_dn),
        **({} if scan.intensity is None else {"intensity": scan.intensity}),
    }
