"""A rendered scene as a capture folder, with its truth in a file of its own."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.scan import METHODS
from burrscan.sideways import by_columns
from burrscan.variants import resolve
from scenes.scene import SceneSpec, scene_hash
from scenes.simulate import Simulation, simulate
from scenes.truth import Truth


def write_capture(
    scene: SceneSpec,
    folder: Path,
    *,
    seed: int = 0,
    scan: str | None = None,
    sheets: tuple[CameraSheet, ProjectorSheet] | None = None,
) -> Path:
    """Scan a scene and write everything that was shown and seen.

    Parameters
    ----------
    scene
        The scene.
    folder
        The capture folder; it must not exist yet, or be empty.
    seed
        Of the noise.
    scan
        The scanning strategy that chooses the patterns; ``adaptive`` by default, ``colour`` in colour.
    sheets
        What the scanner is told of its devices; the true sheets by default.

    Returns
    -------
    The folder, written whole or not at all.

    Raises
    ------
    InputError
        When the folder holds something, or the scene cannot be rendered.

    """
    with written_folder(folder) as beside:
        method = scan or ("colour" if scene.channels == "rgb" else "adaptive")
        strategy = resolve(method, METHODS, stage="scan")
        simulation = simulate(scene, identity=(seed,))
        _write(simulation, strategy, beside, ScanDocument(method), sheets)
    return folder


@contextmanager
def written_folder(folder: Path) -> Iterator[Path]:
    """A folder beside ``folder`` that takes its place when all went well, and is removed when not.

    Raises
    ------
    InputError
        When ``folder`` holds something.

    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"{folder}: exists and is not an empty folder; choose another, or remove it first")
    beside = folder.with_name(f".{folder.name}.{os.getpid()}.tmp")
    try:
        yield beside
        if folder.is_dir():
            folder.rmdir()
        beside.replace(folder)
    finally:
        shutil.rmtree(beside, ignore_errors=True)


def _write(
    simulation: Simulation,
    strategy: Callable[..., Any],
    folder: Path,
    scan: ScanDocument,
    sheets: tuple[CameraSheet, ProjectorSheet] | None,
) -> None:
    recorder = RecordingScanner(simulation.scanner(sheets=sheets), folder, scan=scan)
    strategy(by_columns(recorder))
    recorder.close()
    document = asdict(simulation.scene) | {"hash": scene_hash(simulation.scene)}
    (folder / "scene.json").write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    np.savez_compressed(folder / "truth.npz", **truth_arrays(simulation.truth))  # type: ignore[arg-type]


def truth_arrays(truth: Truth) -> dict[str, NDArray[np.generic]]:
    """The truth as plain arrays, units in the names; see :class:`scenes.truth.Truth`."""
    names = (
        "T_part_camera",
        "points_mm",
        "u_px",
        "v_px",
        "u_response_px",
        "v_response_px",
        "direct",
        "indirect",
        "sigma_limit_px",
        "measurable",
        "burr_index",
        "blemish_index",
    )
    arrays = {name: getattr(truth, name) for name in names}
    burrs = [{k: v for k, v in asdict(b).items() if not isinstance(v, np.ndarray)} for b in truth.wheel.burrs]
    return arrays | {
        "generatrix_zr_mm": truth.wheel.generatrix_zr_mm,
        "burrs_json": np.array(json.dumps(burrs)),
        "blemishes_json": np.array(json.dumps([asdict(blemish) for blemish in truth.blemishes])),
    }
