"""A scan of a rendered scene, with the truth that the page compares it with."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bench.reproduction.clocked import Clocked
from bench.reproduction.parts import Numbers
from bench.synthetic.revolution import axis_angle_deg
from burrscan.arrays import Floats, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.inspection import Axis
from burrscan.meshing import surface
from burrscan.pipeline import Stage, stage_function
from burrscan.pose import placed
from scenes.scene import content_hash, scene_from
from scenes.simulate import Simulation, simulate
from scenes.transport.store import default_folder


@dataclass(frozen=True)
class Scanned:
    """A scan of a rendered scene as plain arrays, and the truth of its axis.

    Parameters
    ----------
    arrays
        ``vertices_mm``, ``faces``, ``sigma_mm``, ``pixels``, ``points_mm``, ``white``, ``image``,
        ``saturated``, ``u_error_px``, ``u_response_px``, ``measurable``, ``on_burr``,
        ``T_part_camera``, ``outline_zr_mm``, ``true_points_mm``, ``frames``, ``exposure_ms``, ``full_dn``,
        ``shown_ms`` and ``computed_s``: how long its pictures last, processor time of scan and mesh.

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
    def mesh(self) -> tuple[Floats, Ints32]:
        """Vertices and faces."""
        return self.vertices_mm, self.faces

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
        return np.asarray(placed(T, self.vertices_mm))

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

    def u_rms_px(self) -> float:
        """Root mean square of the columns' errors where they are within a projector pixel."""
        error = self.arrays["u_error_px"]
        near = error[np.abs(error) <= 1.0].astype(float)
        return float(np.sqrt(np.mean(near**2))) if len(near) else float("nan")

    def wrong(self) -> float:
        """Share of the accepted pixels that are more than a projector pixel off."""
        error = self.arrays["u_error_px"]
        known = np.isfinite(error)
        return float((np.abs(error[known]) > 1.0).mean()) if known.any() else 0.0


def in_frame(vertices_mm: Floats, axis: Axis) -> Floats:
    """(V, 3) vertices in the part frame of an axis found."""
    T = T_part_mesh(axis.point_mm, axis.direction)
    return np.asarray(placed(T, vertices_mm))


_LAST: dict[str, Simulation] = {}


def _simulation(document: Mapping[str, Any]) -> Simulation:
    """The scene's light; the last one is kept, for several strategies look at it in turn."""
    key = content_hash(document)
    if key not in _LAST:
        _LAST.clear()
        _LAST[key] = simulate(scene_from(document, source="paper"), cache_dir=default_folder())
    return _LAST[key]


def scanned(document: Mapping[str, Any], stage: Stage) -> Numbers:
    """The arrays of a scan of a scene by a strategy."""
    simulation = _simulation(document)
    scanner = Clocked(simulation.scanner())
    start = time.process_time()
    scan = stage_function(stage, "scan")(scanner)
    mesh = surface(scan.correspondence, scanner.rig, radiance=scan.radiance)
    computed_s = time.process_time() - start - scanner.rendering_s
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
        "shown_ms": np.asarray(scanner.shown_ms),
        "computed_s": np.asarray(computed_s),
        "full_dn": np.asarray(scanner.camera.saturation_dn),
        **({} if scan.intensity is None else {"intensity": scan.intensity}),
    }
