"""Real CAD meshes: simulated single views of wheels with spokes and treads."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from bench.axis.revolution import axis_angle_deg
from burrscan.axis import find_axis
from burrscan.meshio import read_mesh
from tests.views import single_view

MESHES = Path(__file__).parents[3] / ".." / "shared" / "data" / "meshes"
AXES = {
    "husky_wheel.stl": 1,
    "tb3_left_tire.stl": 1,
    "jackal_wheel.stl": 2,
    "tm_torus.STL": 2,
    "tm_round.stl": 2,
    "tm_tube.obj": 1,
}


@pytest.mark.parametrize("name", AXES)
def test_single_views(name: str) -> None:
    path = MESHES / name
    if not path.exists():
        pytest.skip(f"{path} is not here")
    read = read_mesh(path)
    mesh = trimesh.Trimesh(read.vertices_mm, read.faces, process=True)  # STL repeats every vertex
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int32)
    truth = np.eye(3)[AXES[name]]
    whole = find_axis(read.vertices_mm, read.faces)  # as read
    assert axis_angle_deg(whole.direction, truth) < 0.05
    assert whole.undetermined == ()
    views = np.random.default_rng(7).normal(size=(8, 3))
    # Along a tube little but its end is seen; its own facets (12 degrees each) tilt what is left.
    if name == "tm_tube.obj":
        views[:, 1] *= 0.3
    for view in views:
        points, triangles = single_view(vertices, faces, view, pixels=220)
        axis = find_axis(points, triangles)
        assert axis_angle_deg(axis.direction, truth) < 0.3, view
