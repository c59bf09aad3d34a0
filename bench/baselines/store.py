"""Keeping accepted runs: ``reports/baselines/<suite>/<number>-<commit>/`` with ``run.json`` and records.

What is kept is a run directory without pictures, tables and report, which everything that reads runs can
read. Tracebacks and command lines are left out, for they hold paths of the machine they come from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.run.directory import Run, RunDirectory, load_run, write_manifest
from bench.run.records import Record, append
from burrscan.documents import printable
from burrscan.errors import InputError
from scenes.capture_folder import written_folder

BASELINES = Path("reports/baselines")
"""Where accepted runs are kept, below the current directory."""


def accept(run: Run, *, baselines: Path = BASELINES, note: str = "") -> Path:
    """Make a finished run the baseline of its suite.

    Parameters
    ----------
    run
        The run.
    baselines
        Folder of all baselines.
    note
        Why, for the history.

    Returns
    -------
    pathlib.Path
        The accepted run's directory.

    Raises
    ------
    InputError
        When the run is unfinished, holds only some cases, or is an accepted one itself.

    """
    _refuse_unfit(run)
    folder = baselines / run.suite.name
    target = RunDirectory(folder / f"{_next_number(folder):04d}-{_commit(run.manifest)}")
    sessions = [
        {key: value for key, value in sitting.items() if key != "command"}
        for sitting in run.manifest["sessions"]
    ]
    accepted_at = {
        "at": datetime.now(UTC).isoformat(timespec="seconds"),
        "run": run.directory.path.name,
        "note": printable(note),
    }
    manifest = {**run.manifest, "sessions": sessions, "accepted": accepted_at}
    with written_folder(target.path) as beside:
        slim = RunDirectory(beside)
        write_manifest(slim, manifest)
        append(slim.records, map(_slim, run.records))
    return target.path


def accepted(suite: str, *, baselines: Path = BASELINES) -> list[Run]:
    """A suite's accepted runs, oldest first."""
    return [load_run(path.parent) for path in sorted((baselines / suite).glob("*/run.json"))]


def newest(path: Path) -> Path:
    """A run directory as it is; of a folder of accepted runs, the one accepted last."""
    if (path / "run.json").exists():
        return path
    found = sorted(path.glob("[0-9][0-9][0-9][0-9]-*/run.json"))
    return found[-1].parent if found else path


def _refuse_unfit(run: Run) -> None:
    path = run.directory.path
    if "accepted" in run.manifest:
        raise InputError(f"{path}: is an accepted run already")
    if run.manifest["only"] != "*":
        raise InputError(f"{path}: holds only some of the suite's cases; run all of them to accept it")
    if run.missing:
        raise InputError(
            f"{path}: {run.missing} record(s) are still missing; burrscan run --resume --out {path}"
        )


def _next_number(folder: Path) -> int:
    return 1 + max((int(path.name[:4]) for path in folder.glob("[0-9][0-9][0-9][0-9]-*")), default=0)


def _commit(manifest: Mapping[str, Any]) -> str:
    """The checkout's commit in short; a plus sign where files differed from it."""
    git = (manifest["sessions"][-1] if manifest["sessions"] else {}).get("git")
    return f"{git['commit'][:9]}{'+' if git['modified'] else ''}" if git else "nogit"


def _slim(record: Record) -> Record:
    """The record without its traceback; times to a millisecond."""
    failure = replace(record.failure, traceback="") if record.failure else None
    return replace(record, failure=failure, timings_s={k: round(v, 3) for k, v in record.timings_s.items()})
