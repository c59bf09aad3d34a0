"""The lab of bluffs: a planted axis that bluffs is counted, a right one is not; noise is as said."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.synthetic import bluff_table
from bench.synthetic.__main__ import main
from bench.synthetic.axis_parts import FAMILIES
from bench.synthetic.axis_view import part_view
from bench.synthetic.bluff_table import by, tally, verdict
from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import box
from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.inspection import Axis
from tests.tiers import some_of

SEED = 77


def planted(
    monkeypatch: pytest.MonkeyPatch,
    *,
    turned_deg: float,
    sigma_deg: float = 0.01,
    aside_mm: float = 0.0,
    **stated: Any,
) -> None:
    """Let every axis found be the true one, turned and moved, with the uncertainty stated."""
    truth = {}

    def seen(family: str, number: int, *, seed: int) -> Any:
        truth["view"] = part_view(family, number, seed=seed)
        return truth["view"]

    def found(*_: Any, **__: Any) -> Axis:
        scan = truth["view"].scan
        aside = np.cross(scan.direction, np.eye(3)[np.argmin(np.abs(scan.direction))])
        turn = np.radians(turned_deg)
        direction = np.cos(turn) * scan.direction + np.sin(turn) * aside / np.linalg.norm(aside)
        sigma = np.radians(sigma_deg) / np.sqrt(2.0)
        point = scan.point_mm + aside_mm * aside / np.linalg.norm(aside)
        return Axis(point, direction, np.diag([sigma**2, sigma**2, 0.01, 0.01]), "planted", **stated)

    monkeypatch.setattr(bluff_table, "part_view", seen)
    monkeypatch.setattr(bluff_table, "find_axis", found)


@pytest.mark.parametrize(
    ("turned_deg", "sigma_deg", "gross", "beyond"),
    [
        (40.0, 0.01, 1, 1),
        (89.9, 0.01, 1, 1),
        (2.0, 1.5, 1, 0),  # its sigma explains it, and it is given as certain all the same
        (0.9, 0.01, 0, 0),
        (0.0, 0.01, 0, 0),
    ],
)
def test_an_axis_that_is_off_and_certain_is_counted_and_a_right_one_is_not(
    monkeypatch: pytest.MonkeyPatch, turned_deg: float, sigma_deg: float, gross: int, beyond: int
) -> None:
    planted(monkeypatch, turned_deg=turned_deg, sigma_deg=sigma_deg)
    one = verdict("plain", 0, seed=SEED)
    assert one.off_deg == pytest.approx(turned_deg, abs=1e-6)
    assert (one.ending, one.gross, one.beyond) == ("given", gross, beyond)
    counts = tally([one])
    assert (counts.given, counts.gross, counts.beyond) == (1, gross, beyond)


@pytest.mark.parametrize(
    ("aside_mm", "undetermined", "misplaced"),
    [
        (5.0, (), 1),
        (5.0, ("position",), 0),
        (0.45, (), 0),  # 4.5 of its deviations of 0.1 mm
        (0.0, (), 0),
    ],
)
def test_a_right_direction_at_the_wrong_place_is_counted(
    monkeypatch: pytest.MonkeyPatch, aside_mm: float, undetermined: tuple[str, ...], misplaced: int
) -> None:
    planted(monkeypatch, turned_deg=0.0, aside_mm=aside_mm, undetermined=undetermined)
    one = verdict("plain", 0, seed=SEED)
    assert (one.aside_mm, one.aside_sigmas) == pytest.approx((aside_mm, 10.0 * aside_mm), abs=1e-6)
    assert (one.misplaced, one.gross) == (misplaced, 0)
    assert tally([one]).misplaced == misplaced


def test_a_place_is_wrong_by_what_a_degree_moves_at_the_parts_radius(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, turned_deg=0.0)
    radius_mm = verdict("plain", 0, seed=SEED).radius_mm
    for share, misplaced in ((0.9, False), (1.1, True)):
        planted(monkeypatch, turned_deg=0.0, aside_mm=share * np.radians(1.0) * radius_mm)
        assert verdict("plain", 0, seed=SEED).misplaced == misplaced


def test_an_interval_holds_where_the_truth_is_within_it(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, turned_deg=0.0)
    assert verdict("plain", 0, seed=SEED).held == 1.0
    planted(monkeypatch, turned_deg=40.0)
    assert verdict("plain", 0, seed=SEED).held <= 0.75


def test_what_is_flagged_or_refused_is_no_bluff(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, turned_deg=40.0, undetermined=("direction",))
    flagged = verdict("plain", 0, seed=SEED)

    def refuses(*_: Any, most_doubt: float = 0.0, **__: Any) -> Axis:
        if not most_doubt:
            raise InputError("another fits as well")
        return Axis(np.zeros(3), part_view("plain", 1, seed=SEED).scan.direction, np.eye(4), "planted")

    monkeypatch.setattr(bluff_table, "find_axis", refuses)
    refused = verdict("plain", 1, seed=SEED)
    counts = tally([flagged, refused])
    assert (counts.refused, counts.flagged, counts.given, counts.gross) == (1, 1, 0, 0)
    assert (counts.good, counts.good_refused) == (1, 1)  # within 1 degree, had it been given
    assert np.isnan(counts.most_gross)


def test_the_limit_is_that_of_clopper_and_pearson(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, turned_deg=0.0)
    counts = tally([verdict("spokes", number, seed=SEED) for number in range(3)])
    assert counts.most_gross == pytest.approx(1.0 - 0.05 ** (1.0 / 3.0))


@some_of("family", FAMILIES, first=3)
def test_a_part_of_each_family_turns_about_z_and_its_axis_is_found(family: str) -> None:
    vertices, faces = FAMILIES[family](np.random.default_rng(SEED))
    assert faces.max() < len(vertices)
    assert np.isfinite(vertices).all()
    assert np.ptp(vertices, axis=0).max() > 30.0
    found = [verdict(family, number, seed=SEED) for number in range(3)]
    assert sum(one.good for one in found) >= 2


@pytest.mark.parametrize(("family", "least", "most"), [("ovals", 1e-4, 4.1e-3), ("flutes", 0.004, 0.2)])
def test_parts_are_out_of_round_by_as_much_as_said(family: str, least: float, most: float) -> None:
    for number in range(5):
        vertices, _ = FAMILIES[family](np.random.default_rng(number))
        spread = out_of_round(vertices)
        assert least < spread < most


def out_of_round(vertices: Floats) -> float:
    """Largest range of the radius on one height, of the largest radius."""
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    outer = radius > 0.6 * radius.max()
    rings = by_height(vertices[outer, 2], radius[outer])
    return float(max(np.ptp(ring) for ring in rings if len(ring) == max(map(len, rings))) / radius.max())


def by_height(z: Floats, radius: Floats) -> list[Floats]:
    """The radii on each height that stands alone (steps have two rings on one)."""
    kinds, kind, counts = np.unique(np.round(z, 6), return_inverse=True, return_counts=True)
    usual = np.median(counts)
    return [radius[kind == k] for k in range(len(kinds)) if counts[k] == usual]


@pytest.mark.parametrize("reach_px", [0.0, 1.5, 4.0])
def test_noise_is_as_large_as_said_and_reaches_as_far(reach_px: float) -> None:
    mesh, view = box((-9.0, 9.0), (-9.0, 9.0), (0.0, 1.0)), np.array([0.0, 0.0, -1.0])
    points, _ = single_view(*mesh, view, pixels=160, sigma=0.03, reach_px=reach_px, seed=1)
    height = points[:, 2] - 1.0
    assert height.std() == pytest.approx(0.03, rel=0.12)
    columns = len(np.unique(np.round(points[:, 1], 6)))
    grid = height.reshape(-1, columns)
    beside = float(np.mean(grid[:, 1:] * grid[:, :-1]) / np.mean(grid**2))
    assert beside == pytest.approx(np.exp(-0.25 / reach_px**2) if reach_px else 0.0, abs=0.05)


def test_a_view_is_the_same_for_the_same_seed_and_another_for_another() -> None:
    one, again, other = (part_view("short", 4, seed=seed).scan.vertices_mm for seed in (1, 1, 2))
    np.testing.assert_array_equal(one, again)
    assert one.shape != other.shape or not np.allclose(one, other)


def test_the_table_is_printed_and_written(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    planted(monkeypatch, turned_deg=40.0)
    to = tmp_path / "bluffs.json"
    options = ["--families", "ovals", "short", "--parts", "2", "--seed", "3", "--json", str(to)]
    monkeypatch.setattr(sys, "argv", ["x", "bluff", *options])
    main()
    out = capsys.readouterr().out
    assert "ovals | 2 | 0 | 0 of 0 | 0 | 2 | 2 | 2 | 0 | " in out
    assert "given as certain: 4 of 4; at most 100.00 %" in out
    assert out.count("off by 40.00°") == 4
    document = json.loads(to.read_text("utf-8"))
    assert document["all"]["gross"] == 4
    assert len(document["views"]) == 4
    assert set(document["families"]) == {"ovals", "short"}


def test_json_on_standard_output_is_one_document(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    planted(monkeypatch, turned_deg=0.0)
    monkeypatch.setattr(sys, "argv", ["x", "bluff", "--families", "plain", "--parts", "1", "--json", "-"])
    main()
    said = capsys.readouterr()
    assert json.loads(said.out)["all"]["gross"] == 0
    assert "plain | 1 | " in said.err


@pytest.mark.parametrize("options", [["--method", "profil"], ["--parts", "0"], ["--seed", "-1"]])
def test_what_cannot_be_run_ends_with_2_and_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], options: list[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["x", "bluff", *options])
    with pytest.raises(SystemExit) as ended:
        main()
    assert ended.value.code == 2
    assert capsys.readouterr().err.strip()


def test_groups_keep_the_order_in_which_they_come(monkeypatch: pytest.MonkeyPatch) -> None:
    planted(monkeypatch, turned_deg=0.0)
    verdicts = [verdict(family, 0, seed=SEED) for family in ("short", "plain")]
    assert list(by(verdicts, "family")) == ["short", "plain"]
