"""`burrscan merge`: files in, one mesh and the poses out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from burrscan.meshio import read_mesh
from burrscan.ply import write_ply
from tests.burrscan.registration.views import true_pose, view

TURNS = (0.0, 70.0)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    here = tmp_path_factory.mktemp("views")
    rng = np.random.default_rng(4)
    views = [view(turn, rng, robot_mm=0.4 * (turn > 0.0), robot_deg=0.2 * (turn > 0.0)) for turn in TURNS]
    for number, one in enumerate(views):
        write_ply(here / f"{number}.ply", one.vertices_mm, one.faces, scalars={"sigma_mm": one.sigma_mm})
    poses = {"sigma_mm": 0.4, "T_world_camera": [one.T_world_camera.tolist() for one in views]}
    (here / "poses.json").write_text(json.dumps(poses))
    return here


def merge(folder: Path, *more: str) -> int:
    files = [str(folder / f"{number}.ply") for number in range(len(TURNS))]
    return main(
        ["merge", *files, "--poses", str(folder / "poses.json"), "--out", str(folder / "all.ply"), *more]
    )


def test_two_views_become_one_mesh(folder: Path) -> None:
    assert merge(folder, "--json", str(folder / "aligned.json")) == 0
    aligned = json.loads((folder / "aligned.json").read_text())
    np.testing.assert_allclose(aligned["T_world_camera"][1], true_pose(TURNS[1]), atol=0.3)
    merged = read_mesh(folder / "all.ply")
    parts = [read_mesh(folder / f"{number}.ply") for number in range(len(TURNS))]
    assert len(merged.vertices_mm) == sum(len(part.vertices_mm) for part in parts)
    assert merged.sigma_mm is not None
    assert merged.sigma_mm[0] == pytest.approx(0.02)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ('{"T_world_camera": []}', "0 poses for 2 meshes"),
        ('{"T_wrld": []}', "T_world_camera"),
        ("[]", "not a JSON object"),
        ('{"T_world_camera": [[[1, 0, 0]]]}', "T_world_camera"),
    ],
)
def test_bad_poses_are_refused_and_nothing_is_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], text: str, why: str
) -> None:
    (tmp_path / "poses.json").write_text(text)
    files = [str(folder / f"{number}.ply") for number in range(len(TURNS))]
    out = tmp_path / "all.ply"
    assert main(["merge", *files, "--poses", str(tmp_path / "poses.json"), "--out", str(out)]) == 2
    assert why in capsys.readouterr().err
    assert not out.exists()
