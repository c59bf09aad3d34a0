"""``sheets.json``: the data sheets of a camera and a projector as a photometric calibration measured them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from burrscan.captures.document import CameraDocument, ProjectorDocument
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.documents import STRICT, build, read_json
from burrscan.files import written_whole


@dataclass(frozen=True)
class SheetsDocument:
    """``sheets.json``; its tables are those of ``capture.json``."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-sheets"]
    version: Literal[1]
    camera: CameraDocument
    projector: ProjectorDocument


def read_sheets(path: Path) -> tuple[CameraSheet, ProjectorSheet]:
    """The sheets of a JSON file.

    Raises
    ------
    InputError
        With every error in the file.

    """
    document = build(SheetsDocument, read_json(path), source=str(path))
    return document.camera.sheet(), document.projector.sheet()


def write_sheets(path: Path, camera: CameraSheet, projector: ProjectorSheet) -> None:
    """Write sheets as JSON, whole or not at all."""
    document = {"format": "burrscan-sheets", "version": 1, **sheet_tables(camera, projector)}
    with written_whole(path) as beside:
        beside.write_text(json.dumps(document, indent=1) + "\n", "utf-8")


def sheet_tables(camera: CameraSheet, projector: ProjectorSheet) -> dict[str, Any]:
    """The tables ``camera`` and ``projector`` of a document."""
    return {
        "camera": asdict(camera),
        "projector": {"light": projector.light.tolist(), "crosstalk": projector.crosstalk},
    }
