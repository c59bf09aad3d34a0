"""Comparing runs: verdicts, failures, what is refused, exit codes, files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from bench.cli import main
from bench.compare import ArmComparison, Row, compare_runs
from bench.compare.outputs import junit, markdown, to_json
from bench.experiments.ab_error_rates import error_rates
from bench.run.directory import Run
from burrscan.errors import InputError
from tests.bench.compare_runs import with_failure, written_run


@pytest.fixture
def base(tmp_path: Path) -> Run:
    return written_run(tmp_path / "base")


def row_of(arm: ArmComparison, metric: str) -> Row:
    return next(row for row in arm.rows if row.metric == metric)


def worse_axis(number: int, metrics: dict[str, float]) -> dict[str, float]:
    return {**metrics, "axis_deg": metrics["axis_deg"] + 0.05 + 0.001 * (number % 3)}


def test_a_run_is_equivalent_to_itself(base: Run, tmp_path: Path) -> None:
    comparison = compare_runs(base, written_run(tmp_path / "again"))
    assert comparison.exit_code == 0
    assert {row.verdict for row in comparison.arms[0].rows} == {"equivalent"}


def test_a_planted_regression_breaks_the_gate_and_only_there(base: Run, tmp_path: Path) -> None:
    comparison = compare_runs(base, written_run(tmp_path / "new", change=worse_axis))
    verdicts = {row.metric: row.verdict for row in comparison.arms[0].rows}
    assert comparison.exit_code == 1
    assert verdicts.pop("axis_deg") == "worse"
    assert "worse" not in verdicts.values()
    row = row_of(comparison.arms[0], "axis_deg")
    assert row.difference == pytest.approx(0.051, abs=1e-3)
    assert row.low <= row.difference <= row.high
    assert compare_runs(written_run(tmp_path / "b", change=worse_axis), base).exit_code == 0


def test_a_certain_difference_within_the_margin_is_equivalent_and_said(base: Run, tmp_path: Path) -> None:
    comparison = compare_runs(
        base, written_run(tmp_path / "new", change=worse_axis), margins={"axis_deg": 0.1}
    )
    row = row_of(comparison.arms[0], "axis_deg")
    assert (row.verdict, row.seen, comparison.exit_code) == ("equivalent", "worse", 0)


def test_seeds_of_a_scene_are_not_independent(base: Run, tmp_path: Path) -> None:
    """One scene that is much worse, with both its seeds, tells little of the others."""

    def one_scene(number: int, metrics: dict[str, float]) -> dict[str, float]:
        return {**metrics, "depth_rms_mm": metrics["depth_rms_mm"] + (0.5 if number in {0, 1} else 0.0)}

    row = row_of(compare_runs(base, written_run(tmp_path / "n", change=one_scene)).arms[0], "depth_rms_mm")
    assert (row.scenes, row.pairs, row.verdict) == (8, 16, "inconclusive")


def test_a_new_failure_breaks_the_gate_and_counts_in_every_metric(base: Run) -> None:
    comparison = compare_runs(base, with_failure(base, 3))
    arm = comparison.arms[0]
    assert comparison.exit_code == 1
    assert [case.case for case in arm.newly_failed] == [base.records[3].case]
    assert arm.cases[0].case == base.records[3].case
    assert row_of(arm, "coverage").difference == pytest.approx(-base.records[3].metrics["coverage"] / 16)
    depth = [record.metrics["depth_rms_mm"] for record in base.records]
    penalty = max(depth) + 0.01 - depth[3]
    assert row_of(arm, "depth_rms_mm").difference == pytest.approx(penalty / 16)
    assert row_of(arm, "depth_rms_mm").pairs == 16
    assert arm.burrs.lost == 1


def test_a_fixed_case_is_better_and_listed(base: Run) -> None:
    comparison = compare_runs(with_failure(base, 3), base)
    assert comparison.exit_code == 0
    assert row_of(comparison.arms[0], "failures").verdict == "better"
    assert comparison.arms[0].newly_fixed


def test_failing_in_both_is_no_difference(base: Run) -> None:
    both = with_failure(base, 3)
    comparison = compare_runs(both, both)
    assert comparison.exit_code == 0
    assert comparison.arms[0].still_failing


def test_all_burrs_lost_is_worse_by_mcnemar(base: Run, tmp_path: Path) -> None:
    blind = written_run(tmp_path / "n", change=lambda _, m: {**m, "burr_found": 0.0})
    arm = compare_runs(base, blind).arms[0]
    assert (arm.burrs.lost, arm.burrs.gained) == (16, 0)
    assert arm.burrs.p == pytest.approx(2.0 * 0.5**16)
    assert row_of(arm, "burr_found").verdict == "worse"


def test_another_scene_is_not_comparable(base: Run) -> None:
    other = replace(base.records[0], scene_hash="other")
    comparison = compare_runs(base, replace(base, records=(other, *base.records[1:])))
    assert comparison.exit_code == 2
    assert comparison.arms[0].changed == (other.case,)
    every = tuple(replace(record, scene_hash="other") for record in base.records)
    rows = compare_runs(base, replace(base, records=every)).arms[0].rows
    assert {row.verdict for row in rows if row.metric != "failures"} == {"not comparable"}


def test_another_version_of_a_metric_is_not_comparable(base: Run) -> None:
    metrics = {
        **base.manifest["metrics"],
        "coverage": {**base.manifest["metrics"]["coverage"], "version": 99},
    }
    comparison = compare_runs(base, replace(base, manifest={**base.manifest, "metrics": metrics}))
    row = row_of(comparison.arms[0], "coverage")
    assert (row.verdict, comparison.exit_code) == ("not comparable", 2)
    assert "99" in row.note


def test_missing_cases_are_not_comparable(base: Run) -> None:
    shorter = replace(base, records=base.records[:-2])
    assert compare_runs(base, shorter).exit_code == 2
    assert compare_runs(shorter, base).exit_code == 0


def test_nothing_in_common_is_refused(base: Run, tmp_path: Path) -> None:
    elsewhere = tuple(replace(record, case=f"other-{record.case}") for record in base.records)
    with pytest.raises(InputError, match="no case in common"):
        compare_runs(base, replace(base, records=elsewhere))
    with pytest.raises(InputError, match="no variant in common"):
        compare_runs(base, written_run(tmp_path / "n", variant=[{"name": "theirs"}]))
    with pytest.raises(InputError, match="did you mean 'axis_deg'"):
        compare_runs(base, base, margins={"axis_degs": 1.0})


def test_the_suites_own_gates_decide(tmp_path: Path) -> None:
    gate = [{"metric": "coverage"}, {"metric": "axis_deg", "margin": 0.2}]
    base = written_run(tmp_path / "base", gate=gate)
    new = written_run(tmp_path / "new", gate=gate, change=worse_axis)
    gated = {row.metric: row.margin for row in compare_runs(base, new).arms[0].rows if row.gated}
    assert gated == {"coverage": 0.01, "axis_deg": 0.2}
    assert compare_runs(base, new).exit_code == 0


def test_two_variants_of_one_run(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run", variant=[{"name": "a"}, {"name": "b"}])
    arm = compare_runs(run, run, variants=("a", "b")).arms[0]
    assert (arm.base, arm.new) == ("a", "b")


def test_what_is_written(base: Run, tmp_path: Path) -> None:
    comparison = compare_runs(base, with_failure(written_run(tmp_path / "n", change=worse_axis), 3))
    text = markdown(comparison)
    assert "✗ worse" in text
    assert "newly failed" in text
    suite = ET.fromstring(junit(comparison))[0]  # noqa: S314 (our own text)
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["failures", "axis_deg"]
    assert suite.get("failures") == "2"
    told = json.loads(to_json(comparison))
    assert (told["exit_code"], told["arms"][0]["newly_failed"][0]["case"]) == (1, base.records[3].case)


def test_the_command(base: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written_run(tmp_path / "new", change=worse_axis)
    paths = [str(base.directory.path), str(tmp_path / "new")]
    files = {name: tmp_path / f"out.{name}" for name in ("markdown", "junit", "json")}
    options = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    assert main(["compare", *paths, *options]) == 1
    assert all(path.stat().st_size for path in files.values())
    assert main(["compare", paths[0], paths[0]]) == 0
    assert main(["compare", paths[0]]) == 2
    assert main(["compare", paths[0], str(tmp_path / "nothing")]) == 2
    assert main(["compare", *paths, "--margin", "axis_deg=1"]) == 0
    assert "worse in axis angle" in capsys.readouterr().out


@pytest.mark.parametrize("cases", [1, 4, 10])
def test_in_a_small_suite_a_difference_in_every_case_is_a_fact(base: Run, tmp_path: Path, cases: int) -> None:
    new = written_run(tmp_path / "new", change=worse_axis)
    few = [replace(run, records=run.records[:cases]) for run in (base, new)]
    row = row_of(compare_runs(*few).arms[0], "axis_deg")
    assert (row.verdict, compare_runs(*few).exit_code) == ("worse", 1)
    assert row.every == "worse"


def test_in_a_small_suite_one_case_that_differs_proves_nothing(base: Run, tmp_path: Path) -> None:
    one = written_run(tmp_path / "n", change=lambda k, m: worse_axis(k, m) if k == 1 else m)
    few = [replace(run, records=run.records[:6]) for run in (base, one)]
    assert row_of(compare_runs(*few).arms[0], "axis_deg").verdict == "inconclusive"
    noisy = [replace(record, identity="other") for record in worse_run(tmp_path).records[:6]]
    other = replace(few[0], records=tuple(noisy))
    assert row_of(compare_runs(few[0], other).arms[0], "axis_deg").every == ""


def worse_run(folder: Path) -> Run:
    return written_run(folder / "worse", change=worse_axis)


def test_no_result_at_all_is_not_called_equivalent(base: Run) -> None:
    nothing = base
    for number in range(16):
        nothing = with_failure(nothing, number)
    rows = compare_runs(nothing, nothing).arms[0].rows
    assert next(row.verdict for row in rows if row.metric == "depth_rms_mm") == "inconclusive"


def test_false_verdicts_are_rare_and_a_regression_of_the_margin_is_caught() -> None:
    """Twenty A/A comparisons of eight scenes; bench/compare/README.md has 200 of each size."""
    rates = error_rates(20, scenes=8, seeds=2, sizes=(1.0,), names=("coverage", "depth_rms_mm"))
    assert rates.false_verdicts <= 2
    assert np.mean([rates.caught[name, 1.0]["worse"] for name in ("coverage", "depth_rms_mm")]) >= 18
