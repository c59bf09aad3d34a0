"""The lab of clean views: parts are closed, its camera sees what is there, the table is printed."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from bench.synthetic.__main__ import main
from bench.synthetic.axis_parts import _body_outline
from bench.synthetic.clean_command import clean_view, seen
from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import PARTS, box
from burrscan.arrays import Floats, Ints
from tests.tiers import some_of


@some_of("part", PARTS, first=2)
def test_every_edge_of_a_part_has_two_faces_or_lies_on_the_axis(part: str) -> None:
    for number in range(3):
        vertices, faces = PARTS[part](np.random.default_rng(number))
        place = numbered(np.round(vertices, 6))[faces]
        place = place[(place != np.roll(place, 1, axis=1)).all(axis=1)]  # not the slivers at the axis
        edges = np.sort(np.concatenate([place[:, [0, 1]], place[:, [1, 2]], place[:, [2, 0]]]), axis=1)
        assert (np.bincount(numbered(edges)) % 2 == 0).all()


def numbered(rows: Floats | Ints) -> Ints:
    """The same number for rows that are alike: by columns, a tenth of the time of numpy's unique rows."""
    number = np.zeros(len(rows), np.int64)
    for column in rows.T:
        kinds, kind = np.unique(column, return_inverse=True)
        number = np.unique(number * len(kinds) + kind, return_inverse=True)[1]
    return number


def test_the_hollow_of_a_body_stays_inside_its_wall() -> None:
    for seed in range(100):
        corner = _body_outline(np.random.default_rng(seed)) @ (1.0, 1.0j)
        start, along = corner[:-1, None], np.diff(corner)[:, None]
        with np.errstate(divide="ignore", invalid="ignore"):
            parallel = (along.conj() * along.T).imag
            place = ((start.T - start).conj() * along.T).imag / parallel
            there = ((start.T - start).conj() * along).imag / parallel
        eps = 1e-9  # neighbours meet in a corner
        assert not ((place > eps) & (place < 1.0 - eps) & (there > eps) & (there < 1.0 - eps)).any()


def test_the_camera_sees_the_near_faces_of_a_box_and_they_look_at_it() -> None:
    view = np.array([1.0, 2.0, -2.0]) / 3.0
    points, faces = single_view(*box((-3.0, 3.0), (-4.0, 4.0), (-5.0, 5.0)), view, pixels=90)
    on = np.abs(points - (-3.0, -4.0, 5.0)) < 1e-9
    assert on.any(axis=1).all()
    assert on.any(axis=0).all()
    a, b, c = (points[faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a) @ view < 0.0).all()


def test_noise_is_along_the_rays_and_as_large_as_said() -> None:
    mesh, view = box((-9.0, 9.0), (-9.0, 9.0), (0.0, 1.0)), np.array([0.0, 0.0, -1.0])
    points, _ = single_view(*mesh, view, pixels=120, sigma=0.03, seed=1)
    assert (points[:, 2] - 1.0).std() == pytest.approx(0.03, rel=0.05)
    assert len(np.unique(np.round(points[:, 0], 9))) <= 120


def test_a_view_is_the_same_each_time() -> None:
    (one, _), axis = seen("plates", 3, noise=0.001)
    (again, _), _ = seen("plates", 3, noise=0.001)
    np.testing.assert_array_equal(one, again)
    assert np.linalg.norm(axis) == pytest.approx(1.0)


@some_of(("part", "number"), [("vases", 10), ("vases", 12), ("wheels", 1), ("plates", 2)], first=2)
def test_a_clean_view_has_no_burr(part: str, number: int) -> None:
    view = clean_view(part, number, noise=0.001)
    assert not view.burrs
    assert view.axis_deg < 0.1


def test_the_table_is_printed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "argv", ["x", "clean", "--parts", "cylinders", "--views", "2", "--first", "5"])
    main()
    assert "cylinders | 2 | 0 | 0 | 0 | 0" in capsys.readouterr().out
