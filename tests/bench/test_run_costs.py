"""What a run is said to cost, and how that is learned."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest

from bench.run.cost_model import update_cost_model
from bench.run.costs import SHIPPED, estimate, known_costs, pipeline_key
from bench.run.directory import Run, RunDirectory
from bench.run.records import Failure, Record
from bench.suites.case import Case
from bench.suites.cases import expand
from bench.suites.suite import Suite, suite_from

SUITE = suite_from(
    {
        "name": "s",
        "scene": {"wheel": "paper", "finish": "matte", "rig": {"scale": 0.5}},
        "variant": [{"name": "a"}, {"name": "b", "scan": "fixed"}],
        "seeds": list(range(10)),
    },
    source="test",
)
MEGAPIXELS = 640 * 512 * 1e-6


def run_of(suite: Suite, cases: tuple[Case, ...], folder: Path, *, transport_s: float = 2.0) -> Run:
    """A run whose variants took 3 and 1 s, and one of whose records failed."""
    records = []
    for case in cases:
        for variant, scan_s in (("a", 3.0), ("b", 1.0)):
            times = {"wheel": 0.5, "transport": transport_s, "scan": scan_s}
            failed = Failure("scan", "", "") if case.seed == 3 and variant == "b" else None
            records.append(
                Record(case.id, variant, {}, "", "", {}, failure=failed, timings_s={} if failed else times)
            )
        (folder / "cases" / case.id).mkdir(parents=True, exist_ok=True)
        (folder / "cases" / case.id / "truth.npz").write_bytes(b"0" * 3800)
    return Run(RunDirectory(folder), suite, 0, {"cases": []}, tuple(records))


def test_what_was_learned_is_what_the_next_run_is_said_to_take(tmp_path: Path) -> None:
    cases = expand(SUITE)
    run = run_of(SUITE, cases, tmp_path / "run")
    spent_s = 10 * (2.5 + 3.0 + 1.0) - 1.0
    update_cost_model(tmp_path, run, cases, wall_s=15.0 + 1.5 * spent_s / 2, workers=2)
    costs = known_costs(tmp_path)
    assert costs.seconds["scene"] == pytest.approx(2.5 / MEGAPIXELS)
    assert costs.seconds[pipeline_key(SUITE.variant[0])] == pytest.approx(3.0 / MEGAPIXELS)
    assert costs.overhead == pytest.approx(1.5, rel=0.05)
    assert costs.record_bytes == pytest.approx(2000.0)
    told = estimate(SUITE, cases, costs, workers=2)
    assert told.seconds == pytest.approx(15.0 + 1.5 * spent_s / 2, rel=0.05)
    assert estimate(SUITE, cases, costs, workers=64).workers == 10
    assert "an estimate: about 60 s on 2 cores" in str(told)
    assert costs.measured in str(told)


def test_light_that_was_only_read_does_not_make_tracing_cheap(tmp_path: Path) -> None:
    cases = expand(SUITE)
    for transport_s in (2.0, 0.0):
        update_cost_model(
            tmp_path,
            run_of(SUITE, cases, tmp_path / "run", transport_s=transport_s),
            cases,
            wall_s=90.0,
            workers=1,
        )
    assert known_costs(tmp_path).seconds["scene"] == pytest.approx(2.5 / MEGAPIXELS)


def test_short_runs_and_broken_files_teach_nothing(tmp_path: Path) -> None:
    cases = expand(SUITE)
    run = run_of(SUITE, cases, tmp_path / "run")
    update_cost_model(tmp_path, run, cases, wall_s=20.0, workers=1)
    update_cost_model(tmp_path, run, cases[:3], wall_s=90.0, workers=1)
    update_cost_model(None, run, cases, wall_s=90.0, workers=1)
    assert known_costs(tmp_path) is known_costs(None) is SHIPPED
    (tmp_path / "costs.json").write_text("{")
    assert known_costs(tmp_path) is SHIPPED
    (tmp_path / "costs.json").write_text('{"seconds": 3}')
    assert known_costs(tmp_path) is SHIPPED


def test_figures_that_do_not_know_a_source_yet_learn_it(tmp_path: Path) -> None:
    """Those of a machine whose last run was by an older burrscan."""
    cases = expand(SUITE)
    known = {name: each for name, each in SHIPPED.seconds.items() if name != "scene"}
    (tmp_path / "costs.json").write_text(json.dumps(asdict(replace(SHIPPED, seconds=known))))
    assert "scene" not in known_costs(tmp_path).seconds
    update_cost_model(tmp_path, run_of(SUITE, cases, tmp_path / "run"), cases, wall_s=90.0, workers=1)
    assert known_costs(tmp_path).seconds["scene"] == pytest.approx(2.5 / MEGAPIXELS)


def test_more_pixels_cost_more_and_nothing_costs_nothing() -> None:
    full = replace(SUITE, scene={**SUITE.scene, "rig": {"scale": 1.0}})
    few, many = (estimate(s, expand(s), SHIPPED, workers=1).seconds - 15.0 for s in (SUITE, full))
    assert many == pytest.approx(4.0 * few, rel=0.01)
    assert estimate(SUITE, (), SHIPPED, workers=2).seconds == 0.0
