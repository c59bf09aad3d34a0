"""Running a suite: cases out to workers, records in, nothing lost on the way."""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from bench.run.crew import Died, Obstructed
from bench.run.directory import Run, RunDirectory, describe_run, load_run, write_manifest
from bench.run.engine import Engine, Examine, Local, Outcomes
from bench.run.examine import examine
from bench.run.job import Job
from bench.run.provenance import session
from bench.run.records import Record, append, count_failed, write
from bench.run.shard import Shard
from bench.run.tables import write_tables
from bench.score.metrics import METRICS, metric_named, own_metrics
from bench.suites.case import Case
from bench.suites.cases import chosen, expand
from bench.suites.suite import Suite
from burrscan.errors import InputError
from scenes.stores import Store
from scenes.transport.store import NOWHERE, default_folder


@dataclass(frozen=True)
class Progress:
    """How far a run is: cases done, in all, before this sitting; failed records; last case; workers."""

    done: int
    total: int
    before: int
    failed: int
    case: str = ""
    workers: int = 0

    @classmethod
    def of(cls, run: Run) -> Progress:
        """Where a run stands before a sitting."""
        done = len({record.case for record in run.records})
        return cls(
            done=done,
            total=len(run.manifest["cases"]),
            before=done,
            failed=count_failed(run.records),
        )

    def after(self, case: Case, records: Sequence[Record], *, workers: int) -> Progress:
        """Where it stands after one more case."""
        failed = self.failed + count_failed(records)
        return replace(self, done=self.done + 1, failed=failed, case=case.id, workers=workers)


_LOG = logging.getLogger("burrscan.run")


def run_suite(
    suite: Suite,
    out_dir: Path,
    *,
    workers: int | None = None,
    seed: int = 0,
    only: str = "*",
    shard: Shard | None = None,
    engine: Engine | None = None,
    store: str = "",
    progress: Callable[[Progress], None] = lambda _: None,
    examine_case: Examine = examine,
) -> Path:
    """Run every case of a suite with every variant; finish the run that ``out_dir`` holds, if it holds one.

    Call it below ``if __name__ == "__main__":`` in a script, for its workers are spawned processes.

    Parameters
    ----------
    suite
        What to run.
    out_dir
        The run directory, new or of an unfinished run of the same suite and seed.
    workers
        Processes of this machine; by default one per core. Records do not depend on it.
    seed
        Another seed makes another realisation of the whole suite.
    only
        Pattern of the cases to run, such as ``finish=turned,*``; records are those of the whole suite's run.
    shard
        Run only this part of the cases; :func:`bench.run.gather.gather` puts the parts together.
    engine
        Who does the work instead of this machine's processes. Records do not depend on it.
    store
        Address at which the engine's workers leave pictures and traced light; empty: pictures come back with
        the records, light stays where it was traced.
    progress
        Called when the run starts and after every case.
    examine_case
        What a worker does with a case; tests put a quick one here.

    Returns
    -------
    pathlib.Path
        ``out_dir``.

    Raises
    ------
    InputError
        When ``out_dir`` holds something else, or another process works in it. When the machine failed: its
        disk or its memory is full, or a worker was killed twice. That is no result; calling it again tries
        those cases.

    """
    cases = chosen(expand(suite, seed=seed), only)
    cases = shard.part(cases) if shard else cases
    directory = RunDirectory(out_dir)
    _refuse_foreign(directory)
    engine = engine or Local(workers)
    asked = describe_run(
        suite, cases, seed=seed, only=only, metrics=_definitions(suite), shard=str(shard) if shard else None
    )
    kept_at = (
        Store(store).under(f"runs/{out_dir.resolve().name}-{asked['suite_hash'][:8]}-{seed}")
        if store
        else None
    )
    with directory.locked():
        _open(directory, asked, engine, store=kept_at.address if kept_at else None)
        remaining = _settle(directory, cases, len(suite.variant))
        job = Job(
            suite.variant, out_dir, own_metrics(suite.metrics), suite.source, suite.budgeted,
            detectability=suite.detectability,
            transports=_transports(store), kept_at=kept_at.address if kept_at else "",
        )  # fmt: skip
        outcomes = engine.outcomes(job, examine_case, remaining)
        lost = _collect(outcomes, engine, directory, Progress.of(load_run(out_dir)), progress)
        write_tables(load_run(out_dir))
    if lost:
        raise InputError(f"{lost[0]}{_again(out_dir, cases=len(lost))}")
    return out_dir


def _transports(store: str) -> str:
    """Where workers keep traced light: who said to keep none is believed everywhere."""
    if not store:
        return ""
    return NOWHERE if default_folder() is None else Store(store).under("transports").address


def _collect(
    outcomes: Outcomes,
    engine: Engine,
    directory: RunDirectory,
    state: Progress,
    progress: Callable[[Progress], None],
) -> list[str]:
    """Append the records of each case as it ends; say what became of those whose workers died."""
    progress(state)
    lost = []
    try:
        for case, result in outcomes:
            if isinstance(result, Died):
                lost.append(f"{case.id}: {result.reason}")
                continue
            append(directory.records, result)
            state = state.after(case, result, workers=engine.workers)
            progress(state)
    except Obstructed as error:
        raise InputError(f"{error}{_again(directory.path)}") from error
    finally:
        outcomes.close()
    return lost


def _again(out_dir: Path, *, cases: int = 0) -> str:
    """How a sitting that the machine cut short goes on."""
    what = f"; {cases} case(s) have no record" if cases else "; nothing was recorded of the cases at work"
    return f"{what}. When that is mended: burrscan run --resume --out {out_dir}"


def _open(directory: RunDirectory, asked: dict[str, Any], engine: Engine, *, store: str | None) -> None:
    """Write the manifest, or check that the one there asks for the same and add this sitting."""
    run = load_run(directory.path) if directory.manifest.exists() else None
    if run:
        _refuse_another(run, asked)
    hands = engine.hands(len(asked["cases"]))
    sitting = session(workers=hands.workers, threads=hands.threads, renderer=hands.renderer) | hands.more
    before = dict(run.manifest) if run else {**asked, "sessions": []}
    if run:
        _warn_of_other_code(before["sessions"][-1], sitting)
    where = {"store": store} if store else {}
    write_manifest(directory, {**before, **where, "sessions": [*before["sessions"], sitting]})


def _refuse_foreign(directory: RunDirectory) -> None:
    """Leave a folder alone that holds anything but a run."""
    if directory.path.exists() and not directory.path.is_dir():
        raise InputError(f"{directory.path}: not a directory; choose another with --out")
    begun = directory.manifest.exists() or not directory.path.exists()
    if not begun and any(item.name != ".lock" for item in directory.path.iterdir()):
        raise InputError(f"{directory.path}: not empty and not a run; choose another directory with --out")


def _warn_of_other_code(before: dict[str, Any], now: dict[str, Any]) -> None:
    """Say so when the sittings of a run differ in what its records depend on."""
    differ = [key for key in ("git", "versions", "renderer", "python") if before.get(key) != now[key]]
    if differ:
        _LOG.warning("note: this run was begun with another state of: %s", ", ".join(differ))


def _refuse_another(run: Run, asked: dict[str, Any]) -> None:
    differ = [key for key in ("suite_hash", "seed", "metrics", "cases") if run.manifest[key] != asked[key]]
    if differ:
        raise InputError(
            f"{run.directory.path}: holds a run of suite '{run.suite.name}' that differs in "
            f"{', '.join(differ)}; choose another directory with --out"
        )


def _settle(directory: RunDirectory, cases: Sequence[Case], variants: int) -> list[Case]:
    """Keep the records of cases that are complete; say which cases are still to do."""
    run = load_run(directory.path)
    kept, again = run.records, run.obstructed
    for case, why in again.items():
        _LOG.warning("note: %s is tried again: its machine failed, not a method: %s", case, why)
    counts = Counter(record.case for record in kept)
    whole = {case for case, count in counts.items() if count == variants and case not in again}
    write(directory.records, (record for record in kept if record.case in whole))
    return [case for case in cases if case.id not in whole]


def _definitions(suite: Suite) -> dict[str, Any]:
    """What makes metric values of two runs comparable."""
    metrics = [*METRICS.values(), *map(metric_named, own_metrics(suite.metrics))]
    keys = ("title", "unit", "better", "version", "source")
    return {metric.name: {key: getattr(metric, key) for key in keys} for metric in metrics}
