"""``burrscan run``."""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import asdict
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bench.cli.grammar import add_json, add_trust, not_negative, positive
from bench.cli.output import told, write_json
from bench.cli.signals import Terminated

if TYPE_CHECKING:
    from bench.run import Run
    from bench.run.engine import Engine
    from bench.suites.suite import Suite

RUNS = Path("reports/runs")
"""Where run directories go by default, below the current directory."""

SUMMARY = "run a suite: render, scan, inspect, score, report"
DETAILS = """\
Every case is simulated once and seen by every variant. Records are appended as cases end, so
that a run can be stopped at any moment, and the same command with --resume finishes it with the
records that an undisturbed run would have made.

Data may not name code: a run directory that is resumed names shipped methods and metrics only,
unless --trust is given. A suite's file is yours and may.

exit codes: 0 every variant has a result, 2 a variant failed in every case, or the input or the
machine cannot be used, 3 an error of burrscan's own, 130 interrupted, 143 terminated"""

EXAMPLES = """\
  burrscan run quick
  burrscan run my/suite.toml --out runs/first --workers 2
  burrscan run quick --case 'finish=turned,burr.height_mm=2,seed=1'
  burrscan run --resume               finish the run that was interrupted last
  burrscan run quick --scheduler tcp://10.0.0.5:8786
  burrscan run standard --shard 3/16 --out runs/part-3"""


def options(parser: argparse.ArgumentParser) -> None:
    """What it takes."""
    parser.add_argument(
        "suite", metavar="SUITE", nargs="?", help="a suite's name, or the path of a TOML file"
    )
    parser.add_argument("--out", metavar="DIR", type=Path, help=f"run directory (default: {RUNS}/SUITE-TIME)")
    parser.add_argument("--workers", metavar="N", type=positive, help="processes (default: one per core)")
    parser.add_argument(
        "--seed", metavar="S", type=not_negative, help="another seed, another realisation (default: 0)"
    )
    parser.add_argument("--case", metavar="PATTERN", help="only these cases, such as 'finish=turned,*'")
    add_json(parser, "scores, goals and failures")
    parser.add_argument(
        "--shard", metavar="I/N", help="only every N-th case from the I-th on; 'burrscan gather' joins shards"
    )
    add_trust(parser, "the run directory to resume")
    parser.add_argument(
        "--resume", action="store_true", help="finish the newest unfinished run, or that in --out"
    )
    cluster = parser.add_argument_group("on a Dask cluster that is there already (docs/cluster.md)")
    cluster.add_argument(
        "--scheduler", metavar="ADDRESS|FILE", help="hand the cases to this scheduler's workers"
    )
    cluster.add_argument(
        "--store", metavar="ADDRESS",
        help="folder or fsspec address where workers leave pictures and traced light (default: pictures come "
        "back with the records)",
    )  # fmt: skip
    cluster.add_argument(
        "--resources", metavar="NAME=N", nargs="+", default=[],
        help="what a case takes of its worker; GPU=1 renders with CUDA on workers that offer it",
    )  # fmt: skip


def main(given: argparse.Namespace) -> int:
    """Run, print the score table, build the report."""
    from bench.report import build_report
    from bench.run.directory import load_run

    out_dir = _where(given)
    try:
        _run(given, out_dir)
    except KeyboardInterrupt as stop:
        ended, code = ("terminated", 143) if isinstance(stop, Terminated) else ("interrupted", 130)
        print(f"\nburrscan: {ended}; to finish: burrscan run --resume --out {out_dir}", file=sys.stderr)
        return code
    run = load_run(out_dir)
    page = build_report(out_dir)  # before anything is printed: the reader may leave, as `| head` does
    hopeless = hopeless_variants(run)
    with told(given.json):
        _print(run)
        print(f"report: {page}")
    if given.json:
        write_json(given.json, {**_document(run), "report": str(page), "exit_code": 2 if hopeless else 0})
    if hopeless:
        print(f"burrscan: no case has a result: {', '.join(hopeless)}", file=sys.stderr)
    return 2 if hopeless else 0


def _print(run: Run) -> None:
    from bench.cli.score import budget_table, caption, goals_table, say_failures, terminal_table, times_table
    from bench.cli.tables import print_table

    print_table(terminal_table(run))
    print(caption())
    if goals := goals_table(run):
        print_table(goals)
    if budget := budget_table(run):
        print_table(budget)
    print_table(times_table(run))
    say_failures(run)


def _document(run: Run) -> dict[str, Any]:
    """The tables as data, units as in the records."""
    from bench.score.metrics import HEADLINE, metric_named
    from bench.summary.goals import goal_rows
    from bench.summary.table import score_table, typical

    names, by = run.suite.metrics or HEADLINE, run.suite.divided_by
    metrics = {
        name: {"title": (one := metric_named(name)).title, "unit": one.unit, "typical": typical(name)}
        for name in names
    }
    scores = [
        {
            "where": dict(zip(by, row.group, strict=False)),
            "variant": row.variant,
            "cases": row.cases,
            "failed": row.failed,
            "values": dict(row.values),
        }
        for row in score_table(run.records, names, by=by)
    ]
    goals = [
        {"goal": asdict(row.goal), "variant": row.variant, "measured": row.measured, "met": row.met}
        for row in goal_rows(run.suite, run.records)
    ]
    failures = [
        {"case": record.case, "variant": record.variant, "error": record.failure.error}
        for record in run.records
        if record.failure
    ]
    head = {"format": 1, "run": str(run.directory.path), "suite": run.suite.name, "seed": run.seed}
    return {**head, "metrics": metrics, "scores": scores, "goals": goals, "failures": failures}


def hopeless_variants(run: Run) -> list[str]:
    """The variants that failed in every case that was run."""
    names = list(dict.fromkeys(record.variant for record in run.records))
    return [
        name
        for name in names
        if all(record.failure is not None for record in run.records if record.variant == name)
    ]


def _where(given: argparse.Namespace) -> Path:
    """The run directory: the one named, the one to resume, or a new one."""
    from bench.run.directory import fresh_name, unfinished
    from bench.suites.catalogue import load_suite
    from burrscan.errors import InputError

    if given.resume:
        name = load_suite(given.suite).name if given.suite else None
        return given.out or unfinished(RUNS, name)
    if not given.suite:
        raise InputError("name a suite ('burrscan suites' lists them), or say --resume")
    stamp = datetime.now().isoformat(timespec="milliseconds")  # noqa: DTZ005 (people's own time)
    return given.out or RUNS / fresh_name(load_suite(given.suite).name, stamp)


def _run(given: argparse.Namespace, out_dir: Path) -> None:
    """Run what is asked for, or what the directory to resume says."""
    from bench.cli.progress import shown
    from bench.run.cost_model import update_cost_model
    from bench.run.costs import estimate, known_costs
    from bench.run.directory import load_run
    from bench.run.runner import run_suite
    from bench.run.shard import Shard
    from bench.suites.cases import chosen, expand
    from bench.suites.catalogue import load_suite
    from scenes.transport.store import default_folder

    begun = load_run(out_dir) if given.resume else None
    suite = load_suite(given.suite) if given.suite or begun is None else begun.suite
    if begun and not given.suite:
        _refuse_code(begun, trusted=given.trust)
    usual = (begun.seed, begun.manifest["only"], begun.manifest.get("shard")) if begun else (0, "*", None)
    seed = usual[0] if given.seed is None else given.seed
    only, shard = given.case or usual[1], given.shard or usual[2]
    part = Shard.parse(shard) if shard else None
    engine = _engine(given, suite)
    cases = chosen(expand(suite, seed=seed), only)
    done = {record.case for record in begun.records} - begun.obstructed.keys() if begun else set()
    cases = tuple(case for case in (part.part(cases) if part else cases) if case.id not in done)
    workers = max(1, engine.hands(len(cases)).workers)
    print(estimate(suite, cases, known_costs(default_folder()), workers=workers), file=sys.stderr, flush=True)
    start = time.monotonic()
    with shown(suite.name) as progress:
        run_suite(
            suite, out_dir, seed=seed, only=only, shard=part, progress=progress,
            engine=engine, store=_store(given, begun),
        )  # fmt: skip
    if not given.scheduler:  # other machines teach nothing of this one
        update_cost_model(
            default_folder(), load_run(out_dir), cases, wall_s=time.monotonic() - start, workers=workers
        )


def _engine(given: argparse.Namespace, suite: Suite) -> Engine:
    """Processes of this machine, or the cluster that is named."""
    from bench.cli.output import note
    from bench.run.engine import Local
    from burrscan.errors import InputError
    from scenes.stores import EXTRA

    if not given.scheduler:
        if given.store or given.resources:
            raise InputError("--store and --resources are for workers of a cluster; name its --scheduler")
        return Local(given.workers)
    if given.workers:
        raise InputError("--workers are this machine's; a scheduler has those that are started for it")
    try:
        from bench.cluster.engine import Dask, resources_from
    except ImportError as error:
        raise InputError(f"--scheduler needs Dask ({error}); {EXTRA}") from error
    return Dask(given.scheduler, suite, resources=resources_from(given.resources), say=note)


def _store(given: argparse.Namespace, begun: Run | None) -> str:
    """The address of the store: the one named, tried out, or that of the run to resume."""
    from scenes.stores import Store

    if given.store:
        address = given.store if "://" in given.store else str(Path(given.store).absolute())
        return Store(address).checked().address
    before = str(begun.manifest.get("store") or "") if begun and given.scheduler else ""
    return before.rpartition("/runs/")[0]


def _refuse_code(run: Run, *, trusted: bool) -> None:
    """Refuse code that a run directory names: it is data; the workers would import it."""
    from bench.score.metrics import metric_named
    from bench.suites.variants import pipeline_of
    from burrscan.variants import shipped_only

    with shipped_only(str(run.directory.manifest), trusted=trusted):
        for variant in run.suite.variant:
            pipeline_of(variant)
        for metric in run.suite.metrics:
            metric_named(metric)
