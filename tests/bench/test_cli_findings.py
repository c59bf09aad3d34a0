import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from bench.cli import main
from bench.synthetic.revolution import RevolutionScan, RidgeBurr, revolution_scan
from burrscan import inspect_mesh
from burrscan.arrays import Floats, Ints32
from burrscan.errors import InputError
from burrscan.meshio import read_mesh
from burrscan.ply import write_ply
from tests.tiers import some_of


def test_detect_tells_of_checks_that_failed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    ball = revolution_scan("sphere", sigma_mm=0.1, shape=(160, 80))
    trimesh.Trimesh(ball.vertices_mm, ball.faces, process=False).export(tmp_path / "ball.ply")
    found = tmp_path / "found.json"
    assert main(["detect", str(tmp_path / "ball.ply"), "--json", str(found)]) == 0
    told = capsys.readouterr().out
    assert "check failed  determined" in told
    checks = {check["name"]: check for check in json.loads(found.read_text())["checks"]}
    assert checks["determined"]["passed"] is False
    assert "direction" in checks["determined"]["reason"]
    assert checks["residual_symmetry"]["passed"] is True
    assert "any other as good" in told


def _inspected(folder: Path, vertices_mm: Floats, faces: Ints32, *more: str) -> dict[str, Any]:
    """What the command line finds on a mesh that went through a file."""
    trimesh.Trimesh(vertices_mm, faces, process=False).export(folder / "mesh.ply")
    assert main(["detect", str(folder / "mesh.ply"), "--json", str(folder / "found.json"), *more]) == 0
    found: dict[str, Any] = json.loads((folder / "found.json").read_text("utf-8"))
    return found


@pytest.fixture(scope="module")
def scan() -> RevolutionScan:
    return revolution_scan(sigma_mm=0.05, shape=(160, 80), burrs=(RidgeBurr(width_deg=4.0),), seed=4)


@some_of("harm", ["half flipped", "cloud", "not numbers", "twice", "shuffled", "nothing"], first=3)
def test_detect_bears_hard_meshes(scan: RevolutionScan, tmp_path: Path, harm: str) -> None:
    rng = np.random.default_rng(5)
    vertices, faces = scan.vertices_mm.copy(), scan.faces.copy()
    if harm == "shuffled":
        order = rng.permutation(len(vertices))
        vertices, faces = vertices[order], rng.permutation(np.argsort(order)[faces]).astype(np.int32)
    elif harm == "cloud":
        faces = faces[:0]
    elif harm == "twice":
        vertices, faces = np.vstack([vertices] * 2), np.vstack([faces, faces + np.int32(len(vertices))])
    elif harm == "half flipped":
        flip = rng.random(len(faces)) < 0.5
        faces[flip] = faces[flip][:, ::-1]
    elif harm == "not numbers":
        vertices[rng.choice(len(vertices), 300)] = np.nan
    found = _inspected(tmp_path, vertices, faces)
    assert scan.angle_error_deg(np.array(found["axis"]["direction"])) < 0.02
    (burr,) = found["burrs"]
    assert burr["side"] == "protrusion"
    assert abs(burr["height_mm"]["value"] - 2.0) < 0.15


@pytest.mark.parametrize("scale", [0.005, 50.0])
def test_detect_from_a_millimetre_to_ten_metres(scan: RevolutionScan, tmp_path: Path, scale: float) -> None:
    found = _inspected(tmp_path, scale * scan.vertices_mm, scan.faces)
    assert scan.angle_error_deg(np.array(found["axis"]["direction"])) < 0.02
    assert abs(found["burrs"][0]["height_mm"]["value"] / scale - 2.0) < 0.15


@pytest.mark.parametrize("limit", ["-1", "nan", "wide"])
def test_a_limit_is_a_length(scan: RevolutionScan, tmp_path: Path, limit: str) -> None:
    with pytest.raises(SystemExit) as ended:
        _inspected(tmp_path, scan.vertices_mm, scan.faces, "--limit", limit)
    assert ended.value.code == 2
    with pytest.raises(InputError, match="size limit"):
        inspect_mesh(scan.vertices_mm, scan.faces, limit_mm=-1.0)


@pytest.mark.parametrize(
    ("name", "content", "why"),
    [
        ("none.ply", None, "no such file"),
        ("part.step", b"x", "known: .ply"),
        ("empty.ply", b"", "cannot be read"),
        ("torn.stl", b"solid x\nfoo", "cut off"),
        ("few.obj", b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "only 3 usable vertices"),
    ],
)
def test_a_bad_mesh_ends_with_one_clear_message(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], name: str, content: bytes | None, why: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    assert main(["detect", str(tmp_path / name)]) == 2
    told = capsys.readouterr()
    assert why in told.err
    assert told.err.count("\n") == 1
    assert not told.out


def test_the_ply_of_deviations_keeps_the_stated_sigma(scan: RevolutionScan, tmp_path: Path) -> None:
    sigma = np.linspace(0.04, 0.06, len(scan.vertices_mm))
    write_ply(tmp_path / "in.ply", scan.vertices_mm, scan.faces, scalars={"sigma_mm": sigma})
    assert main(["detect", str(tmp_path / "in.ply"), "--ply", str(tmp_path / "out.ply")]) == 0
    again = read_mesh(tmp_path / "out.ply")
    assert again.sigma_mm is not None
    np.testing.assert_allclose(again.sigma_mm, sigma, rtol=1e-6)
    assert b"property float deviation_mm" in (tmp_path / "out.ply").read_bytes()[:400]
