"""Real data made by others: small parts of it lie here, the whole in ``../shared/data`` where that exists."""

from pathlib import Path
from typing import Any

import pytest

HERE = Path(__file__).parent
WHOLE = HERE.parents[2] / "shared" / "data"
AXES = {
    "husky_wheel.stl": 1,
    "tb3_left_tire.stl": 1,
    "jackal_wheel.stl": 2,
    "tm_torus.STL": 2,
    "tm_round.stl": 2,
    "tm_tube.obj": 1,
}
"""Mesh to the coordinate axis that it was drawn around."""
UNIT = {"husky_wheel.stl": "m", "jackal_wheel.stl": "m"}
"""Millimetres, unless stated."""


def meshes() -> list[Any]:
    """Every mesh that is here, the smallest first; for `make studies` also what it was thinned from."""
    small = tuple(sorted((HERE / "meshes" / name for name in AXES), key=lambda path: path.stat().st_size))
    thinned = [
        path
        for kept in small
        if (path := WHOLE / "meshes" / kept.name).exists() and path.stat().st_size > kept.stat().st_size
    ]
    return [
        *(pytest.param(path, id=place(path)) for path in small),
        *(pytest.param(path, id=place(path), marks=pytest.mark.study) for path in thinned),
    ]


def captures() -> tuple[Path, ...]:
    """The cropped Gray-code capture, and the whole one where it is there."""
    whole = WHOLE / "captures" / "procam"
    return (HERE / "procam", *((whole,) if whole.is_dir() else ()))


def place(path: Path) -> str:
    """Name of a file for a test: which one, and whether it is the small one."""
    return f"{path.name}-{'small' if path.is_relative_to(HERE) else 'whole'}"
