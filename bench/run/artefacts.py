"""Pictures and maps of each case, small enough to keep, for the report and for people.

``cases/<id>/truth.npz``, shared by the variants:

=================== ================== ======================================================================
``measurable``      (h, w) bool        pixels that the light could measure
``generatrix``      (K, 2) float32     true generatrix as (z, r), mm
``unrolled_mm``     (A, Z) float16     true deviation from the generatrix, mm, outwards positive; NaN: unseen
``unrolled_deg``    (2,) float32       the map's first and last angle (edges of its first and last row)
``unrolled_z_mm``   (2,) float32       the map's first and last position along the axis (edges)
``burr_angle_deg``  (B,) float32       true burrs: angle of the middle
``burr_z_mm``       (B, 2) float32     true burrs: first and last position along the axis
``burr_arc_deg``    (B,) float32       true burrs: half of the arc they span about that angle; 0: none
``burr_height_mm``  (B,) float32       true burrs: height
=================== ================== ======================================================================

``cases/<id>/<variant>.npz``:

=================== ================== ======================================================================
``white``           (h, w) uint8       camera image under white light, 255 = saturation
``pattern``         (H, W) uint8       one projected pattern, levels
``image``           (h, w) uint8       that pattern as the camera saw it, 255 = saturation
``intensity``       (H, W) uint8       adapted intensity mask, 255 = full light; absent where none is adapted
``pixels``          (h, w) uint8       0 not measurable and not accepted, 1 measurable but missed, 2 right,
                                       3 wrong (accepted, more than 1 px off), 4 saturated and not accepted
``depth_error_mm``  (h, w) float16     measured minus true depth of inliers, NaN elsewhere
``unrolled_mm``     (A, Z) float16     measured deviation from the generatrix found, same grid as the truth's
``generatrix``      (K, 2) float32     generatrix found as (z, r), mm, z in the true part frame; NaN row: gap
``burr_angle_deg``  (N,) float32       burrs found: angle in the true part frame
``burr_z_mm``       (N, 2) float32     burrs found: extent along the true axis
``burr_height_mm``  (N,) float32       burrs found: height
``burr_match``      (N,) int16         index of the true burr it matches, or -1: a false call
``mesh_mm``         (V, 3) float32     measured surface, at most 5000 vertices (:mod:`bench.run.decimate`)
``mesh_faces``      (F, 3) uint16      its faces
``mesh_values_mm``  (V,) float16       its deviation from the generatrix found
``camera_mm``       (3,) float32       where the camera stood; absent for a mesh that nobody scanned
=================== ================== ======================================================================

A mesh that nobody scanned has no pictures: only generatrix, unrolled map and burrs are there.

Camera images and maps wider than 480 pixels are thinned by a whole factor (images by block means, maps by
taking every n-th pixel); their ``(h, w)`` is therefore the preview's. Everything is in the true part frame,
so that truth and variants lie on top of each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.run.decimate import decimated_mesh
from bench.score.evidence import Evidence, PartEvidence
from bench.score.matching import Place
from bench.score.part import MeshEvidence, MeshTruth
from bench.score.places import true_place
from bench.score.unrolled import UnrolledGrid, grid_of, seen, unrolled_grid
from burrscan.arrays import Floats, Image, Ints32
from burrscan.files import written_whole
from burrscan.pose import placed
from scenes.truth import Truth
from scenes.wheel import TrueBurr, deviation_mm

_WIDEST = 480
"""Pixels of a map kept for the report; wider ones are thinned."""

MEASURABLE, RIGHT, WRONG, SATURATED = 1, 2, 3, 4
"""Codes of ``pixels`` beside 0, nothing there."""


def save_truth(folder: Path, truth: Truth) -> None:
    """Write ``truth.npz``."""
    points, wheel = truth.points_part_mm[seen(truth)], truth.wheel
    maps = _true_maps(unrolled_grid(truth), points, wheel.generatrix_zr_mm, wheel.burrs)
    _save(folder / "truth.npz", measurable=_thinned(truth.measurable), **maps)


def save_mesh_truth(folder: Path, truth: MeshTruth, vertices_mm: Floats) -> None:
    """Write ``truth.npz`` of a mesh that nobody scanned; its map is of the vertices, noise and all."""
    points = placed(truth.T_part_mesh, vertices_mm)
    _save(folder / "truth.npz", **_true_maps(grid_of(points), points, truth.generatrix_zr_mm, truth.burrs))


def save_mesh_variant(
    folder: Path, variant: str, evidence: MeshEvidence, vertices_mm: Floats, faces: Ints32
) -> None:
    """Write ``<variant>.npz`` of a mesh that nobody scanned."""
    points = placed(evidence.T_part_mesh, vertices_mm)
    maps = _found_maps(grid_of(points), points, evidence)
    _save(folder / f"{variant}.npz", **maps, **_mesh(points, faces, evidence))


def save_variant(folder: Path, variant: str, evidence: Evidence, saturation_dn: int) -> None:
    """Write ``<variant>.npz``."""
    scan = evidence.outcome.scan
    surface, pose = evidence.outcome.surface, evidence.T_part_mesh
    vertices = placed(pose, surface.vertices_mm)
    masks = {} if scan.intensity is None else {"intensity": np.round(scan.intensity * 255).astype(np.uint8)}
    _save(
        folder / f"{variant}.npz",
        white=_preview(scan.white, saturation_dn),
        pattern=scan.pattern,
        image=_preview(scan.image, saturation_dn),
        pixels=_thinned(_pixel_codes(evidence)),
        depth_error_mm=_thinned(evidence.depth_error_mm).astype(np.float16),
        camera_mm=placed(pose, np.zeros((1, 3)))[0].astype(np.float32),
        **_found_maps(unrolled_grid(evidence.truth), vertices, evidence),
        **_mesh(vertices, surface.faces, evidence),
        **masks,
    )


def _true_maps(
    grid: UnrolledGrid, points_mm: Floats, generatrix_zr_mm: Floats, burrs: Sequence[TrueBurr]
) -> dict[str, NDArray[Any]]:
    places = [true_place(burr) for burr in burrs]
    return {
        "generatrix": generatrix_zr_mm.astype(np.float32),
        "unrolled_mm": grid.mean(points_mm, deviation_mm(points_mm, generatrix_zr_mm)),
        "unrolled_deg": np.array(grid.deg, np.float32),
        "unrolled_z_mm": np.array(grid.z_mm, np.float32),
        "burr_arc_deg": np.array([place.arc_deg for place in places], np.float32),
        **_places(places),
    }


def _found_maps(grid: UnrolledGrid, points_mm: Floats, evidence: PartEvidence) -> dict[str, NDArray[Any]]:
    return {
        "unrolled_mm": grid.mean(points_mm, evidence.inspection.deviation_mm),
        "generatrix": evidence.generatrix_zr_mm.astype(np.float32),
        "burr_match": np.array(evidence.matching.match, np.int16),
        **_places(evidence.matching.found),
    }


def _mesh(points_mm: Floats, faces: Ints32, evidence: PartEvidence) -> dict[str, NDArray[Any]]:
    mesh = decimated_mesh(points_mm, faces, evidence.inspection.deviation_mm)
    return {"mesh_mm": mesh.vertices_mm, "mesh_faces": mesh.faces, "mesh_values_mm": mesh.values}


def _pixel_codes(evidence: Evidence) -> NDArray[np.uint8]:
    codes = np.zeros(evidence.right.shape, np.uint8)
    codes[evidence.truth.measurable] = MEASURABLE
    codes[evidence.outcome.scan.saturated] = SATURATED
    codes[evidence.accepted] = WRONG
    codes[evidence.right] = RIGHT
    return codes


def _places(places: Sequence[Place]) -> dict[str, NDArray[np.float32]]:
    return {
        "burr_angle_deg": np.array([place.angle_deg for place in places], np.float32),
        "burr_z_mm": np.array([(p.z_start_mm, p.z_end_mm) for p in places], np.float32).reshape(-1, 2),
        "burr_height_mm": np.array([place.height_mm for place in places], np.float32),
    }


def _factor(width: int) -> int:
    return -(-width // _WIDEST)


def _thinned(map_: NDArray[Any]) -> NDArray[Any]:
    step = _factor(map_.shape[1])
    return map_[::step, ::step]


def _preview(image: Image, saturation_dn: int) -> NDArray[np.uint8]:
    """Block means, 255 at saturation."""
    step = _factor(image.shape[1])
    rows, columns = (size // step for size in image.shape)
    blocks = image[: rows * step, : columns * step].reshape(rows, step, columns, step)
    shown = np.clip(np.asarray(blocks.mean(axis=(1, 3))) * (255.0 / saturation_dn), 0.0, 255.0)
    return np.asarray(shown.round(), np.uint8)


def _save(path: Path, **arrays: NDArray[Any]) -> None:
    with written_whole(path) as beside:
        np.savez_compressed(beside, allow_pickle=False, **arrays)
