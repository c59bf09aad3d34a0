"""Runs of parts of a suite put together into one run."""

from __future__ import annotations

import json
import logging
import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from bench.run.directory import Run, RunDirectory, describe_run, load_run, write_manifest
from bench.run.records import Record, write
from bench.run.tables import write_tables
from bench.suites.cases import chosen, expand
from burrscan.errors import InputError

_LOG = logging.getLogger("burrscan.gather")
_SAME = ("suite_hash", "seed", "only", "metrics")
_VERSIONS = ("burrscan", "mitsuba", "drjit")


def gather(parts: Sequence[Path], out_dir: Path) -> Run:
    """Put runs of one suite and seed together: what one machine would have recorded, as far as it is there.

    Parameters
    ----------
    parts
        Run directories, of shards or of the same cases; they stay as they are.
    out_dir
        A new directory, an ordinary run: ``burrscan run --resume`` does what is missing.

    Returns
    -------
    Run
        The run; ``missing`` says how many records no part has.

    Raises
    ------
    InputError
        When parts are of different runs, or made by different versions, or say different things of a case,
        or ``out_dir`` is not empty.

    """
    runs = [load_run(part) for part in parts]
    for run in runs[1:]:
        _refuse_another(runs[0], run)
    first, directory = runs[0], RunDirectory(out_dir)
    if out_dir.exists() and (not out_dir.is_dir() or any(out_dir.iterdir())):
        raise InputError(f"{out_dir}: is there already; choose another directory with --out")
    cases = chosen(expand(first.suite, seed=first.seed), first.manifest["only"])
    asked = describe_run(
        first.suite, cases, seed=first.seed, only=first.manifest["only"], metrics=first.manifest["metrics"]
    )
    records = _joined(runs)
    sessions = [session for run in runs for session in run.manifest["sessions"]]
    with directory.locked():
        for run in runs:
            _copy_pictures(run, directory)
        write(directory.records, records.values())
        write_manifest(directory, {**asked, "sessions": sessions})
        whole = load_run(out_dir)
        write_tables(whole)
    return whole


@contextmanager
def undone_on_failure(out_dir: Path) -> Iterator[None]:
    """Take away what the block made in ``out_dir`` if it fails; what was there before stays."""
    there = out_dir.exists()
    ours = not there or (out_dir.is_dir() and not any(out_dir.iterdir()))
    try:
        yield
    except BaseException:
        if ours and out_dir.is_dir():
            shutil.rmtree(out_dir, ignore_errors=True)
            if there:
                out_dir.mkdir()
        raise


def _refuse_another(one: Run, other: Run) -> None:
    differ = [key for key in _SAME if one.manifest[key] != other.manifest[key]]
    differ += [f"versions of {name}" for name in _VERSIONS if _versions(one, name) != _versions(other, name)]
    if differ:
        raise InputError(
            f"{other.directory.path}: differs from {one.directory.path} in {', '.join(differ)}; "
            "only parts of one run can be put together"
        )
    if _code(one) != _code(other):
        _LOG.warning("note: %s was made from another state of the checkout", other.directory.path)


def _versions(run: Run, name: str) -> set[str]:
    return {session["versions"].get(name, "") for session in run.manifest["sessions"]}


def _code(run: Run) -> list[str]:
    return sorted({json.dumps(session.get("git"), sort_keys=True) for session in run.manifest["sessions"]})


def _joined(runs: Sequence[Run]) -> dict[tuple[str, str], Record]:
    """Every record once; two of one case and variant must say the same."""
    found: dict[tuple[str, str], Record] = {}
    for run in runs:
        for record in run.records:
            before = found.setdefault(record.key, record)
            if _result(before) != _result(record):
                raise InputError(
                    f"{run.directory.path}: says something else of {record.case}, {record.variant} than "
                    "another part; were they made by the same renderer?"
                )
    return found


def _result(record: Record) -> dict[str, Any]:
    table: dict[str, Any] = json.loads(record.line())
    del table["timings_s"]
    return table


def _copy_pictures(run: Run, into: RunDirectory) -> None:
    """Of every case with records; those that a cluster's workers left in a store come from there."""
    names = ["truth.npz", *(f"{variant.name}.npz" for variant in run.suite.variant)]
    for case in dict.fromkeys(record.case for record in run.records):
        for name in names:
            source, target = run.artefact(case, name), into.case(case) / name
            if source.exists() and not target.exists():
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, target)
