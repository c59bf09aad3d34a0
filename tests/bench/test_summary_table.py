"""Score tables: failures count, groups are told apart; unrolled maps put things where they are."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bench.run.records import Failure, Record, append, read
from bench.score.metrics import failed_metrics
from bench.score.unrolled import UnrolledGrid, unrolled_grid
from bench.summary.table import score_table, summarise
from tests.bench.ideal import RADIUS_MM, truth


def record(variant: str, finish: str, *, failed: bool = False, **metrics: float) -> Record:
    return Record(
        case=f"finish={finish}",
        variant=variant,
        parameters={"finish": finish},
        scene_hash="",
        identity="",
        metrics=failed_metrics() if failed else metrics,
        failure=Failure("scan", "no light", "") if failed else None,
    )


def test_a_failure_ranks_behind_every_error_and_covers_nothing() -> None:
    sound = [record("v", "matte", coverage=0.9, axis_deg=error) for error in (0.1, 0.2, 0.3)]
    failed = [record("v", "matte", failed=True)]
    assert summarise("axis_deg", sound) == pytest.approx(0.2)
    assert summarise("axis_deg", sound + failed) == pytest.approx(0.25)
    assert summarise("coverage", sound + failed) == pytest.approx(0.675)
    assert math.isinf(summarise("depth_rms_mm", failed))


def test_a_failure_read_back_from_its_line_counts_the_same(tmp_path: Path) -> None:
    append(tmp_path / "records.jsonl", [record("v", "matte", failed=True)])
    (again,) = read(tmp_path / "records.jsonl")
    assert math.isinf(summarise("depth_rms_mm", [again]))
    assert summarise("coverage", [again]) == 0.0


def test_what_does_not_apply_is_left_out() -> None:
    both = [record("v", "matte", burr_found=math.nan), record("v", "matte", burr_found=1.0)]
    assert summarise("burr_found", both) == 1.0
    assert math.isnan(summarise("burr_found", both[:1]))


def test_rows_are_groups_times_variants_and_then_all() -> None:
    records = [
        record(variant, finish, failed=variant == "b" and finish == "turned", coverage=0.5)
        for finish in ("matte", "turned")
        for variant in ("a", "b")
    ]
    rows = score_table(records, ["coverage"], by=["finish"])
    assert [(r.group, r.variant, r.cases, r.failed) for r in rows] == [
        (("matte",), "a", 1, 0),
        (("matte",), "b", 1, 0),
        (("turned",), "a", 1, 0),
        (("turned",), "b", 1, 1),
        ((), "a", 2, 0),
        ((), "b", 2, 1),
    ]
    assert rows[-1].values["coverage"] == pytest.approx(0.25)
    assert len(score_table(records, ["coverage"], by=[])) == 2


def test_an_unrolled_map_runs_on_past_half_a_turn() -> None:
    grid = UnrolledGrid(deg=(160.0, 200.0), z_mm=(0.0, 10.0))
    angles = np.radians([161.0, 179.0, -179.0, -161.0, 150.0])
    points = np.column_stack([np.cos(angles), np.sin(angles), np.full(5, 5.25)])
    shown = grid.mean(points, np.arange(1.0, 6.0))
    rows, columns = np.nonzero(np.isfinite(shown))
    edges = 160.0 + 40.0 * rows / len(shown)
    assert np.all(np.abs(edges - [161.0, 179.0, 181.0, 199.0]) < 0.5)
    assert set(columns) == {10}
    assert shown[rows, columns].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_the_grid_holds_what_is_seen_and_lit() -> None:
    world = truth()
    grid = unrolled_grid(world)
    assert grid.z_mm == (-30.0, 30.0)
    assert pytest.approx(grid.deg[0], abs=1e-6) == 0.0
    assert grid.deg[1] == pytest.approx(180.0 * 109 / 119)
    part = world.points_part_mm[world.lit]
    assert np.nanmax(grid.mean(part, np.hypot(part[:, 0], part[:, 1]))) == pytest.approx(RADIUS_MM)
