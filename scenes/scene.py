"""A scene as written in TOML: wheel, burrs, finish, pose, rig, electronics, light."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from burrscan.documents import STRICT, build, problems_of, read_toml, refuse
from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.calibration import CalibrationSpec
from scenes.electronics.drift import VibrationSpec
from scenes.electronics.spec import CameraSpec, ProjectorSpec
from scenes.finish import FINISHES, FinishSpec, named_finish
from scenes.pose import PoseSpec
from scenes.rig import RigSpec
from scenes.surface.spec import Blemish, Zone
from scenes.transport.store import TRANSPORT_VERSION
from scenes.wheel import BurrSpec, WheelSpec, load_wheel, wheel_names


@dataclass(frozen=True)
class LightSpec:
    """Light that is not the projector's.

    Parameters
    ----------
    ambient
        Radiance of a uniform surround, relative to a white diffuser at the standoff under full white. The
        default is a shaded workshop.

    """

    __pydantic_config__ = STRICT

    ambient: Annotated[float, Field(ge=0.0)] = 0.002


@dataclass(frozen=True)
class RenderSpec:
    """How finely light is traced.

    Parameters
    ----------
    samples
        Light paths of every camera pixel, a power of two.
    bounces
        Surface interactions of the longest path; 1 leaves interreflections out.
    seed
        Of the sampling.
    error
        Standard error of a pixel's interreflected light above which it gets more paths, as a share of the
        geometric mean of its whole light and what of it goes with stripes: half the error costs three to four
        times the paths. Infinite refines nothing.
    most
        Further paths that no pixel exceeds, beyond the first 32; a power of two. What they leave is stated
        with the transport.
    paths
        Further paths of all pixels together. Where they need more, as in deep polished grooves, ``most`` is
        halved until they do.

    """

    __pydantic_config__ = STRICT

    samples: Annotated[int, Field(ge=2, le=4096)] = 16
    bounces: Annotated[int, Field(ge=1, le=8)] = 3
    seed: Annotated[int, Field(ge=0)] = 0
    error: Annotated[float, Field(gt=0.0)] = 0.023
    most: Annotated[int, Field(ge=64, le=65536)] = 1024
    paths: Annotated[int, Field(ge=1 << 20, le=1 << 32)] = 1 << 24


@dataclass(frozen=True)
class SceneSpec:
    """One scene, complete.

    Parameters
    ----------
    wheel
        A name of the catalogue, the path of a wheel file, or a table of its own.
    burr
        The burrs on it; those that the wheel comes with by default.
    finish
        A name of the catalogue, or a table of its own; a table with a ``name`` overrides a part of that
        finish.
    zone
        Stretches of the wheel along its axis with finishes of their own.
    blemish
        What is on the wheel and is no burr.
    pose, rig, camera, projector, light, calibration, vibration, render
        See the tables' own classes.
    channels
        ``mono``, or ``rgb`` for a projector of three primaries and a camera of three chips
        (:mod:`scenes.colour`); a scan of it needs the strategy ``colour``.
    name, description
        For people.

    """

    __pydantic_config__ = STRICT

    wheel: WheelSpec
    finish: FinishSpec
    burr: tuple[BurrSpec, ...] | None = None
    zone: tuple[Zone, ...] = ()
    blemish: tuple[Blemish, ...] = ()
    pose: PoseSpec = PoseSpec()
    rig: RigSpec = RigSpec()
    camera: CameraSpec = CameraSpec()
    projector: ProjectorSpec = ProjectorSpec()
    light: LightSpec = LightSpec()
    calibration: CalibrationSpec = CalibrationSpec()
    vibration: VibrationSpec = VibrationSpec()
    render: RenderSpec = RenderSpec()
    channels: Literal["mono", "rgb"] = "mono"
    name: str = ""
    description: str = ""

    @property
    def burrs(self) -> tuple[BurrSpec, ...]:
        """The burrs that the wheel carries."""
        return self.wheel.burr if self.burr is None else self.burr


def scene_names() -> list[str]:
    """The scenes of the catalogue."""
    folder = resources.files("scenes.catalogue") / "scenes"
    return sorted(item.name.removesuffix(".toml") for item in folder.iterdir() if item.name.endswith(".toml"))


def scene_document(name_or_path: str) -> dict[str, Any]:
    """The plain tables of a scene of the catalogue or of a TOML file.

    Raises
    ------
    InputError
        When there is no such scene, or the file is not TOML.

    """
    if name_or_path.endswith(".toml"):
        path = Path(name_or_path)
        return with_wheel_beside(read_toml(path), path.parent)
    if name_or_path not in scene_names():
        known = suggest(name_or_path, scene_names())
        raise InputError(f"unknown scene '{name_or_path}': {known} (or the path of a .toml file)")
    with resources.as_file(resources.files("scenes.catalogue") / "scenes" / f"{name_or_path}.toml") as path:
        return read_toml(path)


def with_wheel_beside(document: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """A scene's tables with its wheel's file, where it names one in ``folder``, read into them."""
    return {**document, **({"wheel": wheel_beside(document["wheel"], folder)} if "wheel" in document else {})}


def wheel_beside(wheel: Any, folder: Path) -> Any:
    """The tables of the wheel file of that name in ``folder``; anything else as it is."""
    beside = isinstance(wheel, str) and wheel.endswith(".toml") and (folder / wheel).exists()
    return read_toml(folder / wheel) if beside else wheel


def scene_from(document: Mapping[str, Any], *, source: str) -> SceneSpec:
    """A scene of plain tables; wheel and finish may be names.

    Raises
    ------
    InputError
        With every error in the tables.

    """
    tables, problems = {"finish": {}, **document}, list[str]()
    for key, by_name, any_other in (
        ("wheel", _wheel_tables, wheel_names()[0]),
        ("finish", _finish_tables, next(iter(FINISHES))),
    ):
        if key in tables:
            try:
                tables[key] = by_name(tables[key])
            except InputError as error:  # the other tables are looked at all the same
                problems += problems_of(error)
                tables[key] = by_name(any_other)
    try:
        scene = build(SceneSpec, tables, source=source)
    except InputError as error:
        refuse([*problems, *problems_of(error)], source)
        raise
    refuse(problems, source)
    return scene


def _wheel_tables(wheel: Any) -> Any:
    """A wheel by name; anything else as it is."""
    return load_wheel(wheel) if isinstance(wheel, str) else wheel


def _finish_tables(finish: Any) -> Any:
    """A finish by name, or a table that may start from a name and override some of it."""
    if isinstance(finish, str):
        return named_finish(finish)
    if isinstance(finish, Mapping) and isinstance(finish.get("name"), str):
        changed = {key: value for key, value in finish.items() if key != "name"}
        return dataclasses.asdict(named_finish(finish["name"])) | changed
    return finish


def load_scene(name_or_path: str) -> SceneSpec:
    """A scene by its name in the catalogue or by the path of its TOML file.

    Raises
    ------
    InputError
        When there is no such scene, or with every error in the file.

    """
    return scene_from(scene_document(name_or_path), source=name_or_path)


def content_hash(*parts: Any) -> str:
    """A short hash of what dataclasses and plain values say; equal content gives equal hashes."""
    text = json.dumps(parts, sort_keys=True, default=_plain)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _plain(part: Any) -> Any:
    """What JSON does not know: a dataclass as a table of its fields, all else as text."""
    if dataclasses.is_dataclass(part) and not isinstance(part, type):
        return {field.name: getattr(part, field.name) for field in dataclasses.fields(part)}
    return str(part)


def scene_hash(scene: SceneSpec) -> str:
    """Hash of everything that a scene's images depend on, the version of the light tracing included."""
    return content_hash(dataclasses.replace(scene, name="", description=""), TRANSPORT_VERSION)
