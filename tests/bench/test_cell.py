"""Cases of a cell: their tables, their metrics on a story made by hand, and a tiny one from end to end."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import cv2
import numpy as np
import pytest

from bench.cell.files import write_story
from bench.cell.spec import cell_from, cell_hash
from bench.cell.story import keep, told
from bench.report.cell import cell_part
from bench.run import Run
from bench.score.cell import CellEvidence, LookScore, RemovalScore
from bench.score.metrics import measure
from bench.suites.cases import expand
from bench.suites.catalogue import load_suite
from burrscan.errors import InputError
from burrscan.inspection import Axis, Generatrix, Inspection
from burrscan.pipeline import Pipeline

_TINY: dict[str, Any] = {
    "wheel": "cylinder",
    "finish": "matte",
    "rig": {"scale": 0.15},
    "render": {"error": 1.0},
    "burr": [
        {
            "kind": "axial_ridge", "angle_deg": 180.0, "height_mm": 2.0, "width_mm": 4.0, "z_start_mm": -10.0,
            "z_end_mm": 10.0,
        }
    ],
    "task": {"looks": 2, "planner": "ring"},
    "cell": {"turned_deg": 0.0},  # the burr faces the first look
}  # fmt: skip


def _look(
    found: float, *, single_deg: float = 0.02, joined_deg: float = 0.01, left: float = 0.1
) -> LookScore:
    return LookScore(
        0.0, 32.0, 90.0, coverage=0.5, left=left, found=found, false_calls=0.0, axis_deg=1.0,
        single_deg=single_deg, joined_deg=joined_deg,
    )  # fmt: skip


def _evidence(looks: tuple[LookScore, ...], removals: tuple[RemovalScore, ...] = ()) -> CellEvidence:
    nothing = np.zeros(2)
    curve = Generatrix(np.array([0.0, 1.0]), np.ones(2), nothing, nothing)
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(4), "given")
    truth = SimpleNamespace(
        T_part_mesh=np.eye(4), generatrix_zr_mm=np.array([[0.0, 1.0], [1.0, 1.0]]), burrs=(), axis_bound=None
    )
    return CellEvidence(
        cast(Any, truth), Inspection(axis, curve, (), np.eye(4), np.zeros(0)), looks, removals, most=4
    )


def test_wrong_tables_are_refused() -> None:
    for table, said in (
        ({"task": {"planner": "rign"}}, "did you mean 'ring'"),
        ({"task": {"looks": 0}}, "looks"),
        ({"cell": {"arm": {"reach": 3.0}}}, "reach"),
        ({"cell": {"mill": {"radius_mm": -1.0}}}, "radius_mm"),
    ):
        with pytest.raises(InputError, match=said):
            cell_from({**_TINY, **table}, source="test")


def test_what_is_asked_is_part_of_a_case() -> None:
    other = {**_TINY, "task": {**_TINY["task"], "planner": "random"}}
    stiffer = {**_TINY, "cell": {**_TINY["cell"], "mill": {"stiffness_n_mm": 900.0}}}
    assert len({cell_hash(_TINY), cell_hash(other), cell_hash(stiffer)}) == 3
    assert cell_hash(dict(_TINY)) == cell_hash(_TINY)


def test_the_area_under_the_curve_of_looks() -> None:
    made = measure(_evidence((_look(0.25), _look(0.75))))
    assert made["looks"] == 2.0
    assert made["found_by_look"] == pytest.approx((0.25 + 0.75 + 0.75 + 0.75) / 4)
    assert made["burr_left"] == pytest.approx(0.1)
    assert math.isnan(made["coverage"])  # that of a scan is none of a cell


def test_the_axis_is_compared_with_the_best_single_look_in_its_own_frame() -> None:
    looks = (
        _look(0.5, single_deg=0.04, joined_deg=0.08),
        _look(0.5, single_deg=0.02, joined_deg=0.005),
        _look(0.5, single_deg=90.0, joined_deg=math.nan),  # shows no surface of revolution
    )
    assert measure(_evidence(looks))["axis_gain"] == pytest.approx(0.25)


def test_removals_count_for_true_burrs_and_gouges_for_all() -> None:
    good = RemovalScore(0, 2, True, "", 0.03, 1.0, 0.02, 0.01, 0.03, 0.0)
    lost = RemovalScore(1, 4, False, "4 looks leave 0.2 mm", 0.2)
    false = RemovalScore(-1, 1, True, "", math.nan, 1.0, math.nan, 0.3, 0.0, 0.0)
    made = measure(_evidence((_look(1.0),), (good, lost, false)))
    assert made["servo_converged"] == 0.5
    assert made["servo_looks"] == 4.0
    assert made["servo_mm"] == pytest.approx(0.03)  # what did not say that it is there claims nothing
    assert made["residual_mm"] == pytest.approx(0.02)
    assert made["gouge_mm"] == pytest.approx(0.3)  # metal cut where no burr was
    assert made["verified_mm"] == pytest.approx(0.01)


def test_the_suite_compares_planners_on_the_same_wheels() -> None:
    suite = load_suite("cell")
    cases = expand(suite)
    planners = {case.document["task"]["planner"] for case in cases}
    assert {"expected", "ring", "random"} <= planners
    wheels: dict[str, set[tuple[str, str]]] = {planner: set() for planner in planners}
    for case in cases:
        document = case.document
        wheels[document["task"]["planner"]].add((str(document["wheel"]), str(document["finish"])))
    assert len({frozenset(kinds) for kinds in wheels.values()}) == 1
    identities: dict[tuple[str, str], set[str]] = {}
    for case in cases:
        cell_from(case.document, source=case.id)
        kind = str(case.document["wheel"]), str(case.document["finish"])
        identities.setdefault(kind, set()).add(case.identity)
    # of one part each, put down the same way, with the same errors of the arm
    assert all(len(some) == 1 for some in identities.values())
    assert len(set.union(*identities.values())) == len(identities)


def test_a_tiny_cell_from_end_to_end(tmp_path: Path) -> None:
    case = cell_from(_TINY, source="test")
    lines: list[str] = []
    story = told(case, Pipeline(), identity=(1,), said=lines.append)
    evidence = story.evidence
    assert len(evidence.looks) == len(lines) == 2
    # the world's frame is settled by the first look: in it the joint axis is off by what it is there
    assert evidence.looks[0].joined_deg == pytest.approx(evidence.looks[1].axis_deg, rel=1e-6)
    assert evidence.looks[1].joined_deg < 0.5
    made = measure(evidence)
    assert made["axis_deg"] < 0.5
    assert made["burr_found"] == 1.0
    # a second look at the back of the drum shows more of it, and leaves less to be found
    assert evidence.looks[1].coverage > evidence.looks[0].coverage + 0.2
    assert evidence.looks[1].left < evidence.looks[0].left
    again = told(case, Pipeline(), identity=(1,))
    assert measure(again.evidence) == pytest.approx(made, nan_ok=True)
    other = told(replace(case, task=replace(case.task, looks=1)), Pipeline(), identity=(2,))
    assert measure(other.evidence)["axis_deg"] != made["axis_deg"]
    write_story(story, tmp_path)
    told_ = json.loads((tmp_path / "cell.json").read_text("utf-8"))
    assert [look["turn_deg"] for look in told_["looks"]] == [0.0, 180.0]
    burrs = json.loads((tmp_path / "burrs.json").read_text("utf-8"))["burrs"]
    assert [b["height_mm"]["value"] for b in burrs] == [b.height_mm.value for b in evidence.inspection.burrs]
    paths = json.loads((tmp_path / "paths.json").read_text("utf-8"))["paths"]
    with (tmp_path / "paths.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(paths) == len({row["burr"] for row in rows}) == len(story.paths) == 1
    assert len(rows) == len(paths[0]["stations"]) * len(paths[0]["passes_mm"]) + 2
    first = np.array(paths[0]["stations"][0])
    cut = next(row for row in rows if row["kind"] == "cut")
    height = paths[0]["passes_mm"][0]
    wanted = first[:3, 3] + height * first[:3, 2]
    assert np.allclose([float(cut[key]) for key in ("x_mm", "y_mm", "z_mm")], wanted, atol=1e-3)


def test_the_report_draws_what_was_kept(tmp_path: Path) -> None:
    looks = [
        {"turn_deg": 0.0, "elevation_deg": 32.0, "roll_deg": 90.0, "found": 0.5, "coverage": 0.4},
        {"turn_deg": 180.0, "elevation_deg": 10.0, "roll_deg": 0.0, "found": 1.0, "coverage": 0.9},
    ]
    removal = {"looks": 2, "off_mm": 0.02, "residual_mm": 0.03, "said_residual_mm": 0.04, "gouge_mm": None}
    story = {
        "planner": "expected", "most": 8, "looks": looks, "removals": [removal],
        "chart": {"left": np.linspace(0.0, 1.0, 120)[None].tolist()},
    }  # fmt: skip
    (tmp_path / "adaptive.cell.json").write_text(json.dumps(story), "utf-8")
    for when in ("before", "after"):
        cv2.imwrite(str(tmp_path / f"adaptive.burr-1-{when}.png"), np.full((8, 8), 90, np.uint8))
    record = SimpleNamespace(case="a", variant="adaptive", parameters={})
    gone = SimpleNamespace(case="b", variant="other", parameters={})
    run = SimpleNamespace(records=[record, gone], directory=SimpleNamespace(case=lambda _: tmp_path))
    part = cell_part(cast(Run, run))
    assert part is not None
    assert len(part.paths) == 1
    assert "1′" in part.paths[0][1]  # the first look was made with the camera on its side
    assert ">2<" in part.paths[0][1]
    (burr,) = part.removed
    assert burr.before.startswith("data:image")
    assert "0.030 mm" in burr.words
    assert "gouge –" in burr.words
    assert cell_part(cast(Run, SimpleNamespace(records=[gone], directory=run.directory))) is None


def test_kept_files_stand_beside_each_other(tmp_path: Path) -> None:
    story = SimpleNamespace(path={"looks": []}, pictures={"burr-1-before": np.zeros((4, 4), np.uint8)})
    keep(cast(Any, story), tmp_path, "adaptive")
    keep(cast(Any, story), tmp_path)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"adaptive.cell.json", "adaptive.burr-1-before.png", "cell.json", "burr-1-before.png"}
