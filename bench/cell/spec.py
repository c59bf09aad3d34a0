"""A case of a cell as plain tables: a scene, the cell it stands in, and what is to be done."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field

from burrscan.cell.planners import METHODS
from burrscan.documents import STRICT, build
from burrscan.errors import InputError
from burrscan.variants import suggest
from scenes.cell.spec import CellSpec
from scenes.scene import SceneSpec, content_hash, scene_from, scene_hash


@dataclass(frozen=True)
class TaskSpec:
    """What the cell is to do.

    Parameters
    ----------
    planner
        A short name of :data:`burrscan.cell.planners.METHODS`, or ``"module:function"``.
    looks
        At most so many looks.
    enough
        The probability of a burr that is left at which planned looking ends.
    expected_burrs
        On a part, before any look.
    remove
        So many burrs are taken off, the most certain first.

    """

    __pydantic_config__ = STRICT

    planner: str = "expected"
    looks: Annotated[int, Field(ge=1, le=48)] = 8
    enough: Annotated[float, Field(gt=0.0, lt=1.0)] = 0.05
    expected_burrs: Annotated[float, Field(gt=0.0)] = 3.0
    remove: Annotated[int, Field(ge=0)] = 0


@dataclass(frozen=True)
class CellCase:
    """A scene in a cell with a task."""

    scene: SceneSpec
    cell: CellSpec
    task: TaskSpec


def cell_from(document: Mapping[str, Any], *, source: str) -> CellCase:
    """A case of plain tables: those of a scene, beside them ``cell`` and ``task``.

    Raises
    ------
    InputError
        With every error in a table, or for a planner that does not exist.

    """
    scene = {key: table for key, table in document.items() if key not in {"cell", "task"}}
    cell = build(CellSpec, document.get("cell", {}), source=f"{source}, table cell")
    task = build(TaskSpec, document.get("task", {}), source=f"{source}, table task")
    if task.planner not in METHODS and ":" not in task.planner:
        raise InputError(
            f"{source}: unknown planner '{task.planner}': {suggest(task.planner, list(METHODS))} (or "
            "'module:function')"
        )
    return CellCase(scene_from(scene, source=source), cell, task)


def cell_hash(document: Mapping[str, Any]) -> str:
    """Content hash of a case's tables."""
    case = cell_from(document, source="cell")
    return content_hash(scene_hash(case.scene), case.cell, case.task)
