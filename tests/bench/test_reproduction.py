"""The page about the paper: its measurements against independent truth, and the page itself."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm

from bench.cli import main
from bench.reproduction import NAMES, build_paper, multiview, rivals, servoing
from bench.reproduction.choices import separation
from bench.reproduction.drawing import equal_axes
from bench.reproduction.generatrix_band import thickness_mm
from bench.reproduction.lab import Lab
from bench.reproduction.landscapes import contrast
from bench.reproduction.minima import bottoms, grid_of, minima_of
from bench.reproduction.noise import along_rays
from bench.reproduction.orientation import angles_of, direction_of, sectioned
from bench.reproduction.plane_scans import PERIOD_PX, harmonic_of
from bench.reproduction.range_scan import mesh_counts, triangles_of
from bench.reproduction.ransac_table import REJECTED, ROUNDS, TOLERANCES_MM, implied_sigma_mm, rounds_within
from bench.reproduction.sampling import directions_of, distinct, farthest_deg, unevenness
from bench.reproduction.sources import source_of
from bench.synthetic.revolution import grid_faces, revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.rivals.seed import orientation_grid
from burrscan.errors import InputError
from tests.bench.reproduction_lab import MadeUpLab


def test_the_printed_rounds_fit_the_printed_shares() -> None:
    for share, rounds in zip(REJECTED, ROUNDS, strict=True):
        low, high = rounds_within(share)
        assert low <= rounds <= high


def test_the_implied_noise_rejects_what_the_paper_rejects() -> None:
    for tolerance, share, sigma in zip(TOLERANCES_MM, REJECTED, implied_sigma_mm(), strict=True):
        assert 2.0 * norm.sf(tolerance, scale=sigma) == pytest.approx(share)


def test_angles_name_the_same_line() -> None:
    for direction in np.random.default_rng(1).normal(size=(50, 3)):
        unit = direction / np.linalg.norm(direction)
        angles = angles_of(unit)
        assert abs(direction_of(angles) @ unit) == pytest.approx(1.0)
        assert 0.0 <= angles[0] < np.pi
        assert 0.0 <= angles[1] <= np.pi


def test_the_papers_grid_is_even_and_visits_seven_axes() -> None:
    naive, even = (directions_of(orientation_grid(48, kind)) for kind in ("naive", "uniform"))
    assert unevenness(naive) > 3.0
    assert unevenness(even) < 1.5
    few = directions_of(orientation_grid(3, "uniform"))
    assert distinct(few) == 7
    assert 30.0 < farthest_deg(few) < 60.0


def test_sections_of_a_clean_cylinder_are_its_circles() -> None:
    scan = revolution_scan("cylinder", shape=(200, 60), seed=3)
    test = sectioned(scan.vertices_mm, scan.faces, angles_of(scan.direction))
    np.testing.assert_allclose(test.good[:, 3], 90.0, atol=0.05)
    assert test.quality() < 0.01
    assert (
        sectioned(scan.vertices_mm, scan.faces, angles_of(scan.direction) + np.array([0.0, 0.1])).quality()
        > 0.02
    )


def test_minima_of_a_known_landscape() -> None:
    """Two valleys of known places and depths, one of them at a pole, which the grid visits many times."""
    places = np.array([[0.0, 0.0, 1.0], [0.6, 0.8, 0.0]])

    def height(angles: np.ndarray) -> float:
        sines = np.linalg.norm(np.cross(places, direction_of(angles)), axis=1)
        return float(np.min(sines + np.array([0.1, 0.2])))

    grid = grid_of(31)
    found = minima_of(np.array([height(angles) for angles in grid]), grid)
    assert len(found.index) == 2
    deep = bottoms(height, found, grid, step_deg=3.0)
    np.testing.assert_allclose(deep[:, 2], [0.1, 0.2], atol=2e-3)
    assert abs(direction_of(deep[1, :2]) @ places[1]) > np.cos(np.radians(0.3))


def test_noise_moves_along_the_ray_by_its_sigma() -> None:
    vertices = np.random.default_rng(2).normal(size=(20_000, 3)) + np.array([0.0, 0.0, 600.0])
    moved = along_rays(vertices, 0.5) - vertices
    across = np.cross(moved, vertices / np.linalg.norm(vertices, axis=1)[:, None])
    assert np.abs(across).max() < 1e-9
    z = (np.linalg.norm(moved, axis=1) ** 2).mean() / 0.25 - 1.0
    assert abs(z) < 4.0 * np.sqrt(2.0 / len(vertices))


def test_what_was_measured_is_kept_for_the_next_run(tmp_path: Path) -> None:
    lab = Lab(tmp_path, quick=True, code="test")
    made = []

    def make() -> dict[str, np.ndarray]:
        made.append(1)
        return {"x": np.array(3.0)}

    assert float(lab.kept("a", make)["x"]) == float(lab.kept("a", make)["x"]) == 3.0
    assert len(made) == 1
    lab.kept("a", make, also="another source")
    assert len(made) == 2


def test_an_unknown_section_is_refused_with_the_nearest_name(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="did you mean 'section-5'"):
        build_paper(Lab(tmp_path, quick=True, code="test"), tmp_path / "page.html", only=["sektion-5"])


def test_the_page_is_one_file_with_its_claims(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    page = tmp_path / "paper.html"
    shown = ("figure-4", "figure-5", "ransac-table")
    assert main(["paper", "--quick", "--out", str(page), *(f"--only={name}" for name in shown)]) == 0
    assert str(page) in capsys.readouterr().out
    text = page.read_text("utf-8")
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    assert not re.search(r"https?://", text.replace("http://www.w3.org", ""))
    for name in shown:
        assert f'<section id="{name}"' in text
        assert f"burrscan paper --only {name}" in text
    assert text.count('class="agrees') >= 4
    assert "nan" not in re.sub(r"data:[^\"']+", "", text).lower().replace("finance", "")


def test_every_section_has_a_module() -> None:
    assert len(set(NAMES)) == len(NAMES) >= 5


def test_a_wave_of_the_eighth_harmonic_is_told_along_a_slanted_row() -> None:
    u_px = np.linspace(100.0, 260.0, 480)
    wave = np.hanning(480) * np.sin(2.0 * np.pi * 8.0 * u_px / PERIOD_PX) + 1e-3 * u_px
    assert harmonic_of(wave[::-1], u_px[::-1]) == pytest.approx(8.0, abs=0.2)


def test_strips_and_borders_are_counted() -> None:
    """Two separate grids: a disc has T = Vo + 2 Vi - 2, and a rectangle's border is known."""
    one = grid_faces(11, 21)
    two = np.concatenate([one, grid_faces(5, 5) + one.max() + 1]).astype(np.int32)
    vertices, border, strips, largest = mesh_counts(one)
    assert (vertices, border, strips, largest) == (231, 60, 1, 1.0)
    assert triangles_of(vertices, border) == len(one)
    assert mesh_counts(two)[:3] == (231 + 25, 60 + 16, 2)
    assert mesh_counts(two)[3] == len(one) / len(two)


def test_a_sections_source_includes_what_it_imports(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text("from bench.reproduction.b import x\n")
    (tmp_path / "b.py").write_text("from bench.reproduction import c\nfrom bench.reproduction.a import y\n")
    (tmp_path / "c.py").write_text("from bench.synthetic.d import z\n")
    assert source_of(tmp_path / "a.py").count("import") == 4


@pytest.mark.parametrize("wide", [40.0, 200.0, 2000.0])
def test_equal_axes_draw_a_square_as_a_square(wide: float) -> None:
    axes = equal_axes(np.array([[0.0, 0.0], [wide, 150.0]]), "z", "r")
    assert axes.px(10.0) - axes.px(0.0) == pytest.approx(axes.py(0.0) - axes.py(10.0))


def test_thickness_of_a_band_of_known_width() -> None:
    rng = np.random.default_rng(3)
    z, r = rng.uniform(-30.0, 30.0, 40_000), rng.uniform(90.0, 96.0, 40_000)
    np.testing.assert_allclose(thickness_mm(z, r), 6.0, atol=0.25)


@pytest.mark.study
def test_every_section_is_measured_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On made-up scans: the whole page is one file, every claim is judged, what differs has its reason."""
    monkeypatch.setattr(multiview, "SPINS_DEG", {1: (0.0,), 2: (0.0, 90.0)})
    # the slowest of them takes a second a mesh, and has tests of its own
    monkeypatch.setattr(rivals, "find_axis", lambda vertices, faces, **_: find_axis(vertices, faces))
    # each of its looks is rendered; tests of its own: tests/burrscan/cell and tests/bench/test_cell.py
    looked = SimpleNamespace(glances=[SimpleNamespace(height_mm=60.0)] * 3, converged=True)
    monkeypatch.setattr(servoing, "servo", lambda *_, **__: looked)
    lab = MadeUpLab(tmp_path / "work", quick=True, code="made up")
    text = build_paper(lab, tmp_path / "page.html").read_text("utf-8")
    assert not re.search(r'(?:src|href)="(?!data:|#)', text)
    words = re.sub(r"data:[^\"']+", "", text)
    assert not re.findall(r".{60}\bnan\b.{20}", words)
    for name in NAMES:
        assert words.count(f'<section id="{name}"') == 1
    rows = re.findall(r"<tr><th><a href.*?</tr>", words)
    assert 2 * len(rows) == words.count('class="agrees') > 60
    unexplained = [row for row in rows if 'class="agrees no"' in row and 'class="why"' not in row]
    assert not unexplained


def test_contrast_is_free_of_scale_and_tells_a_competing_minimum() -> None:
    values = np.linspace(1.0, 9.0, 81)
    assert contrast(np.array([1.0, 2.0]), values) == pytest.approx(0.25)
    assert contrast(np.array([1.0, 2.0]) * 7.0 - 3.0, values * 7.0 - 3.0) == pytest.approx(0.25)
    assert contrast(np.array([1.0]), values) == 1.0
    assert contrast(np.array([1.0, 2.0]), np.append(values, np.full(9, np.inf))) == pytest.approx(0.25)


def test_separation_of_known_samples() -> None:
    right, wrong = np.array([1.0, 2.0]), np.array([2.0, 3.0])
    assert separation(right, wrong) == pytest.approx(0.875)
    assert separation(right, right) == 0.5
    assert np.isnan(separation(right, np.array([])))
