"""Suites: what they expand to, and that every error is listed at once."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest

from bench.score.matching import WITHIN_DEG
from bench.suites.cases import expand, label
from bench.suites.catalogue import load_suite, suite_names
from bench.suites.suite import Suite, suite_from
from burrscan.errors import InputError

RIDGE = {"kind": "axial_ridge", "angle_deg": 0, "height_mm": 1, "width_mm": 2, "z_start_mm": 0, "z_end_mm": 9}


def suite(**changes: Any) -> Suite:
    document = {
        "name": "s",
        "scene": {"wheel": "paper", "finish": "matte", "burr": [RIDGE]},
        "variant": [{"name": "v"}],
    }
    return suite_from({**document, **changes}, source="test")


@pytest.mark.parametrize("name", suite_names())
def test_every_shipped_suite_loads(name: str) -> None:
    loaded = load_suite(name)
    assert loaded.name == name
    assert loaded.title
    assert expand(loaded)


def test_the_quick_suite_is_what_the_brief_asks_for() -> None:
    quick = load_suite("quick")
    cases = expand(quick)
    assert len({case.parameters["finish"] for case in cases}) == 4
    assert len({case.scene_hash for case in cases}) == len(cases) == 28
    assert {variant.name for variant in quick.variant} == {"fixed", "adaptive"}
    assert next(gate.lost for gate in quick.gate if gate.metric == "burr_found") == 0
    burrs = cases[0].document["burr"]
    heights = {burr["height_mm"] for burr in burrs if burr["kind"] == "axial_ridge"}
    assert len(burrs) == 15
    assert len(heights) == 11
    assert [burr["kind"] for burr in burrs].count("nick") == 2  # else "always a protrusion" passes
    for one, other in itertools.combinations(burrs, 2):
        apart_mm = max(one["z_start_mm"], other["z_start_mm"]) - min(one["z_end_mm"], other["z_end_mm"])
        assert abs(one["angle_deg"] - other["angle_deg"]) > 4 * WITHIN_DEG or apart_mm > 0.0


def test_the_grid_runs_its_last_path_fastest_then_the_seeds() -> None:
    cases = expand(suite(sweep={"finish": ["matte", "turned"], "burr.height_mm": [1.0, 2]}, seeds=[0, 7]))
    assert [case.id for case in cases[:4]] == [
        "finish=matte,burr.height_mm=1,seed=0",
        "finish=matte,burr.height_mm=1,seed=7",
        "finish=matte,burr.height_mm=2,seed=0",
        "finish=matte,burr.height_mm=2,seed=7",
    ]
    assert len({case.id for case in cases}) == len({case.identity for case in cases}) == 8


def test_nested_and_dotted_sweeps_are_the_same() -> None:
    one = suite(sweep={"burr": {"height_mm": [1.0, 2.0]}})
    assert one == suite(sweep={"burr.height_mm": [1.0, 2.0]})


def test_seeds_share_the_scene_but_not_the_identity() -> None:
    one, two = expand(suite(seeds=[0, 1]))
    assert one.scene_hash == two.scene_hash
    assert one.identity != two.identity


def test_jitter_stays_in_its_bounds_and_follows_the_identity() -> None:
    shaky = suite(jitter={"burr.angle_deg": [-5.0, 5.0]}, seeds=list(range(40)))
    angles = [case.document["burr"][0]["angle_deg"] for case in expand(shaky)]
    assert angles == [case.document["burr"][0]["angle_deg"] for case in expand(shaky)]
    assert len(set(angles)) == 40
    assert -5.0 <= min(angles) < -2.5 < 2.5 < max(angles) <= 5.0
    assert angles[0] != expand(shaky, seed=1)[0].document["burr"][0]["angle_deg"]


def test_a_case_does_not_depend_on_its_neighbours() -> None:
    alone = expand(suite(sweep={"burr.height_mm": [2.0]}, jitter={"burr.angle_deg": [-5.0, 5.0]}))
    among = expand(suite(sweep={"burr.height_mm": [1.0, 2.0]}, jitter={"burr.angle_deg": [-5.0, 5.0]}))
    assert alone[0] == among[1]


def test_a_resolved_suite_is_read_back_as_it_was() -> None:
    variant = {"name": "v", "scan": {"method": "fixed"}}
    one = suite(sweep={"burr.height_mm": [1.0]}, variant=[variant], budget=["v"])
    assert suite_from(one.document(), source="again") == one


def test_form_errors_are_all_listed_with_what_was_meant() -> None:
    with pytest.raises(InputError) as caught:
        suite(seed=[1], seeds=[], variant=[{}], jitter={"a": [1]})
    message = str(caught.value)
    for part in (
        "test: ",
        "seed: unknown key; did you mean 'seeds'?",
        "seeds:",
        "variant.0.name",
        "jitter.a",
    ):
        assert part in message


def test_errors_of_sense_are_all_listed() -> None:
    with pytest.raises(InputError) as caught:
        suite(
            seeds=[1, 1],
            variant=[{"name": "v"}, {"name": "v"}],
            jitter={"burr.angle_deg": [2.0, 1.0]},
            sweep={"burr.angle_deg": [1.0]},
        )
    message = str(caught.value)
    for part in (
        "4 problem(s)",
        "variant 'v' is given twice",
        "seed '1'",
        "lower bound",
        "swept and jittered",
    ):
        assert part in message


def test_what_a_file_names_is_checked(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(
        """
        name = "mine"
        metrics = ["coverag"]
        budget = ["vv"]
        [scene]
        base = "base.toml"
        [sweep]
        "burr.heigth_mm" = [1.0, 2.0]
        [[variant]]
        name = "v"
        scan = "adaptve"
        [[variant]]
        name = "w"
        axes = "seed"
        """
    )
    (tmp_path / "base.toml").write_text('wheel = "paper"\nfinish = "matte"\n[[burr]]\nkind = "axial_ridge"')
    with pytest.raises(InputError) as caught:
        load_suite(path)
    message = str(caught.value)
    for part in (
        "10 problem(s)",
        "did you mean 'coverage'?",
        "did you mean 'adaptive'?",
        "budget: unknown variant 'vv'",
        "axes: unknown key; did you mean 'axis'?",
        "heigth_mm",
        "'height_mm'",
    ):
        assert part in message, part


def test_an_unknown_suite_or_file_is_named() -> None:
    with pytest.raises(InputError, match="did you mean 'quick'"):
        load_suite("quik")
    with pytest.raises(InputError, match="no such file"):
        load_suite("nowhere/at/all.toml")


def test_wheel_files_are_looked_for_beside_the_suite(tmp_path: Path) -> None:
    """Wherever the command is called: in the scene, in the scene's base, and in the sweep."""
    (tmp_path / "mine.toml").write_text('name = "mine"\ngeneratrix = [[-9, 0], [-9, 50], [9, 50], [9, 0]]')
    (tmp_path / "base.toml").write_text('wheel = "mine.toml"\nfinish = "matte"')
    text = 'name = "s"\n[scene]\nbase = "base.toml"\n[sweep]\nwheel = ["mine.toml", "paper"]\n'
    (tmp_path / "s.toml").write_text(text + '[[variant]]\nname = "v"')
    cases = expand(load_suite(tmp_path / "s.toml"))
    assert [case.parameters["wheel"] for case in cases] == ["mine", "paper"]
    assert cases[0].document["wheel"]["generatrix"][1] == [-9, 50]


def test_a_finish_without_a_name_has_a_readable_one() -> None:
    finish = {"texture": "isotropic", "metal": "steel", "alpha": 0.3}
    assert label(finish) == "isotropic-steel-0.3"
    assert label({"name": "ground", "alpha": 0.3}) == "ground"


def test_a_floor_needs_a_metric_where_higher_is_better(tmp_path: Path) -> None:
    path = tmp_path / "gates.toml"
    path.write_text(
        'name = "gates"\n[scene]\nbase = "paper"\n[[variant]]\nname = "v"\n'
        '[[gate]]\nmetric = "axis_deg"\nfloor = 0.1\n[[gate]]\nmetric = "coverage"\nceiling = 0.9\n'
    )
    with pytest.raises(InputError) as caught:
        load_suite(str(path))
    assert "gate axis_deg: floor is for metrics where higher is better" in str(caught.value)
    assert "gate coverage: ceiling is for metrics where lower is better" in str(caught.value)
