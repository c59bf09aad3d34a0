"""Comparing runs: verdicts, failures, what is refused, exit codes, files."""

from __future__ import annotations

import csv
import io
import json
import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree as ET

import pytest

from bench.cli import main
from bench.compare import ArmComparison, Row, compare_runs
from bench.compare.outputs import Sitting, junit, latex, markdown, to_csv, to_document
from bench.experiments.ab_error_rates import false_verdicts, plants, seen
from bench.run.directory import Run, load_run
from burrscan.errors import InputError
from tests.bench.compare_runs import with_failure, with_plain_seeds, written_run

SITTING = Sitting(datetime(2026, 11, 22, 1, 2, 3, tzinfo=UTC), 1.5, "lab")


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

    new = written_run(tmp_path / "n", change=one_scene)
    row = row_of(compare_runs(*map(with_plain_seeds, (base, new))).arms[0], "depth_rms_mm")
    assert (row.scenes, row.pairs, row.verdict) == (8, 16, "inconclusive")
    assert row.worse_cases == 2
    assert row.mean_difference == pytest.approx(0.0625)
    assert "one scene makes 100 % of it" in row.note


@pytest.mark.parametrize(("hashes", "scenes"), [(1, 16), (2, 2), (16, 16)])
def test_scenes_are_those_that_differ_and_seeds_where_none_do(base: Run, hashes: int, scenes: int) -> None:
    """With one scene in all, its sixteen cases are all there is to resample."""
    records = tuple(replace(r, scene_hash=f"hash-{n % hashes}") for n, r in enumerate(base.records))
    run = replace(base, records=records)
    assert row_of(compare_runs(run, run).arms[0], "depth_rms_mm").scenes == scenes


def test_a_new_failure_breaks_the_gate_and_counts_in_every_metric(base: Run) -> None:
    comparison = compare_runs(base, with_failure(base, 3))
    arm = comparison.arms[0]
    assert comparison.exit_code == 1
    assert [case.case for case in arm.newly_failed] == [base.records[3].case]
    assert arm.cases[0].case == base.records[3].case
    assert row_of(arm, "coverage").difference == pytest.approx(-base.records[3].metrics["coverage"] / 16)
    depth = [record.metrics["depth_rms_mm"] for record in base.records]
    penalty = max(depth) + 0.01 - depth[3]
    assert row_of(arm, "depth_rms_mm").mean_difference == pytest.approx(penalty / 16)
    assert row_of(arm, "depth_rms_mm").pairs == 16
    assert len(arm.burrs.lost) == 1


def test_a_fixed_case_is_better_and_listed(base: Run) -> None:
    comparison = compare_runs(with_failure(base, 3), base)
    assert comparison.exit_code == 0
    assert row_of(comparison.arms[0], "failures").verdict == "better"
    assert comparison.arms[0].newly_fixed


def test_failures_are_counted_as_new_ones_less_those_mended(base: Run) -> None:
    """Case 3 fails in both; 5 fails newly; 1, 2 and 4 are mended: two fewer."""
    before, after = base, base
    for number in (1, 2, 3, 4):
        before = with_failure(before, number)
    for number in (3, 5):
        after = with_failure(after, number)
    row = row_of(compare_runs(before, after).arms[0], "failures")
    assert (row.base, row.new, row.worse_cases, row.better_cases) == (4.0, 2.0, 1, 3)
    assert (row.difference, row.mean_difference) == (-2.0, -2.0)
    assert (row.low, row.high) == (-2.0, -2.0)


def test_records_of_one_scene_with_other_true_burrs_are_refused(base: Run) -> None:
    record = replace(base.records[3], burrs=base.records[3].burrs * 2)
    damaged = replace(base, records=(*base.records[:3], record, *base.records[4:]))
    for arms in ((base, damaged), (damaged, base)):
        with pytest.raises(InputError, match="true burrs: one is damaged"):
            compare_runs(*arms)


def test_failing_in_both_is_no_difference(base: Run) -> None:
    both = with_failure(base, 3)
    comparison = compare_runs(both, both)
    assert comparison.exit_code == 0
    assert comparison.arms[0].still_failing


def test_burrs_lost_and_gained_are_told_by_name(base: Run, tmp_path: Path) -> None:
    blind = written_run(tmp_path / "n", change=lambda _, m: {**m, "burr_found": 0.0})
    comparison = compare_runs(base, blind)
    arm = comparison.arms[0]
    assert (len(arm.burrs.lost), len(arm.burrs.gained)) == (16, 0)
    assert str(arm.burrs.lost[0]) == f"{base.records[0].case}: burr 1 (1 mm high)"
    assert row_of(arm, "burr_found").worse_cases == 16
    assert [gate.kind for gate in arm.gates if gate.state == "broken"] == ["margin", "lost"]
    assert [str(change) for change in compare_runs(blind, base).arms[0].burrs.gained] == [
        str(change) for change in arm.burrs.lost
    ]


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
    suite = ET.fromstring(junit(comparison, SITTING))[0]  # noqa: S314 (our own text)
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert failed == ["failures", "axis_deg", "burr_found lost"]
    assert suite.get("failures") == "3"
    told = to_document(comparison)
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


@pytest.mark.parametrize("cases", [1, 4, 5])
def test_in_a_small_suite_a_difference_in_every_case_is_a_fact(base: Run, tmp_path: Path, cases: int) -> None:
    new = written_run(tmp_path / "new", change=worse_axis)
    few = [replace(run, records=run.records[:cases]) for run in (base, new)]
    comparison = compare_runs(*few)
    row = row_of(comparison.arms[0], "axis_deg")
    assert (row.verdict, row.every, comparison.exit_code) == ("inconclusive", "worse", 1)
    assert f"worse beyond the margin in every one of {cases} case(s)" in comparison.sentence()


def test_in_a_small_suite_one_case_that_differs_proves_nothing(base: Run, tmp_path: Path) -> None:
    one = written_run(tmp_path / "n", change=lambda k, m: worse_axis(k, m) if k == 1 else m)
    few = [replace(run, records=run.records[:6]) for run in (base, one)]
    row = row_of(compare_runs(*few).arms[0], "axis_deg")
    assert (row.verdict, row.every, row.worse_cases) == ("inconclusive", "", 1)
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


@pytest.mark.study
def test_false_verdicts_are_rare_and_regressions_are_seen() -> None:
    """Twenty A/A comparisons with other noise; bench/compare/README.md has 200 of each."""
    by_name = {name: (metric, plant) for name, metric, plant in plants()}
    assert false_verdicts(20, scenes=28) <= 2
    for name in ("25 % of the burrs lost", "burr_angle_deg, 1 margins"):
        assert seen(20, *by_name[name], scenes=28) >= 18


def blind(_: int, metrics: dict[str, float]) -> dict[str, float]:
    return {**metrics, "burr_found": 0.0}


@pytest.mark.parametrize("gate", [[], [{"metric": "burr_found"}, {"metric": "axis_deg"}]])
def test_a_detector_that_finds_nothing_breaks_the_gate(tmp_path: Path, gate: list[dict[str, str]]) -> None:
    """Finding 1: 6 of 6 burrs lost, in three scenes; by default, and with two metrics gated by margins."""
    base = written_run(tmp_path / "base", gate=gate)
    new = written_run(tmp_path / "new", gate=gate, change=blind)
    comparison = compare_runs(*(replace(run, records=run.records[:6]) for run in (base, new)))
    assert comparison.exit_code == 1
    suite = ET.fromstring(junit(comparison, SITTING))[0]  # noqa: S314 (our own text)
    failed = [case.get("name") for case in suite if case.find("failure") is not None]
    assert "burr_found" in failed
    assert "burr_found" in comparison.sentence() or "burrs found" in comparison.sentence()


def test_nine_of_twelve_burrs_lost_from_the_real_baseline_breaks_the_gate() -> None:
    """Finding 1: the accepted run of the suite with its old gates, that is none of its own."""
    run = load_run(Path("reports/baselines/quick/0003-92f5763ea"))
    hits = [record for record in run.records if record.variant == "adaptive" and record.metrics["burr_found"]]
    assert len(hits) == 12
    lost = {record.key for record in hits[:9]}
    blinded = tuple(
        replace(
            record,
            metrics={**record.metrics, "burr_found": 0.0},
            burrs=tuple({**burr, "found": False} for burr in record.burrs),
        )
        if record.key in lost
        else record
        for record in run.records
    )
    comparison = compare_runs(run, replace(run, records=blinded))
    assert comparison.exit_code == 1
    assert "9 burr(s) lost, 0 allowed" in comparison.sentence()
    assert 'message="9 burr(s) lost, 0 allowed"' in junit(comparison, SITTING)


def loses_one(number: int, metrics: dict[str, float]) -> dict[str, float]:
    return {**metrics, "burr_found": float(number != 3)}


@pytest.mark.parametrize(
    ("gate", "broken"),
    [
        ({"metric": "burr_found", "lost": 0}, ["lost"]),
        ({"metric": "burr_found", "lost": 1}, []),
        ({"metric": "burr_found", "floor": 0.95}, ["floor"]),
        ({"metric": "burr_found", "floor": 0.9}, []),
        ({"metric": "burr_found", "lost": 0, "floor": 0.99}, ["lost", "floor"]),
        ({"metric": "axis_deg", "ceiling": 0.01}, ["ceiling"]),
        ({"metric": "axis_deg", "ceiling": 0.011}, []),
        ({"metric": "axis_deg", "lost": 15, "margin": 9.0}, []),
        ({"metric": "failures", "lost": 0}, []),
    ],
)
def test_gates_by_fact_and_by_value(tmp_path: Path, gate: dict[str, object], broken: list[str]) -> None:
    base = written_run(tmp_path / "base", gate=[gate])
    new = written_run(tmp_path / "new", gate=[gate], change=loses_one)
    comparison = compare_runs(base, new)
    assert [outcome.kind for outcome in comparison.gates if outcome.state == "broken"] == broken
    assert comparison.exit_code == bool(broken)


def test_with_other_noise_a_burr_lost_is_no_fact(base: Run, tmp_path: Path) -> None:
    run = written_run(tmp_path / "n", change=loses_one)
    other = replace(run, records=tuple(replace(r, identity=f"{r.identity}'") for r in run.records))
    comparison = compare_runs(base, other)
    lost = next(gate for gate in comparison.gates if gate.kind == "lost")
    assert (lost.state, comparison.exit_code, comparison.strict_exit_code()) == ("inconclusive", 0, 1)
    assert "different noise" in lost.said


def test_inconclusive_is_skipped_in_junit_and_strict_minds_it(tmp_path: Path) -> None:
    def one_scene(number: int, metrics: dict[str, float]) -> dict[str, float]:
        return {**metrics, "coverage": metrics["coverage"] - (0.5 if number in {0, 1} else 0.0)}

    paths = [written_run(tmp_path / "a").directory.path, tmp_path / "b"]
    comparison = compare_runs(load_run(paths[0]), written_run(paths[1], change=one_scene))
    suite = ET.fromstring(junit(comparison, SITTING))[0]  # noqa: S314 (our own text)
    skipped = {str(c.get("name")): s.get("message") for c in suite if (s := c.find("skipped")) is not None}
    assert "coverage is inconclusive" in str(skipped["coverage"])
    assert suite.get("skipped") == str(len(skipped))
    words = ["compare", *map(str, paths)]
    assert (main(words), main([*words, "--strict"])) == (0, 1)


def test_cases_whose_scenes_differ_are_scenes_of_their_own(base: Run) -> None:
    """Three points with eight seeds, each of which draws its own pose, are 24 scenes."""
    finishes = ("polished", "turned", "ground")
    records = tuple(
        replace(base.records[0], case=f"{f}{s}", scene_hash=f"{f}{s}", parameters={"finish": f, "seed": s})
        for f in finishes
        for s in range(8)
    )
    run = replace(base, records=records)
    assert row_of(compare_runs(run, run).arms[0], "coverage").scenes == 24
    same = replace(run, records=tuple(replace(r, scene_hash=r.case[:-1]) for r in records))
    assert row_of(compare_runs(same, same).arms[0], "coverage").scenes == 3


def test_csv_and_latex(base: Run, tmp_path: Path) -> None:
    comparison = compare_runs(base, written_run(tmp_path / "new", change=worse_axis))
    lines = list(csv.DictReader(io.StringIO(to_csv(comparison))))
    axis = next(line for line in lines if line["metric"] == "axis_deg")
    assert axis["verdict"] == "worse"
    assert float(axis["difference"]) == row_of(comparison.arms[0], "axis_deg").difference
    text = latex(comparison)
    assert text.count("\\\\") == 1 + len(comparison.arms[0].rows)
    assert "%" not in text.partition("\n")[2].replace("\\%", "")  # a bare one would hide the rest of its line


def test_only_worse_and_three_runs(base: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written_run(tmp_path / "new", change=worse_axis)
    written_run(tmp_path / "third")
    paths = [str(base.directory.path), str(tmp_path / "third"), str(tmp_path / "new")]
    assert main(["compare", *paths]) == 1
    assert main(["compare", paths[0], paths[2], "--only", "better"]) == 1
    capsys.readouterr()
    main(["compare", paths[0], paths[2], "--only", "worse"])
    table = capsys.readouterr().out
    assert "Axis angle" in table.partition("margins")[0]
    assert "Coverage" not in table
    assert table.count("axis_deg worse by") == 16


def test_every_file_holds_all_runs(base: Run, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    written_run(tmp_path / "new", change=worse_axis)
    written_run(tmp_path / "deeper" / "third")
    written_run(tmp_path / "third")
    news = ["new", "third", "deeper/third"]
    files = {name: tmp_path / f"out.{name}" for name in ("csv", "latex", "markdown", "junit", "html", "json")}
    options = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    paths = [str(base.directory.path), *(str(tmp_path / name) for name in news)]
    assert main(["compare", *paths, *options]) == 1
    written = {name: path.read_text("utf-8") for name, path in files.items()}
    arms = ["mine (new)", "mine (third 1)", "mine (third 2)"]
    lines = list(csv.DictReader(io.StringIO(written["csv"])))
    assert [line["new_arm"] for line in lines if line["metric"] == "axis_deg"] == arms
    verdicts = {line["new_arm"]: line["verdict"] for line in lines if line["metric"] == "axis_deg"}
    assert list(verdicts.values()) == ["worse", "equivalent", "equivalent"]
    assert written["latex"].count("begin{tabular}") == 3
    assert all(arm in written["markdown"] and arm in written["html"] for arm in arms)
    suites = ET.fromstring(written["junit"])  # noqa: S314 (our own text)
    assert [suite.get("failures") for suite in suites] == ["1", "0", "0"]
    names = [(case.get("classname"), case.get("name")) for suite in suites for case in suite]
    assert len(set(names)) == len(names)
    told = json.loads(written["json"])
    assert told["exit_code"] == 1
    assert [arm["run"] for arm in told["arms"]] == ["new", "third 1", "third 2"]
    capsys.readouterr()
    assert main(["compare", *paths, "--only", "worse"]) == 1
    assert capsys.readouterr().out.count("axis_deg worse by") == 16


def test_junit_says_when_where_and_how_long(base: Run) -> None:
    suites = ET.fromstring(junit(compare_runs(base, base), SITTING))  # noqa: S314 (our own text)
    (suite,) = suites
    assert (suite.get("timestamp"), suite.get("hostname")) == ("2026-11-22T01:02:03", "lab")
    assert suites.get("time") == suite.get("time") == "1.500000"
    assert sum(float(case.get("time", "nan")) for case in suite) == pytest.approx(1.5, abs=1e-3)


def test_a_metric_that_does_not_apply_breaks_and_delays_nothing(tmp_path: Path) -> None:
    """A mesh that nobody scanned has no coverage."""
    gate = [{"metric": "coverage"}]
    runs = [
        written_run(tmp_path / name, gate=gate, change=lambda _, m: {**m, "coverage": math.nan})
        for name in ("a", "b")
    ]
    comparison = compare_runs(*runs)
    assert [outcome.state for outcome in comparison.gates] == ["passed"]
    assert comparison.strict_exit_code() == 0
