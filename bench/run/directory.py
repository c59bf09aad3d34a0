"""The layout of a run directory, and its manifest ``run.json``."""

from __future__ import annotations

import fcntl
import json
import logging
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from bench.run.forms import FORMAT, ManifestForm
from bench.run.machine import said_of_the_machine
from bench.run.records import Record, read
from bench.suites.case import Case
from bench.suites.identity import content_hash
from bench.suites.suite import Suite, suite_from
from burrscan.documents import build, read_json
from burrscan.errors import InputError
from burrscan.files import write_text, written_whole
from burrscan.variants import untrusted
from scenes.stores import Store

_LOG = logging.getLogger("burrscan.runs")


@cache
def _say_where(store: str) -> None:
    """One line for all pictures of a run."""
    _LOG.warning("note: pictures lie at %s; --trust fetches them", store)


@dataclass(frozen=True)
class RunDirectory:
    """Where a run keeps what it makes.

    ``run.json``: what is run and where (the manifest); ``records.jsonl``: one line per case and variant, in
    the order in which they ended; ``records.csv`` and ``timings.csv``: the same in canonical order, written
    at the end; ``cases/<id>/``: pictures and maps (see :mod:`bench.run.artefacts`); ``report.html``.
    """

    path: Path

    @property
    def manifest(self) -> Path:
        """``run.json``."""
        return self.path / "run.json"

    @property
    def records(self) -> Path:
        """``records.jsonl``."""
        return self.path / "records.jsonl"

    def case(self, case_id: str) -> Path:
        """The folder of one case's pictures and maps."""
        return self.path / "cases" / case_id

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Hold the directory for this process alone; the lock goes with the process, however it ends."""
        self.path.mkdir(parents=True, exist_ok=True)
        with (self.path / ".lock").open("w") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                raise InputError(f"{self.path}: another process is at work in this run directory") from error
            yield


@dataclass(frozen=True)
class Run:
    """A run as it stands on the disk.

    Parameters
    ----------
    directory
        Where.
    suite, seed
        What was asked for.
    manifest
        ``run.json`` as plain tables: provenance, cases, metric definitions.
    records
        In canonical order: the suite's cases, then its variants.

    """

    directory: RunDirectory
    suite: Suite
    seed: int
    manifest: Mapping[str, Any]
    records: tuple[Record, ...]

    def artefact(self, case_id: str, name: str) -> Path:
        """A file of a case's pictures and maps; one that a cluster's workers left in a store is fetched.

        It may not be there afterwards: a report shows what there is. A run that nobody vouches for has no
        address called: whoever wrote it would learn who reads it, and from where.
        """
        path = self.directory.case(case_id) / name
        store = str(self.manifest.get("store") or "")
        if store and not path.exists() and untrusted() and "://" in store:
            _say_where(store)
            return path
        if store and not path.exists():
            with suppress(Exception):  # every kind of store has errors of its own
                content = Store(store).read(f"{case_id}/{name}")
                with written_whole(path) as beside:
                    beside.write_bytes(content)
        return path

    @property
    def obstructed(self) -> dict[str, str]:
        """Cases whose recorded failure is the machine's, as old versions recorded it, to what it was."""
        failed = [(record.case, record.failure) for record in self.records if record.failure]
        return {case: why for case, failure in failed if (why := said_of_the_machine(failure))}

    @property
    def missing(self) -> int:
        """Records that are still to come."""
        return len(self.manifest["cases"]) * len(self.suite.variant) - len(self.records)


def load_run(path: Path) -> Run:
    """Read a run directory, finished or not.

    Raises
    ------
    InputError
        When there is no run, or one of another format, or with every error in its manifest; for a record of
        another case than the manifest's of that name, or of other true burrs than another variant's.

    """
    directory = RunDirectory(path)
    if not directory.manifest.exists():
        raise InputError(f"{path}: not a run directory (no run.json); 'burrscan run SUITE' makes one")
    manifest = read_json(directory.manifest)
    if not isinstance(manifest, dict) or manifest.get("format") != FORMAT:
        raise InputError(f"{directory.manifest}: not a run of format {FORMAT}; run the suite again")
    build(ManifestForm, manifest, source=str(directory.manifest))
    suite = suite_from(manifest["suite"], source=str(directory.manifest))
    order = {
        (case["id"], variant.name): (number, place)
        for number, case in enumerate(manifest["cases"])
        for place, variant in enumerate(suite.variant)
    }
    found = {record.key: record for record in read(directory.records) if record.key in order}
    records = tuple(sorted(found.values(), key=lambda record: order[record.key]))
    counts = dict[str, int]()
    for record in records:
        if record.parameters != manifest["cases"][order[record.key][0]]["parameters"]:
            raise InputError(
                f"{directory.records}: the record of case {record.case} by {record.variant} has other "
                "parameters than run.json says; was the file edited?"
            )
        burrs = counts.setdefault(record.case, len(record.burrs)) if record.burrs else 0
        if burrs != len(record.burrs):
            raise InputError(
                f"{directory.records}: case {record.case} has {len(record.burrs)} true burrs in the record "
                f"of {record.variant} and {burrs} in another; was the file edited?"
            )
    return Run(directory, suite, manifest["seed"], manifest, records)


def write_manifest(directory: RunDirectory, manifest: Mapping[str, Any]) -> None:
    """Write ``run.json`` whole."""
    write_text(directory.manifest, json.dumps(manifest, indent=1, allow_nan=False) + "\n")


def describe_run(
    suite: Suite,
    cases: Sequence[Case],
    *,
    seed: int,
    only: str = "*",
    metrics: Mapping[str, Any],
    shard: str | None = None,
) -> dict[str, Any]:
    """The part of the manifest that says what is run; two runs of one seed agree in it."""
    listed = [
        {
            "id": case.id,
            "parameters": dict(case.parameters),
            "scene_hash": case.scene_hash,
            "identity": case.identity,
        }
        for case in cases
    ]
    document = suite.document()
    return {
        "format": FORMAT,
        "suite": json.loads(json.dumps(document)),
        "suite_hash": content_hash(document),
        "seed": seed,
        "only": only,
        "metrics": metrics,
        "cases": listed,
        **({"shard": shard} if shard else {}),
    }


def unfinished(parent: Path, suite_name: str | None) -> Path:
    """The newest unfinished run under ``parent``, of one suite or of any.

    Raises
    ------
    InputError
        When there is none.

    """
    found = sorted(parent.glob("*/run.json"), key=lambda path: path.stat().st_mtime, reverse=True)
    for manifest in found:
        with suppress(InputError, OSError):  # one of another version, or damaged, stops no other
            run = load_run(manifest.parent)
            if (run.missing or run.obstructed) and suite_name in {None, run.suite.name}:
                return manifest.parent
    what = f"of suite '{suite_name}' " if suite_name else ""
    raise InputError(f"{parent}: no unfinished run {what}to resume; name one with --out")


def fresh_name(suite_name: str, stamp: str) -> str:
    """A run directory's name: suite and time of start, fit for every file system."""
    return f"{suite_name}-{re.sub(r'[^0-9T]', '', stamp)}"
