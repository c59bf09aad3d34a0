"""The documented schema of the JSON that `detect` writes, against what it writes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pytest
import trimesh

from bench.cli import main
from bench.synthetic.revolution import RevolutionScan, RidgeBurr, revolution_scan
from burrscan import inspect_mesh

SCHEMA = json.loads((Path(__file__).parents[1] / "docs" / "inspection.schema.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def scan() -> RevolutionScan:
    return revolution_scan(shape=(160, 80), sigma_mm=0.05, burrs=(RidgeBurr(width_deg=4.0),), seed=3)


@pytest.fixture(scope="module")
def folder(scan: RevolutionScan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The mesh as a file, inspected on the command line."""
    here = tmp_path_factory.mktemp("detect")
    trimesh.Trimesh(scan.vertices_mm, scan.faces, process=False).export(here / "wheel.ply", encoding="binary")
    files = ["--json", str(here / "found.json"), "--ply", str(here / "deviation.ply")]
    assert main(["detect", str(here / "wheel.ply"), "--limit", "0.5", *files]) == 1
    return here


def test_what_is_written_follows_the_schema(folder: Path) -> None:
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    found = json.loads((folder / "found.json").read_text("utf-8"))
    jsonschema.validate(found, SCHEMA)
    assert found["burrs"][0]["within_limit"] is False


@pytest.mark.parametrize("fault", ["missing", "more", "type"])
def test_the_schema_refuses_what_is_not_so(folder: Path, fault: str) -> None:
    found: dict[str, Any] = json.loads((folder / "found.json").read_text("utf-8"))
    if fault == "missing":
        del found["axis"]["sigma_deg"]
    elif fault == "more":
        found["burrs"][0]["colour"] = "blue"
    else:
        found["T_part_mesh"][0] = [1.0, 0.0]
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(found, SCHEMA)


def test_the_command_line_and_the_function_say_the_same(folder: Path, scan: RevolutionScan) -> None:
    vertices = scan.vertices_mm.astype(np.float32).astype(float)  # the file's precision
    found = json.loads((folder / "found.json").read_text("utf-8"))
    same = inspect_mesh(vertices, scan.faces)
    np.testing.assert_allclose(found["axis"]["direction"], same.axis.direction, atol=1e-12)
    assert [b["height_mm"]["value"] for b in found["burrs"]] == [b.height_mm.value for b in same.burrs]


def test_the_ply_opens_elsewhere_with_its_deviations(folder: Path, scan: RevolutionScan) -> None:
    other = trimesh.load(folder / "deviation.ply", process=False)
    deviation = other.metadata["_ply_raw"]["vertex"]["data"]["deviation_mm"]
    assert len(deviation) == len(scan.vertices_mm)
    assert float(np.nanmax(deviation)) == pytest.approx(2.0, abs=0.5)


def test_e1_and_e2_of_the_covariance_are_what_the_schema_says(scan: RevolutionScan) -> None:
    found = inspect_mesh(scan.vertices_mm, scan.faces)
    e1, e2, axis = found.T_part_mesh[:3, :3]
    np.testing.assert_allclose(axis, found.axis.direction, atol=1e-12)
    np.testing.assert_allclose(np.cross(e1, e2), axis, atol=1e-12)
