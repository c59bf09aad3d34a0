"""The parts of a report say what the records and the comparison say: goals, tables, maps, worst cases."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.compare import ArmComparison, GateOutcome, Verdict, compare_runs
from bench.compare.text import aside
from bench.detection.hit_miss import fit_hit_miss
from bench.report import build_report
from bench.report.forest import WIDTH, forest
from bench.report.goals import goals, measured, wanted, where
from bench.report.headline import changes, ranking, winner
from bench.report.heat import heat_views
from bench.report.pod import pod_groups, told_sizes
from bench.report.sides import Panel, paired_panels, sides_of
from bench.report.strips import strips
from bench.report.summary import matrix, score_row, time_rows, verdict
from bench.report.worst import worst_of
from bench.run import Record, load_run
from tests.bench.report_run import made_up_run


@pytest.fixture(scope="module")
def three(tmp_path_factory: pytest.TempPathFactory) -> Panel:
    """Three variants, the first the base of two comparisons."""
    run = load_run(made_up_run(tmp_path_factory.mktemp("many") / "run", many=True, fail=True))
    pairs = [("fixed", other) for other in ("adaptive", "again")]
    return Panel("", sides_of(run), tuple(compare_runs(run, run, variants=pair).arms[0] for pair in pairs))


def test_goals_are_met_and_missed_by_the_records(three: Panel) -> None:
    """Adaptive covers 0.93 on the average; fixed 0.40 where polished, once failed; again is within bounds."""
    found = goals([("", three.sides[0].run)])
    assert found is not None
    assert [row.met for row in found.last] == [True, False, True]
    assert [wanted(row) for row in found.last] == ["≥ 90.00", "≥ 90.00", "0.0010 to 0.5000"]
    assert [where(row) for row in found.last] == ["all", "finish polished", "all"]
    assert [row.cases for row in found.last] == [6, 2, 6]
    assert measured(found.last[0]) == "93.33"  # (93 + 92 + 91 + 90 + 97.5 + 96.5) / 6
    assert measured(found.last[1]) == "20.00"  # nothing, and 0.40
    assert found.missed == "coverage"
    assert not any(row.open for row in found.last)


def test_goals_that_no_case_is_about_are_open(tmp_path: Path) -> None:
    run = load_run(made_up_run(tmp_path / "run", many=True, pictures=False, stop_after=0))
    found = goals([("", run)])
    assert found is not None
    assert [(row.met, row.open) for row in found.last] == [(False, True)] * 3
    assert found.missed == ""


def test_many_variants_are_one_table_with_the_verdicts_of_the_comparison(three: Panel) -> None:
    table = matrix(three, ["coverage", "frames"])
    assert [(side.label, side.failed) for side in three.sides] == [
        ("fixed", 1),
        ("adaptive", 0),
        ("again", 0),
    ]
    verdicts = {arm.new: {row.metric: row.verdict for row in arm.rows} for arm in three.arms}
    for metric, row in zip(("coverage", "frames"), table, strict=True):
        for side, cell in zip(three.sides[1:], row.cells[1:], strict=True):
            verdict = verdicts[side.label][metric]
            assert cell.verdict == (verdict if verdict in {"better", "worse"} else "")
    assert [cell.best for cell in table[0].cells] == [False, True, False]
    assert table[0].cells[0].verdict == ""


def test_the_ranking_counts_the_gated_verdicts(three: Panel) -> None:
    sentence = ranking(three.arms)
    gated = [row for row in three.arms[0].rows if row.gated]
    better = sum(row.verdict == "better" for row in gated)
    assert better
    assert f"Against fixed, in {len(gated)} gated metrics: adaptive better in {better}" in sentence
    told = changes(three.arms[:1])
    assert {change.verdict for change in told} <= {"better", "worse"}
    assert sum(change.verdict == "better" for change in told) == better
    assert [change.verdict for change in told] == sorted((c.verdict for c in told), reverse=True)


def test_a_bad_case_is_pictured_beside_the_first_variant_or_the_best(three: Panel) -> None:
    chosen = worst_of(three, {"coverage": 0.01, "false_calls": 0.5}, 4)
    assert len({item.kind for item in chosen}) == len(chosen)  # each bad in its own way
    assert all(len(item.sides) == 2 for item in chosen)
    failed = next(item for item in chosen if item.kind == ("fixed", ""))
    assert [side.label for side in failed.sides] == ["fixed", "adaptive"]
    others = [item for item in chosen if item.kind[0] != "fixed"]
    assert all(item.sides[0].label == "fixed" for item in others)


def test_every_choice_of_parameters_and_variant_has_its_heat_map(three: Panel) -> None:
    heat = heat_views(three, ["coverage"])
    assert (heat.parameters, heat.sides) == (("finish",), ("fixed", "adaptive", "again"))
    cells = [[row[1][0].text for row in view.tables[0].rows] for view in heat.views]
    assert cells == [["20.0", "54.5", "96.5"], ["92.5", "90.5", "97.0"], ["39.5", "53.5", "95.5"]]


def test_no_size_is_stated_beyond_those_that_were_tried() -> None:
    """Of burrs of 1 to 2 mm that are found ever more often, but 0.9 of them only beyond 2 mm."""
    sizes = np.repeat([1.0, 1.25, 1.5, 1.75, 2.0], 20)
    hits = np.tile(np.arange(20), 5) < np.repeat([8, 10, 11, 13, 14], 20)
    fit = fit_hit_miss(sizes, hits)
    low, high = float(fit.size[0]), float(fit.size[-1])
    assert low <= 1.0 < fit.a50 < 2.0 <= high < fit.a90
    assert told_sizes(fit) == (f"{fit.a50:.3g}", f"> {high:.2g}", f"> {high:.2g}")
    assert told_sizes(replace(fit, a50=0.3))[0] == f"< {low:.2g}"
    assert told_sizes(replace(fit, a90=float("nan")))[1] == "–"


def test_every_case_of_a_single_variant_is_a_dot_about_the_median(three: Panel) -> None:
    """Adaptive covers 90 to 97.5 %, 92.5 % in the median case: dots below lie left of the middle."""
    (row,) = strips(three.sides[1], ["coverage"]).rows
    x = [float(place) for place in re.findall(r'<circle class="one" cx="([0-9.]+)"', row.plot)]
    shares = [93.0, 92.0, 91.0, 90.0, 97.5, 96.5]  # in the order of the suite
    assert np.argsort(x).tolist() == np.argsort(shares).tolist()
    assert [place > WIDTH / 2 for place in x] == [share > 92.5 for share in shares]
    assert (row.value, row.worst) == ("93.33", "90.00")
    assert row.half.startswith("91.25 to 95.6")
    (failed,) = strips(three.sides[0], ["coverage"]).rows
    assert failed.plot.count('class="one"') == 5
    assert failed.worst == "failed"


def test_a_verdict_of_every_case_does_not_claim_its_interval(three: Panel) -> None:
    """With too few scenes for a test all cases may decide, though the interval holds zero."""
    arm = three.arms[0]
    (row,) = (row for row in arm.rows if row.metric == "coverage")
    assert row.low < 0.0 < row.high
    decided = replace(row, verdict="inconclusive", every="better")
    tested = replace(row, verdict="better", seen="better", low=0.1, high=0.6, level=0.995)
    (told,), (shown,) = (changes([replace(arm, rows=(one,))]) for one in (decided, tested))
    assert told.sure == f"in all {row.pairs} cases"
    assert shown.sure == "99.5 %: +10.00 to +60.00"
    assert aside(decided) == "better in every case"
    assert [row for row, _ in forest(replace(arm, rows=(decided,))).rows] == [decided]


def _with_verdicts(arm: ArmComparison, *verdicts: Verdict) -> ArmComparison:
    gated = [row for row in arm.rows if row.gated][: len(verdicts)]
    rows = tuple(replace(r, verdict=v, every="") for r, v in zip(gated, verdicts, strict=True))
    return replace(arm, rows=rows, gates=())


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        (("better", "equivalent"), "adaptive wins against fixed: better in 1 gated metric, worse in none."),
        (("worse", "worse"), "fixed wins against adaptive, which is worse in 2 gated metrics."),
        (
            ("better", "worse"),
            "Neither wins outright: adaptive is better in 1 gated metric, worse in 1 than fixed.",
        ),
        (("equivalent", "inconclusive"), "Neither wins: adaptive and fixed differ in no gated metric"),
    ],
)
def test_the_first_sentence_says_who_wins(three: Panel, verdicts: tuple[Verdict, ...], words: str) -> None:
    assert winner([_with_verdicts(three.arms[0], *verdicts)]).startswith(words)


def test_of_two_runs_of_many_variants_the_sum_decides_and_a_fact_counts(three: Panel) -> None:
    arms = [replace(_with_verdicts(arm, "better"), base=f"{arm.new} (baseline)") for arm in three.arms]
    words = winner(arms, base="before", new="after")
    assert words == "after wins against before: better in 2 gated metrics, worse in none."
    lost = GateOutcome("burr_found", "Burrs found", "lost", "broken", "1 burr(s) lost, 0 allowed")
    found = next(row for row in arms[0].rows if row.gated)
    one = replace(
        arms[0], rows=(found, replace(found, metric="burr_found", verdict="inconclusive")), gates=(lost,)
    )
    assert winner([one]).startswith("Neither wins outright")


def test_of_many_variants_the_best_is_named(three: Panel) -> None:
    good, bad = _with_verdicts(three.arms[0], "better"), _with_verdicts(three.arms[1], "worse")
    assert winner([good, bad]).startswith("adaptive does best against fixed")
    assert winner([bad, bad]).startswith("fixed wins: no other")


def test_a_variant_keeps_its_colour(three: Panel) -> None:
    """In the run's page, in that of two of its variants, and in that of two runs."""
    run = three.sides[0].run
    colours = {side.variant: side.css for side in sides_of(run)}
    (panel,) = paired_panels(run, [run], compare_runs(run, run, variants=("again", "adaptive")).arms)
    assert [side.css for side in panel.sides] == [colours["again"], colours["adaptive"]]
    panels = paired_panels(run, [run] * 3, compare_runs(run, run).arms)
    assert [panel.sides[1].css for panel in panels] == list(colours.values())
    assert {panel.sides[0].css for panel in panels} == {"before"}


def test_bold_needs_enough_cases_on_each_side(three: Panel) -> None:
    parts = [list(side.records.values()) for side in three.sides[:2]]
    assert any(cell.best for cell in score_row(parts, "coverage").cells)
    assert not any(cell.best for cell in score_row([part[:5] for part in parts], "coverage").cells)
    without = [replace(r, metrics={**r.metrics, "axis_deg": math.nan}) for r in parts[1][:4]]
    assert not any(cell.best for cell in score_row([parts[0], [*without, *parts[1][4:]]], "axis_deg").cells)


def test_no_sentence_about_none_of_many_or_an_axis_across(three: Panel) -> None:
    records = [replace(r, burrs=tuple({**b, "found": False} for b in r.burrs)) for r in three.records]
    assert "finds none of" in verdict(records, ["fixed", "adaptive"])
    assert not re.search(r"\b0 of", verdict(records, ["fixed", "adaptive"]))
    assert "ahead in 0" not in verdict(records, ["adaptive", "adaptive"])
    meshes = [
        replace(r, failure=None, metrics={**r.metrics, "coverage": math.nan, "axis_deg": 90.0})
        for r in records
    ]
    assert "does not find the axis" in verdict(meshes, ["adaptive"])
    assert "90" not in verdict(meshes, ["fixed", "adaptive"])


def test_rendering_and_algorithm_are_summed_apart() -> None:
    record = Record(
        "c", "v", {}, "", "", {}, timings_s={"wheel": 1.0, "transport": 2.0, "scan": 4.0, "axis": 8.0}
    )
    rows = {row.title: row.cells[0].value for row in time_rows([[record]])}
    sums = [rows["rendering, together"], rows["algorithm, together"], rows["all stages"]]
    assert sums == [3.0, 12.0, 15.0]


def test_detection_is_told_by_finish_and_by_the_burrs_section(three: Panel, tmp_path: Path) -> None:
    """Seed 0 has flakes, seed 1 rolled burrs: each chart counts its own burrs, found or missed."""
    run = three.sides[0].run
    sections = {0: "flake", 1: "rolled"}
    records = tuple(
        replace(
            r, burrs=tuple({**burr, "section": sections[int(str(r.parameters["seed"]))]} for burr in r.burrs)
        )
        for r in run.records
    )
    sides = sides_of(replace(run, records=records))
    groups = pod_groups(Panel("", sides, ()))
    assert list(groups) == ["By finish", "By the burr's section"]
    assert [chart.title for chart in groups["By finish"]] == ["polished", "turned", "matte"]
    found = {chart.title: [row.found for row in chart.rows] for chart in groups["By the burr's section"]}
    adaptive = [r for r in records if r.variant == "adaptive"]
    for name, rows in found.items():
        burrs = [burr for r in adaptive for burr in r.burrs if burr["section"] == name]
        assert rows[1] == f"{sum(bool(burr['found']) for burr in burrs)}/{len(burrs)}"
    assert set(found) == {"flake", "rolled"}
    assert list(pod_groups(three)) == ["By finish"]
    page = build_report(made_up_run(tmp_path / "run"))
    assert "By finish: polished, turned, matte" in page.read_text("utf-8")


def test_where_d_prime_is_known_detection_is_drawn_over_it(three: Panel) -> None:
    run = three.sides[0].run
    strong = tuple(
        replace(r, burrs=tuple({**burr, "dprime": 5.0 if burr["found"] else 50.0} for burr in r.burrs))
        for r in run.records
    )
    groups = pod_groups(Panel("", sides_of(replace(run, records=strong)), ()))
    (chart,) = groups["By detectability"]
    assert chart.unit == "d'"
    assert "dprime" in chart.picture
