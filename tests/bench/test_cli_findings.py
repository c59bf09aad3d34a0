import json
from pathlib import Path

import pytest
import trimesh

from bench.axis.revolution import revolution_scan
from bench.cli import main


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
