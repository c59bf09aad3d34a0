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
        (
            '{"T_world_camera": [], "sigma_mm": 1e-300}',
            "sigma_mm: input should be greater than or equal to 0.000001",
        ),
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


def test_what_the_surfaces_leave_open_is_named(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A round part slides about its axis; the part of the other tests has lobes, and nothing is open."""
    rng = np.random.default_rng(5)
    (folder / "round").mkdir()
    views = [view(turn, rng, lobes=0.0) for turn in TURNS]
    for number, one in enumerate(views):
        write_ply(folder / f"round/{number}.ply", one.vertices_mm, one.faces, scalars={})
    poses = {"T_world_camera": [one.T_world_camera.tolist() for one in views]}
    (folder / "round/poses.json").write_text(json.dumps(poses))
    assert merge(folder / "round", "--json", str(folder / "round/aligned.json")) == 0
    assert "the surfaces leave open, the rough poses decide: turn about (" in capsys.readouterr().out
    (turn,) = json.loads((folder / "round/aligned.json").read_text())["free"][1]
    assert turn["kind"] == "turn"
    assert turn["direction"][2] > 0.99
    assert turn["sigma"] > 0.1
    merged = read_mesh(folder / "round/all.ply")
    assert merged.sigma_mm is not None
    assert 0.01 < np.median(merged.sigma_mm) < 0.025  # measured across the surface: noise is along rays
    assert merge(folder) == 0
    assert "leave open" not in capsys.readouterr().out


def test_views_that_do_not_overlap_end_with_2_and_write_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(6)
    for number, one in enumerate(views := [view(turn, rng) for turn in (0.0, 180.0)]):
        write_ply(tmp_path / f"{number}.ply", one.vertices_mm, one.faces, scalars={})
    poses = {"T_world_camera": [one.T_world_camera.tolist() for one in views]}
    (tmp_path / "poses.json").write_text(json.dumps(poses))
    assert merge(tmp_path, "--json", str(tmp_path / "aligned.json")) == 2
    said = capsys.readouterr()
    assert "view 2 shares hardly any surface" in said.err
    assert "take views that overlap by a third" in said.err
    assert "distance between" not in said.out
    assert not (tmp_path / "all.ply").exists()
    assert not (tmp_path / "aligned.json").exists()
