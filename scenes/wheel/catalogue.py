"""Wheels by name or by path."""

from __future__ import annotations

from functools import cache
from importlib import resources
from pathlib import Path

from burrscan.documents import build, read_toml
from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.wheel.spec import WheelSpec


def wheel_names() -> list[str]:
    """The wheels of the catalogue."""
    return list(_names())


def load_wheel(name: str) -> WheelSpec:
    """A wheel of the catalogue by its name, or any other by the path of its TOML file.

    Raises
    ------
    InputError
        When there is no such wheel, or with every error in its file.

    """
    if name.endswith(".toml"):
        return build(WheelSpec, read_toml(Path(name)), source=name)
    if name not in _names():
        raise InputError(
            f"unknown wheel '{name}': {suggest(name, wheel_names())} (or the path of a .toml file)"
        )
    return _of_catalogue(name)


# A suite names the same wheel in hundreds of cases, and the package's own files stay as they are.
@cache
def _names() -> tuple[str, ...]:
    folder = resources.files("scenes.catalogue") / "wheels"
    names = (item.name for item in folder.iterdir())
    return tuple(sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml")))


@cache
def _of_catalogue(name: str) -> WheelSpec:
    with resources.as_file(resources.files("scenes.catalogue") / "wheels" / f"{name}.toml") as path:
        return build(WheelSpec, read_toml(path), source=name)
