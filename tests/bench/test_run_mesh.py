"""Suites of synthetic meshes: nothing is rendered, the whole laboratory runs all the same."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bench.cli import main
from bench.run import load_run
from bench.run.subjects import _bound
from bench.suites.catalogue import load_suite
from bench.summary.goals import goal_rows
from bench.synthetic.spec import mesh_from, mesh_hash, scanned
from burrscan.errors import InputError

SUITE = """
name = "tiny"
source = "mesh"
groups = ["sigma_mm"]
metrics = ["axis_deg", "axis_bound_deg", "axis_held", "burr_found", "burr_height_mm"]
[scene]
generatrix = [[-20, 40], [-5, 42], [-5, 50], [10, 50], [10, 44], [20, 40]]
around = 160
along = 80
[[scene.burr]]
width_deg = 4.0
z_start_mm = -4.0
z_end_mm = 9.0
[sweep]
sigma_mm = [0.02, 0.1]
"burr.height_mm" = [0.0, 2.0]
[[variant]]
name = "default"
[[variant]]
name = "blind"
axis = "orriols"
burrs = "residual"
[[goal]]
metric = "axis_deg"
where = { sigma_mm = 0.02 }
at_most = 0.05
[[goal]]
metric = "axis_deg"
where = { sigma_mm = 0.1 }
at_most = 1e-9
"""


@pytest.fixture(scope="module")
def run_dir(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("meshes")
    (folder / "tiny.toml").write_text(SUITE)
    asked = ["run", str(folder / "tiny.toml"), "--out", str(folder / "run"), "--workers", "1"]
    assert main(asked) == 0
    return folder / "run"


def test_a_mesh_has_the_metrics_of_a_part_and_none_of_a_scan(run_dir: Path) -> None:
    records = [record for record in load_run(run_dir).records if record.variant == "default"]
    assert len(records) == 4
    for record in records:
        assert record.failure is None
        assert 0.0 < record.metrics["axis_deg"] < 4.0 * record.metrics["axis_bound_deg"]
        assert math.isnan(record.metrics["coverage"])
        assert math.isnan(record.metrics["depth_rms_mm"])
    with_burr = [record for record in records if record.parameters["burr.height_mm"] == 2.0]
    assert [record.burrs[0]["height_mm"] for record in with_burr] == [2.0, 2.0]
    assert all(record.metrics["burr_found"] == 1.0 for record in with_burr)
    assert not any(record.burrs for record in records if record not in with_burr)


def test_goals_are_met_or_missed_by_what_was_measured(run_dir: Path) -> None:
    run = load_run(run_dir)
    rows = goal_rows(run.suite, run.records)
    assert [row.met for row in rows] == [True, False]
    assert [row.cases for row in rows] == [2, 2]
    own = [r.metrics["axis_deg"] for r in run.records if r.variant == "default"][:2]
    assert rows[0].measured == pytest.approx(np.median(own))


def test_a_run_can_be_compared_and_reported(run_dir: Path) -> None:
    assert main(["compare", str(run_dir), "--variants", "default", "blind"]) in {0, 1}
    assert main(["report", str(run_dir)]) == 0
    truth = np.load(run_dir / "cases" / load_run(run_dir).records[-1].case / "truth.npz")
    assert np.nanmax(truth["unrolled_mm"].astype(float)) == pytest.approx(2.0, abs=0.6)


def test_the_noise_is_as_strong_as_it_says_and_correlated_on_demand() -> None:
    """Deviation along the normal of a cylinder; the lag-one correlation of a mean over three is 2/3."""
    for width, lag_one in ((1, 0.0), (3, 2.0 / 3.0)):
        table = {"shape": "cylinder", "sigma_mm": 0.5, "correlated_over": width}
        spec = mesh_from(table, source="test")
        scan = scanned(spec, identity=(1, 2))
        back = np.linalg.inv(scan.T_mesh_part)
        part = scan.vertices_mm @ back[:3, :3].T + back[:3, 3]
        noise = (np.hypot(part[:, 0], part[:, 1]) - 90.0).reshape(spec.around, spec.along)
        assert noise.std() == pytest.approx(0.5, rel=0.02 * width)
        assert np.mean(noise[1:] * noise[:-1]) / noise.var() == pytest.approx(lag_one, abs=0.02 * width)


def test_the_hash_knows_the_mesh_and_errors_are_listed_at_once() -> None:
    assert mesh_hash({"sigma_mm": 0.1}) == mesh_hash({"sigma_mm": 0.1, "shape": "stepped_wheel"})
    assert mesh_hash({"sigma_mm": 0.1}) != mesh_hash({"sigma_mm": 0.2})
    with pytest.raises(InputError, match=r"(?s)arc_deg.*sigma.*did you mean 'sigma_mm'"):
        mesh_from({"arc_deg": -3, "sigma": 1}, source="test")
    with pytest.raises(InputError, match="did you mean 'torus'"):
        mesh_from({"shape": "toros"}, source="test")


def test_a_grid_may_stand_at_any_angle() -> None:
    """As many triangles, the same surface; rows no longer run along the axis."""
    for arc_deg in (60.0, 140.0):
        spec = mesh_from({"arc_deg": arc_deg, "sigma_mm": 0.0, "grid_deg": 30.0, "burr": []}, source="test")
        scan = scanned(spec, identity=(1, 2))
        assert len(scan.faces) == pytest.approx(122_682, rel=0.02)
        part = (scan.vertices_mm - scan.point_mm) @ scan.T_mesh_part[:3, :3]
        z, r = part[:, 2], np.hypot(part[:, 0], part[:, 1])
        assert np.abs(r - np.interp(z, [-30, -12, -12, 8, 8, 30], [80, 82, 90, 92, 100, 100])).max() < 10.0
        assert np.ptp(np.degrees(np.arctan2(part[:, 1], part[:, 0]))) == pytest.approx(arc_deg, abs=0.5)
        step = part[1] - part[0]
        assert 0.2 < abs(step[2]) / np.linalg.norm(step) < 0.98
    with pytest.raises(InputError, match="grid_deg"):
        mesh_from({"grid_deg": 10.0, "scale": 2.0}, source="test")


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ('[[goal]]\nmetric = "axis_dge"\nat_most = 1', "axis_deg"),
        ('[[goal]]\nmetric = "axis_deg"', "neither at_least nor at_most"),
        ('[[goal]]\nmetric = "axis_deg"\nat_most = 1\nvariant = "defalt"', "did you mean 'default'"),
        ('[[goal]]\nmetric = "axis_deg"\nat_most = 1\nwhere = { sigma = 1 }', "did you mean 'sigma_mm'"),
    ],
)
def test_a_goal_that_means_nothing_is_refused(tmp_path: Path, line: str, why: str) -> None:
    (tmp_path / "s.toml").write_text(f"{SUITE}\n{line}\n")
    with pytest.raises(InputError, match=why):
        load_suite(tmp_path / "s.toml")


def test_an_axis_has_a_bound_where_noise_is_independent_and_there_is_some() -> None:
    profile = {"generatrix": [[-20, 40], [-5, 42], [-5, 50], [20, 50]], "around": 160, "along": 80}

    def bound(**keys: float) -> float:
        found = _bound(mesh_from(profile | keys, source="test"))
        return math.nan if found is None else float(np.sqrt(found[0, 0]))

    assert bound(sigma_mm=0.1) > 0.0
    assert bound(sigma_mm=0.2) == pytest.approx(2.0 * bound(sigma_mm=0.1))
    assert bound(sigma_mm=0.1, correlated_over=1) == bound(sigma_mm=0.1)
    assert math.isnan(bound(sigma_mm=0.0))
    assert math.isnan(bound(sigma_mm=0.1, correlated_over=2))
