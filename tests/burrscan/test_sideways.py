"""Projectors above or below their camera: the same scans, by rows that are counted as columns."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from burrscan import InputError, Patterns
from burrscan.arrays import Floats, Image
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.replay import replay
from burrscan.correspondence import Correspondence
from burrscan.pipeline import Pipeline, Stage, run
from burrscan.rig import Rig
from burrscan.scan.rivals.fixed import scan_fixed
from burrscan.scan.rivals.rows_and_columns import scan_rows_and_columns
from burrscan.scanner import PassThrough, Scanner
from burrscan.sideways import (
    across_columns,
    along_baseline,
    by_columns,
    on_its_side,
    quarter_turned,
    runs_along_columns,
)
from burrscan.triangulation import triangulate
from tests.burrscan.instrument import Instrument, cylinder_depth, plane_depth, small_rig

BELOW = np.array([[0.0, -1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
EXPOSURE_MS = 2.0


def below(*, width: int = 96, turns: int = 1) -> Rig:
    """A projector below its camera, upright there: the camera is laid on its side, and the scene with it."""
    rig = small_rig(width=width, distortion=(-0.1, 0.02, 0.002, -0.001, 0.0))
    pose = np.linalg.matrix_power(BELOW, turns) @ rig.T_projector_camera
    return replace(rig, T_projector_camera=pose)


@pytest.mark.parametrize("turns", [1, 3])
def test_the_raster_on_its_side_is_the_same_pixels_on_the_same_rays(turns: int) -> None:
    rig = below(turns=turns)
    assert runs_along_columns(rig)
    turned = across_columns(rig)
    assert not runs_along_columns(turned)
    assert np.linalg.det(turned.T_projector_camera[:3, :3]) == pytest.approx(1.0)  # no mirror image
    rays = rig.camera.rays(rig.camera.pixel_grid())
    points = rays * plane_depth(rays)[..., None]
    (u, v), (u_turned, v_turned) = (np.moveaxis(each.correspond(points), -1, 0) for each in (rig, turned))
    assert np.allclose(u_turned, v)
    assert np.allclose(v_turned, rig.projector.width - 1 - u)
    # what a pixel shows does not hang on how it is counted
    frame = np.random.default_rng(5).integers(0, 255, (1, *rig.projector.shape), np.uint8)
    height, width = rig.projector.shape
    lit = (u > 0.0) & (u < width - 1) & (v > 0.0) & (v < height - 1)
    lit &= (np.abs(np.stack([u, v]) % 1.0 - 0.5) > 0.01).all(axis=0)  # rounded alike
    seen, seen_turned = (
        frames[0, rows[lit].round().astype(int), columns[lit].round().astype(int)]
        for frames, rows, columns in ((frame, v, u), (on_its_side(frame), v_turned, u_turned))
    )
    assert np.array_equal(seen, seen_turned)
    assert lit.sum() > 1000


def test_a_rig_at_45_degrees_stays_as_it_is() -> None:
    rig = small_rig()
    pose = rig.T_projector_camera.copy()
    pose[1, 3] = -1.01 * pose[0, 3]
    rig = replace(rig, T_projector_camera=pose)
    assert across_columns(rig) is rig
    scanner = Instrument(rig)
    assert by_columns(scanner) is scanner


def test_rows_triangulate_as_columns_of_the_turned_rig() -> None:
    rig = below(width=160)
    rays = rig.camera.rays(rig.camera.pixel_grid())
    points = rays * plane_depth(rays)[..., None]
    uv = rig.correspond(points)
    ones = np.full(uv.shape[:2], 0.1, np.float32)
    seen = Correspondence(uv[..., 0].astype(np.float32), ones, ones > 0, uv[..., 1].astype(np.float32), ones)
    by_rows, turned = along_baseline(seen, rig)
    found, sigma = triangulate(by_rows, turned)
    assert np.abs(found - points).max() < 0.02
    assert np.isfinite(sigma).all()
    assert by_rows.v_px is not None
    assert np.allclose(np.stack([by_rows.u_px, by_rows.v_px], axis=-1), turned.correspond(points), atol=1e-3)


class Watched(PassThrough):
    """Remembers what was shown."""

    def __init__(self, scanner: Scanner) -> None:
        super().__init__(scanner)
        self.shown: list[Patterns] = []

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        self.shown.append(patterns)
        return self._scanner.capture(patterns, exposure_ms)


@pytest.mark.parametrize("method", ["fixed", "both"])
def test_the_projector_is_shown_rows_and_depth_is_right(method: str) -> None:
    """A scan of a plane whose projector stands below: its depths are those of the plane."""
    scanner = Instrument(below(), depth=plane_depth, decades=1.0)
    watched = Watched(scanner)
    scan = by_columns(watched)
    strategy = scan_fixed if method == "fixed" else scan_rows_and_columns
    correspondence = strategy(scan, exposure_ms=EXPOSURE_MS).correspondence
    points, sigma = triangulate(correspondence, scan.rig)
    assert correspondence.mask[scanner.response > 0.0].mean() > 0.95
    off = (points[..., 2] - scanner.depth_mm) / sigma
    assert np.nanmedian(np.abs(off)) < 1.0
    assert np.nanmedian(np.abs(points[..., 2] - scanner.depth_mm)) < 0.5
    stripes = [frame for patterns in watched.shown for frame in patterns.frames if np.ptp(frame) > 0]
    assert stripes
    assert all(frame.shape == scanner.rig.projector.shape for frame in stripes)
    if method == "fixed":
        assert all((frame == frame[:, :1]).all() for frame in stripes)


def test_the_whole_path_takes_a_projector_below() -> None:
    scanner = Instrument(below(width=128), decades=1.0, depth=_lying_cylinder)
    outcome = run(scanner, Pipeline(scan=Stage("fixed", {"exposure_ms": EXPOSURE_MS})))
    direction = outcome.inspection.axis.direction
    assert abs(direction[0]) > np.cos(np.radians(1.0))
    depths = outcome.surface.points_mm[..., 2]
    assert np.nanmedian(np.abs(depths - scanner.depth_mm)) < 0.5


def _lying_cylinder(rays: Floats) -> Floats:
    """Its axis along x, below the camera's."""
    return cylinder_depth(rays[..., [1, 0, 2]])


def recorded(folder: Path, *, method: str, as_it_stands: bool) -> Instrument:
    scanner = Instrument(below(), depth=plane_depth, decades=1.0)
    recorder = RecordingScanner(scanner, folder, scan=ScanDocument(method, {"exposure_ms": EXPOSURE_MS}))
    strategy = scan_fixed if method == "fixed" else scan_rows_and_columns
    strategy(recorder if as_it_stands else by_columns(recorder), exposure_ms=EXPOSURE_MS)
    recorder.close()
    return scanner


@pytest.mark.parametrize(("method", "as_it_stands"), [("fixed", False), ("both", False), ("both", True)])
def test_captures_of_it_are_replayed(tmp_path: Path, method: str, *, as_it_stands: bool) -> None:
    """Recorded by its rows, or by columns and rows as the projector stands: both give the depths."""
    instrument = recorded(tmp_path, method=method, as_it_stands=as_it_stands)
    rig = json.loads((tmp_path / "rig.json").read_text())["projector"]
    assert (rig["width"], rig["height"]) == (instrument.rig.projector.width, instrument.rig.projector.height)
    scan, scanner = replay(tmp_path)
    points, _ = triangulate(scan.correspondence, quarter_turned(scanner.rig))
    assert np.isfinite(points[..., 2])[instrument.response > 0.0].mean() > 0.95
    assert np.nanmedian(np.abs(points[..., 2] - instrument.depth_mm)) < 0.5


def test_columns_alone_are_refused_by_name(tmp_path: Path) -> None:
    recorded(tmp_path, method="fixed", as_it_stands=True)
    with pytest.raises(InputError, match="along which the baseline of this rig runs"):
        replay(tmp_path)
