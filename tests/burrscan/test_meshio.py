from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

import burrscan
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.errors import InputError
from burrscan.meshio import (
    UNITS_MM,
    inspection_document,
    read_mesh,
    write_deviation_ply,
    write_inspection_json,
)
from tests.data import AXES, UNIT, meshes


@pytest.mark.parametrize("suffix", [".ply", ".stl", ".obj", ".STL"])
def test_what_is_written_is_read(tmp_path: Path, suffix: str) -> None:
    box = trimesh.creation.cylinder(radius=10.0, height=5.0, sections=24)
    path = tmp_path / f"part{suffix}"
    path.write_bytes(_bytes(box.export(file_type=suffix[1:].lower())))
    mesh = read_mesh(path)
    assert np.ptp(mesh.vertices_mm, axis=0) == pytest.approx([20.0, 20.0, 5.0], abs=1e-3)
    assert len(mesh.faces) == len(box.faces)
    assert mesh.notices == ()


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


@pytest.mark.parametrize("unit", list(UNITS_MM))
def test_units(tmp_path: Path, unit: str) -> None:
    path = tmp_path / "box.ply"
    path.write_bytes(_bytes(trimesh.creation.box((1.0, 2.0, 3.0)).export(file_type="ply")))
    extent = np.ptp(read_mesh(path, unit=unit).vertices_mm, axis=0)
    assert extent == pytest.approx(np.array([1.0, 2.0, 3.0]) * UNITS_MM[unit])


def test_a_cloud_and_nan_are_read_with_a_notice(tmp_path: Path) -> None:
    path = tmp_path / "cloud.ply"
    rows = ["1 2 3", "nan 0 0", "4 5 6"]
    header = ["ply", "format ascii 1.0", "element vertex 3"]
    header += [f"property float {axis}" for axis in "xyz"]
    path.write_text("\n".join([*header, "end_header", *rows]) + "\n")
    mesh = read_mesh(path)
    assert mesh.vertices_mm == pytest.approx(np.array([[1, 2, 3], [4, 5, 6]]))
    assert len(mesh.faces) == 0
    assert [notice.split()[0] for notice in mesh.notices] == ["1", "no"]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.ply", None, "no such file"),
        ("a.step", b"x", "no mesh format"),
        ("a.ply", b"not a mesh", "cannot be read as PLY"),
        ("a.stl", b"", "a.stl"),
        ("a.obj", b"", "a.obj"),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "a.ply"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, name: str, content: bytes | None, message: str) -> None:
    path = tmp_path / name
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(InputError, match=message) as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)


def test_an_unknown_unit_gets_a_suggestion(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'inch'"):
        read_mesh(tmp_path / "a.ply", unit="inches")


def test_the_deviation_ply_opens_elsewhere(tmp_path: Path) -> None:
    scan = revolution_scan("cylinder", shape=(20, 10), sigma_mm=0.1)
    deviation = np.linspace(-1.0, 1.0, len(scan.vertices_mm))
    deviation[3] = np.nan
    path = tmp_path / "deviation.ply"
    write_deviation_ply(path, scan.vertices_mm, scan.faces, deviation)
    mesh = trimesh.load(path, process=False)
    data = mesh.metadata["_ply_raw"]["vertex"]["data"]
    assert np.asarray(data["deviation_mm"]).ravel() == pytest.approx(deviation, nan_ok=True, abs=1e-6)
    assert mesh.vertices == pytest.approx(scan.vertices_mm, abs=1e-4)
    assert (mesh.faces == scan.faces).all()
    colours = mesh.visual.vertex_colors[:, :3].astype(int)
    assert colours[0, 2] > colours[0, 0] + 50  # blue where material is missing
    assert colours[-1, 0] > colours[-1, 2] + 50  # red where there is too much
    assert (colours[3] == 128).all()


def test_the_document_is_json_with_units_in_its_keys(tmp_path: Path) -> None:
    scan = revolution_scan("cylinder", sigma_mm=0.05, burrs=(RidgeBurr(),))
    inspection = burrscan.inspect_mesh(scan.vertices_mm, scan.faces, limit_mm=1.0)
    path = tmp_path / "result.json"
    write_inspection_json(path, inspection)
    document = json.loads(path.read_text())
    assert document == inspection_document(inspection)
    (burr,) = document["burrs"]
    assert burr["height_mm"]["value"] == pytest.approx(2.0, abs=0.1)
    assert burr["within_limit"] is False
    assert np.shape(burr["T_mesh_burr"]) == (4, 4)
    assert document["deviation"]["vertices"] == len(scan.vertices_mm)
    assert document["axis"]["method"] == "profile"


@pytest.mark.study
@pytest.mark.parametrize("path", meshes())
def test_others_meshes_get_an_answer(path: Path) -> None:
    mesh = read_mesh(path, unit=UNIT.get(path.name, "mm"))
    inspection = burrscan.inspect_mesh(mesh.vertices_mm, mesh.faces)
    assert abs(inspection.axis.direction[AXES[path.name]]) > np.cos(np.radians(0.3))
    assert np.isfinite(inspection.deviation_mm).mean() > 0.6
    size = np.ptp(mesh.vertices_mm, axis=0).max()
    assert np.nanmedian(np.abs(inspection.deviation_mm)) < 0.01 * size
