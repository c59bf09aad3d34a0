"""The wheel file: what is in it, and that it runs where no checkout is."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("burrscan", "scenes", "bench")
VERSION = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"]


def run(*words: str | Path, cwd: Path, **environment: str) -> str:
    result = subprocess.run(  # noqa: S603
        words, cwd=cwd, env=os.environ | environment, capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stdout + result.stderr
    return result.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("dist")
    run(sys.executable, "-m", "hatchling", "build", "--target", "wheel", "--directory", out, cwd=ROOT)
    (built,) = out.glob("*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder that the wheel was installed into; its dependencies are those of this environment."""
    folder = tmp_path_factory.mktemp("installed")
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
    run(*pip, "install", "--no-index", "--no-deps", "--target", folder, wheel, cwd=folder)
    return folder


def test_it_holds_every_file_of_the_packages_and_no_other(wheel: Path) -> None:
    assert wheel.name == f"burrscan-{VERSION}-py3-none-any.whl"
    held = {name for name in zipfile.ZipFile(wheel).namelist() if ".dist-info/" not in name}
    there = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    assert held == there


@pytest.mark.study
def test_it_runs_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    """Catalogues, suites and templates are found where they were installed.

    Nothing here compiles a kernel: they are cached beside their files, and a new place would take minutes.
    """

    def python(*words: str | Path) -> str:
        return run(sys.executable, *words, cwd=tmp_path, PYTHONPATH=str(installed))

    def burrscan(*words: str) -> str:
        return python(installed / "bin" / "burrscan", *words)

    where = python("-c", "import burrscan, scenes, bench; print(bench.__file__)")
    assert Path(where.strip()).is_relative_to(installed)
    assert VERSION in burrscan("--version")
    assert "quick" in burrscan("suites")
    assert "adaptive" in burrscan("show", "quick")
    built = (
        "from scenes.wheel import *; print(len(build_wheel(load_wheel('paper'), facet_error_mm=0.1).burrs))"
    )
    assert python("-c", built).strip() == "3"
    shutil.copytree(max((ROOT / "reports" / "baselines" / "quick").iterdir()), tmp_path / "run")
    burrscan("report", "run")
    assert "</html>" in (tmp_path / "run" / "report.html").read_text("utf-8")
