"""Meshes and poses that are damaged, degenerate or none: refused in one line, or read as if nothing were."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from bench.synthetic.spec import MeshSpec, scanned
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.generatrix.covariance import _between
from burrscan.meshio import read_mesh
from burrscan.pose import rigid
from tests.tiers import some_of

SCAN = scanned(MeshSpec(around=120, along=40), identity=(1,))


@pytest.mark.parametrize("name", ["a.ply", "b.ply", "a.stl", "b.stl"])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9, 0.99])
def test_a_mesh_cut_off_is_refused(name: str, share: float, tmp_path: Path) -> None:
    kinds = {"a.ply": {"encoding": "ascii"}, "a.stl": {"file_type": "stl_ascii"}}
    path = tmp_path / name
    trimesh.creation.cylinder(20.0, 30.0, sections=48).export(path, **kinds.get(name, {}))
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=r"cut off|cannot be read"):
        read_mesh(path)


@pytest.mark.parametrize("name", ["m.obj", "m.ply", "m.stl"])
def test_a_comment_in_latin_1_is_no_obstacle(name: str, tmp_path: Path) -> None:
    path, kinds = tmp_path / name, {"m.ply": {"encoding": "ascii"}, "m.stl": {"file_type": "stl_ascii"}}
    trimesh.creation.box().export(path, **kinds.get(name, {}))
    lines = path.read_bytes().splitlines(keepends=True)
    put = {"m.obj": b"# caf\xe9\n", "m.ply": b"comment caf\xe9\n", "m.stl": b""}[name]
    first = lines[0].replace(b"solid", b"solid caf\xe9") if name == "m.stl" else lines[0]
    path.write_bytes(b"".join([first, lines[1], put, *lines[2:]]))
    assert len(read_mesh(path).faces) == 12


@some_of("far", [-99999.0, 1e200, 1e3, 1e30], first=2)
def test_one_vertex_anywhere_does_nothing(far: float) -> None:
    before = inspect_mesh(SCAN.vertices_mm, SCAN.faces).axis
    vertices = SCAN.vertices_mm.copy()
    vertices[777, 0] = far
    after = inspect_mesh(vertices, SCAN.faces).axis
    off_deg = np.degrees(np.arccos(min(1.0, abs(float(after.direction @ before.direction)))))
    assert off_deg < before.sigma_deg


def collinear() -> Floats:
    return np.outer(np.linspace(0.0, 9.0, 90), np.array([1.0, 2.0, 3.0]))


@pytest.mark.parametrize(
    ("vertices", "said"),
    [
        (collinear(), "one line"),
        (SCAN.vertices_mm * (1.0, 1.0, 0.0), "one plane"),
        (SCAN.vertices_mm * 1e300, "across"),
        (SCAN.vertices_mm * 1e-300, "across"),
    ],
)
def test_a_degenerate_mesh_is_named(vertices: Floats, said: str) -> None:
    with pytest.raises(InputError, match=said):
        inspect_mesh(vertices, None)


@pytest.mark.parametrize(
    ("pose", "said"),
    [
        (np.diag([2.0, 2.0, 2.0, 1.0]), "scales"),
        (np.diag([-1.0, 1.0, 1.0, 1.0]), "mirrors"),
        (np.eye(4) + np.outer([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1e300]), r"shifts by 1e\+300 mm"),
        (np.zeros((4, 4)), "last row"),
        (np.diag([0.0, 0.0, 0.0, 1.0]), "scales"),
        (np.diag([1.0, 1.0, 1.0, 2.0]), "last row"),
        (np.diag([1.0, np.nan, 1.0, 1.0]), "finite"),
    ],
)
def test_what_is_no_pose_is_refused(pose: Floats, said: str) -> None:
    with pytest.raises(InputError, match=said):
        rigid(pose, what="rig.json")


@pytest.mark.parametrize("nodes", [1, 2, 3, 4, 5, 9])
def test_a_curve_of_few_nodes_has_a_spread(nodes: int) -> None:
    count = np.ones((nodes, 16))
    assert _between(count, count * np.arange(16.0)).shape == (nodes,)


WHOLE_OBJ = b"v 0 0 0\nv 9 0 0\nv 0 9 0\nv 0 0 9\nf 1 2 3\nf 1/1 2/1 4/1\nf 2//3 3//3 4//3\n"


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\nv 1.5 2.", "line 5 is a vertex of fewer"),
        (b"v 0 0 0\nv 9 0 0\nv 0 9\nv 0 9 0\nf 1 2 3\n", "line 3 is a vertex of fewer"),
        (b"v 0 0 0\nv 9 0 0\nv 0 9 0\n f 1 2 # 3\r\nf 1 2 3\n", "line 4 is a face of fewer"),
        (b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\nv 1.5 2 -", "within its last line, a vertex"),
        (WHOLE_OBJ[:-2] + b"/", "within its last line, a face"),
        (WHOLE_OBJ + b"f 1 2", "line 8 is a face of fewer"),
        (WHOLE_OBJ + b"f 1 2 17", "its faces name vertex 17, it has 4"),
        (
            b"v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\nf 2 3 4\nv 0 0 9\nf 7 8 9\nv 1 2 3",
            "its faces name vertex 9, it has 5",
        ),
    ],
)
def test_an_obj_cut_off_is_refused(text: bytes, said: str, tmp_path: Path) -> None:
    path = tmp_path / "cut.obj"
    path.write_bytes(text)
    with pytest.raises(InputError, match=f"is cut off.*{said}|is cut off {said}") as caught:
        read_mesh(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "end",
    [
        b"",
        b"\n",
        b"vn 1 0 0\nf 1 2 3\r\n",
        b"# made by hand",
        b"f -1 -2 -3",
        b"f 1 2 3 4",
        b"v 1 2 3 0.5 0.5 0.5",
    ],
)
def test_an_obj_that_is_whole_is_read(end: bytes, tmp_path: Path) -> None:
    path = tmp_path / "whole.obj"
    path.write_bytes(WHOLE_OBJ.replace(b"/1", b"").replace(b"//3", b"") + end)
    assert len(read_mesh(path).faces) >= 3
