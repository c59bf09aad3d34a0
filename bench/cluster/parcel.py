"""What goes to a worker, and what comes back: a case's records, and its pictures unless a store took them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from bench.cluster.fingerprint import Fingerprint
from bench.run.crew import Obstructed
from bench.run.directory import RunDirectory
from bench.run.engine import Examine
from bench.run.job import Job
from bench.run.records import Record
from bench.suites.case import Case
from burrscan.files import written_whole
from scenes.stores import Store


@dataclass(frozen=True)
class Parcel:
    """What came of a case.

    Parameters
    ----------
    records
        One per variant.
    files
        Name to content of its pictures and maps; empty where they are in a store.

    """

    records: tuple[Record, ...]
    files: Mapping[str, bytes]

    def unpack(self, folder: Path) -> None:
        """Write the files to the case's folder."""
        for name, content in self.files.items():
            with written_whole(folder / name) as beside:
                beside.write_bytes(content)


def work(job: Job, examine: Examine, case: Case) -> Parcel:
    """Examine one case on a worker, in a folder that is gone afterwards.

    Raises
    ------
    bench.run.crew.Obstructed
        When the machine or the store is the reason.

    """
    with TemporaryDirectory(prefix="burrscan-", ignore_cleanup_errors=True) as folder:
        records = examine(replace(job, out_dir=Path(folder)), case)
        made = RunDirectory(Path(folder)).case(case.id)
        files = {path.name: path.read_bytes() for path in sorted(made.glob("*")) if path.is_file()}
    if job.kept_at:
        _keep(Store(job.kept_at).under(case.id), files)
        files = {}
    return Parcel(tuple(records), files)


def key_of(job: Job, expected: Fingerprint, case: Case) -> str:
    """A case's key on a scheduler: by content, so that it is the same for whoever asks the same."""
    asked = {
        "variants": [asdict(variant) for variant in job.variants],
        "own": job.own_metrics,
        "budgeted": job.budgeted,
        "detectability": job.detectability,
        "kept_at": job.kept_at,
        "case": [case.id, case.scene_hash, case.identity],
        "with": dict(expected),
    }
    digest = hashlib.sha256(json.dumps(asked, sort_keys=True, default=str).encode()).hexdigest()
    return f"burrscan-{digest[:32]}"


def _keep(store: Store, files: Mapping[str, bytes]) -> None:
    try:
        for name, content in files.items():
            store.write(name, content)
    except Exception as error:  # every kind of store has errors of its own
        raise Obstructed(f"{store.address}: {error!r}") from error
