"""Building the page: one self-contained HTML file, of one run or of a comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup

from bench.compare import Comparison, compare_runs, joined
from bench.compare.margins import FAILURES, gates_of, margin_of
from bench.compare.result import ArmComparison, by_case
from bench.compare.text import SIGNS, aside, here, notes
from bench.detection import Detection
from bench.plotting import pictures
from bench.plotting.page import write_page
from bench.report import summary
from bench.report.cases import view
from bench.report.cell import cell_part
from bench.report.figures import PIXEL_COLOURS, scales
from bench.report.forest import forest, headed, interval, points, shown
from bench.report.goals import goals, measured, wanted, where
from bench.report.headline import changes, ranking, winner
from bench.report.heat import heat_views
from bench.report.lists import failures, index
from bench.report.pod import pod_chart, pod_charts, pod_groups
from bench.report.sides import Panel, paired_panels, sides_of
from bench.report.stages import STAGES, stage_budget, stage_cost
from bench.report.strips import strips
from bench.report.worst import Chosen, worst_changed, worst_of
from bench.run import Run, load_run
from bench.score.metric import shown_unit
from bench.score.metrics import metric_named
from burrscan.errors import InputError

MOST_PICTURED = 6
"""Cases shown with pictures; all of them stand in the table."""


def build_report(run_dir: Path) -> Path:
    """Write ``report.html`` into a run directory, finished or not.

    The page loads nothing from anywhere: styles, pictures and the 3D view are inside. Several variants are
    compared, each with the first one.

    Parameters
    ----------
    run_dir
        As :func:`bench.run.load_run` reads it.

    Returns
    -------
    pathlib.Path
        The page.

    Raises
    ------
    burrscan.errors.InputError
        When there is no run.

    """
    run = load_run(run_dir)
    return _write(run_dir / "report.html", _run_content(run))


def build_comparison(base: Run, compared: Sequence[tuple[Run, Comparison]], page: Path) -> Path:
    """Write the report of one run or more, each with what :func:`bench.compare.compare_runs` says of it.

    Runs without pictures, such as an accepted baseline, have everything but pictures.
    """
    return _write(page, _comparison_content(base, compared))


def build_detection(found: Sequence[Detection], page: Path, *, title: str = "Detection") -> Path:
    """Write a page of detection curves, the same size on all of them: in a report there are more of its run.

    Raises
    ------
    burrscan.errors.InputError
        When no burr has a size.

    """
    chart = pod_chart([(f"v{k % 9}", one.name, one) for k, one in enumerate(found)], title)
    if chart is None:
        raise InputError("no burr in these cases: there is nothing to detect")
    return write_page(page, "detection.html.jinja", {"chart": chart}, package="bench.report")


def _write(page: Path, content: Mapping[str, Any]) -> Path:
    return write_page(page, "report.html.jinja", content, package="bench.report")


def _run_content(run: Run) -> dict[str, Any]:
    panel = Panel("", sides_of(run), _arms(run))
    gates = gates_of(run.suite, {})
    margins = {name: margin_of(name, own=gate.margin) for name, gate in gates.items() if name != FAILURES}
    return {
        "kicker": "run",
        "title": run.suite.title or run.suite.name,
        "description": run.suite.description,
        "sentences": _sentences(run, panel),
        "state": "plain",
        "differs": {},
        **_content(run, [("", run)], (panel,), worst_of(panel, margins, MOST_PICTURED)),
    }


def _sentences(run: Run, panel: Panel) -> tuple[str, ...]:
    if not run.records:
        return ()
    if len(panel.arms) > 1:
        return winner(panel.arms), ranking(panel.arms)
    if panel.arms:
        pair_of_names = [side.variant for side in panel.sides]
        return winner(panel.arms), summary.verdict(run.records, pair_of_names)
    return (summary.verdict(run.records, [side.variant for side in panel.sides]),)


def _comparison_content(base: Run, compared: Sequence[tuple[Run, Comparison]]) -> dict[str, Any]:
    whole = joined([comparison for _, comparison in compared])
    owners = [new for new, comparison in compared for _ in comparison.arms]
    panels = paired_panels(base, owners, whole.arms)
    last, same = compared[-1][0], all(new.directory.path == base.directory.path for new, _ in compared)
    labels = list(dict.fromkeys(arm.run or "new" for arm in whole.arms))
    runs = [("base", base), *zip(labels, (new for new, _ in compared), strict=True)]
    return {
        "kicker": "comparison",
        "title": f"{whole.base} → {whole.new}",
        "description": last.suite.title,
        "sentences": tuple(sentence for _, one in compared for sentence in _of_comparison(one)),
        "state": {0: "good", 1: "bad", 2: "odd"}[whole.exit_code],
        "differs": whole.provenance,
        **_content(
            last,
            [("", last)] if same else runs,
            panels,
            worst_changed(panels, MOST_PICTURED),
        ),
    }


def _of_comparison(one: Comparison) -> tuple[str, ...]:
    """Who wins, and the verdict."""
    won = [winner(one.arms, base=one.base, new=one.new)] if one.arms else []
    return (*won, one.sentence())


def _arms(run: Run) -> tuple[ArmComparison, ...]:
    """Every further variant against the first, as far as the run has got."""
    first, *others = [variant.name for variant in run.suite.variant]
    try:
        return tuple(compare_runs(run, run, variants=(first, other)).arms[0] for other in others)
    except InputError:  # no case in common yet
        return ()


def _content(
    run: Run, runs: Sequence[tuple[str, Run]], panels: tuple[Panel, ...], chosen: Sequence[Chosen]
) -> dict[str, Any]:
    """What both kinds of page show."""
    names = summary.metric_names(run)
    anchors = {(id(item.panel), item.case): f"case-{number}" for number, item in enumerate(chosen, 1)}
    limits = scales([(side, item.case) for item in chosen for side in item.sides])
    return {
        "run": run,
        "runs": runs,
        "goals": goals(runs),
        "cell": cell_part(run),
        "changes": changes(
            [arm for panel in panels for arm in panel.arms] if len(panels[0].arms) < 2 else []
        ),
        "panels": [_panel(panel, names, anchors) for panel in panels],
        "paired": panels[0].paired,
        "cases": [view(item, anchors[id(item.panel), item.case], names, limits) for item in chosen],
        "failures": (missing := failures(panels)),
        "failed": sum(len(item["cases"]) for item in missing),
        "missing": [(label, one.missing, len(one.records)) for label, one in runs if one.missing],
        "by_case": by_case,
        "metrics": [metric_named(name) for name in names],
        "metric_named": metric_named,
        "headed": headed,
        "wanted": wanted,
        "measured": measured,
        "where": where,
        "stage_names": STAGES,
        "stage_cost": stage_cost,
        "shown": shown,
        "shown_unit": shown_unit,
        "points": points,
        "interval": interval,
        "here": here,
        "aside": aside,
        "notes": notes,
        "signs": SIGNS,
        "limits": limits,
        "gradient": Markup(pictures.gradient()),  # noqa: S704 (our own constant)
        "pixel_colours": PIXEL_COLOURS,
    }


def _panel(panel: Panel, names: Sequence[str], anchors: Mapping[tuple[int, str], str]) -> dict[str, Any]:
    parts = [list(side.records.values()) for side in panel.sides]
    return {
        "title": panel.title,
        "sides": panel.sides,
        "forests": [forest(arm) for arm in panel.arms],
        "arms": panel.arms,
        "score": summary.score_rows(parts, names),
        "strips": strips(panel.sides[0], names) if len(panel.sides) == 1 else None,
        "matrix": summary.matrix(panel, names),
        "pod": pod_charts(panel),
        "pod_groups": pod_groups(panel),
        "heat": heat_views(panel, names),
        "budget": stage_budget(panel),
        "times": summary.time_rows(parts),
        "index": index(panel, anchors),
    }
