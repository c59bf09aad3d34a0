from unittest.mock import Mock

import numpy as np
import pytest

from bench.synthetic.revolution import revolution_scan
from burrscan.axis import find_axis
from burrscan.axis.rivals import seed as seed_module
from burrscan.axis.rivals.seed import nearest_to_others, orientation_grid, quality_of, without_strays
from burrscan.axis.rivals.seed_descent import GRADIENTS, steepest_descent
from burrscan.axis.sections import sections
from burrscan.errors import InputError


def _directions(grid: np.ndarray) -> np.ndarray:
    theta, phi = grid.T
    return np.stack([np.cos(theta) * np.sin(phi), np.sin(theta) * np.sin(phi), np.cos(phi)], axis=1)


def test_the_papers_grid_has_seven_distinct_directions() -> None:
    grid = orientation_grid(3, "uniform")
    assert len(grid) == 9
    assert len(np.unique(np.round(_directions(grid), 9), axis=0)) == 7
    np.testing.assert_allclose(_directions(grid)[0], [0, 0, -1], atol=1e-12)  # phi = pi, n times


def test_the_even_grid_has_the_nine_that_the_text_counts() -> None:
    directions = _directions(orientation_grid(3, "even"))
    lines = np.abs(directions @ directions.T)
    assert (lines > 1.0 - 1e-9).sum() == 9
    np.testing.assert_allclose(np.unique(np.round(directions[:, 2], 9)), [-2 / 3, 0, 2 / 3], atol=1e-9)


@pytest.mark.parametrize(
    ("sampling", "phi_deg"),
    [
        ("uniform", [180.0, 120.0, 90.0, 60.0]),
        ("even", [138.590378, 104.477512, 75.522488, 41.409622]),
        ("naive", [0.0, 45.0, 90.0, 135.0]),
    ],
)
def test_the_grid_of_four_by_hand(sampling: str, phi_deg: list[float]) -> None:
    expected = [(theta, phi) for theta in (0.0, 45.0, 90.0, 135.0) for phi in phi_deg]
    np.testing.assert_allclose(np.degrees(orientation_grid(4, sampling)), expected, atol=1e-6)


def test_uniform_sampling_is_even_in_height_and_naive_is_not() -> None:
    even = np.diff(np.unique(np.round(_directions(orientation_grid(8, "uniform"))[:, 2], 9)))
    naive = np.diff(np.unique(np.round(_directions(orientation_grid(8, "naive"))[:, 2], 9)))
    assert np.ptp(even) < 1e-9 < np.ptp(naive)


def test_qualities_of_known_circles() -> None:
    circles = np.full((4, 8), np.nan)
    circles[1] = [0, 0, 0, 10, 0.1, 0.1, 50, 0]
    circles[2] = [3, 1, 1, 10, 0.3, 0.3, 50, 0]
    assert quality_of(circles, "circle_distance") == pytest.approx(0.2)
    circles[2, 6] = 150
    assert quality_of(circles, "circle_distance") == pytest.approx(0.25)
    assert quality_of(circles, "circle_distance", mean="circles") == pytest.approx(0.2)
    circles[2, 5] = 0.2  # of which the tolerance counts, and not the whole distance
    assert quality_of(circles, "circle_distance") == pytest.approx(0.175)
    assert quality_of(circles, "circle_distance", outliers="distance") == pytest.approx(0.25)
    assert quality_of(circles, "bounding_box") == pytest.approx(3.0)
    assert quality_of(circles, "max_centre_distance") == pytest.approx(3.0)
    assert quality_of(np.full((3, 8), np.nan), "circle_distance") == np.inf


def test_location_ignores_outlying_centres() -> None:
    centres = np.array([[0.0, 0.0], [0.2, 0.0], [0.1, 0.1], [30.0, 5.0], [30.2, 5.0]])
    assert np.linalg.norm(nearest_to_others(centres, 1.0)) < 0.3


@pytest.mark.parametrize("quality", ["circle_distance", "bounding_box", "max_centre_distance"])
@pytest.mark.parametrize("descent", ["steepest", "levenberg_marquardt"])
def test_options_run_and_count_evaluations(quality: str, descent: str) -> None:
    scan = revolution_scan(shape=(160, 50), sigma_mm=0.2)
    axis = find_axis(scan.vertices_mm, scan.faces, method="seed", quality=quality, descent=descent)
    assert 9 < axis.evaluations < 400
    assert np.isnan(axis.covariance).all()
    assert np.linalg.norm(axis.direction) == pytest.approx(1.0)


def _errors(method: str, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Errors in degrees and evaluations on wheels in random poses."""
    errors, evaluations = [], []
    for k in range(count):
        scan = revolution_scan(sigma_mm=0.05, seed=k, shape=(300, 100))
        axis = find_axis(scan.vertices_mm, scan.faces, method=method, seed=100_003 * k)
        errors.append(scan.angle_error_deg(axis.direction))
        evaluations.append(axis.evaluations)
    return np.array(errors), np.array(evaluations)


@pytest.mark.study
def test_the_charitable_reading_finds_what_the_literal_one_misses() -> None:
    """24 stepped wheels with little noise; docs/seed.md has the figures of rendered wheels."""
    errors, evaluations = _errors("seed", 24)
    assert np.median(errors) < 3.0
    assert np.median(evaluations) <= 60
    literal, fewer = _errors("seed-literal", 24)
    assert np.median(literal) > 5.0
    assert 20 <= np.median(fewer) <= 45  # the paper: about 30
    mended, _ = _errors("seed-mended", 8)
    assert mended.max() < 5.0 < errors.max()  # its starts are dense: none in another basin


@pytest.mark.parametrize(("gradient", "off_deg"), [("central", (0.0, 0.5)), ("forward", (2.0, 8.0))])
def test_forward_differences_end_beside_a_perfect_minimum(
    gradient: str, off_deg: tuple[float, float]
) -> None:
    """A cone over the plane of angles: its lowest point is known, f has no noise and no second minimum."""
    ends = []
    for start in np.radians(np.random.default_rng(1).uniform(-30.0, 30.0, (40, 2))):
        at, value = start, float(np.linalg.norm(start))
        for step in np.radians([30.0, 10.0]):
            at, value = steepest_descent(
                lambda x: float(np.linalg.norm(x)), at, value, step, gradient=gradient, trials=6
            )
        ends.append(np.degrees(np.linalg.norm(at)))
    assert off_deg[0] <= np.median(ends) < off_deg[1]


@pytest.mark.parametrize("halving", ["run", "gradient"])
def test_five_steps_fail_before_a_run_ends(halving: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """With exact slopes every value asked for is a step's: those that do not descend are counted."""
    monkeypatch.setitem(GRADIENTS, "exact", lambda _f, at, _value, _step: at / np.linalg.norm(at))
    failed: list[bool] = []
    best = [0.37]

    def distance(at: np.ndarray) -> float:
        reached = float(np.linalg.norm(at))
        failed.append(reached >= best[0])
        best[0] = min(best[0], reached)
        return reached

    start = np.array([0.37, 0.0])
    steepest_descent(distance, start, 0.37, 1.0, gradient="exact", trials=5, halving=halving)
    assert all(failed[-5:]) if halving == "gradient" else sum(failed) == 5
    assert (sum(failed) > 5) == (halving == "gradient")


def test_a_section_through_two_surfaces_misleads_whole_distances_only() -> None:
    """Planes across the flange also cut the hub: at the true axis the hub's points are 40 mm off."""
    errors: dict[str, list[float]] = {"tolerance": [], "distance": []}
    for k in range(12):
        scan = revolution_scan("flanged_hub", sigma_mm=0.05, seed=k, shape=(200, 80))
        for outliers, found in errors.items():
            axis = find_axis(scan.vertices_mm, scan.faces, method="seed", seed=100_003 * k, outliers=outliers)
            found.append(scan.angle_error_deg(axis.direction))
    assert np.median(errors["tolerance"]) < 4.0
    assert np.median(errors["distance"]) > 8.0


def test_strays_are_set_aside_and_pieces_are_not() -> None:
    scan = revolution_scan(shape=(60, 30))
    count = len(scan.vertices_mm)
    stray = scan.vertices_mm[:3] + np.array([0.0, 0.0, 500.0])
    vertices = np.concatenate([scan.vertices_mm, stray])
    faces = np.concatenate([scan.faces, [[count, count + 1, count + 2]]]).astype(np.int32)
    kept, triangles = without_strays(vertices, faces, 0.01)
    np.testing.assert_array_equal(kept, scan.vertices_mm)
    np.testing.assert_array_equal(triangles, scan.faces)
    assert len(without_strays(vertices, faces, 0.0)[0]) == count + 3
    two = np.concatenate([scan.faces, scan.faces + count]).astype(np.int32)
    assert len(without_strays(np.concatenate([scan.vertices_mm] * 2), two, 0.4)[0]) == 2 * count


def test_every_evaluation_is_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sections of the mesh are cut once for each evaluation, and once more for the location."""
    scan = revolution_scan(shape=(100, 40), sigma_mm=0.2)
    cut = Mock(wraps=sections)
    monkeypatch.setattr(seed_module, "sections", cut)
    axis = find_axis(scan.vertices_mm, scan.faces, method="seed")
    assert cut.call_count == axis.evaluations + 1


@pytest.mark.parametrize("descent", ["steepest", "levenberg_marquardt"])
def test_a_limited_search_evaluates_no_more_and_ends_on_its_way(
    descent: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    scan = revolution_scan(shape=(100, 40), sigma_mm=0.2)
    cut = Mock(wraps=sections)
    monkeypatch.setattr(seed_module, "sections", cut)
    free = find_axis(scan.vertices_mm, scan.faces, method="seed", descent=descent)
    for most in (9, 12, 20, free.evaluations, 10 * free.evaluations):
        cut.reset_mock()
        axis = find_axis(scan.vertices_mm, scan.faces, method="seed", descent=descent, most_evaluations=most)
        assert axis.evaluations == cut.call_count - 1 == min(most, free.evaluations)
        assert np.isfinite(axis.direction).all()
    np.testing.assert_array_equal(axis.direction, free.direction)


def test_one_seed_one_result() -> None:
    scan = revolution_scan(shape=(100, 40), sigma_mm=0.5)
    first, second = (find_axis(scan.vertices_mm, scan.faces, method="seed", seed=5) for _ in range(2))
    np.testing.assert_array_equal(first.direction, second.direction)
    np.testing.assert_array_equal(first.point_mm, second.point_mm)


def test_simplified_mesh() -> None:
    scan = revolution_scan(shape=(160, 50), sigma_mm=0.05)
    axis = find_axis(scan.vertices_mm, scan.faces, method="seed", keep_ratio=0.3)
    assert np.isfinite(axis.direction).all()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"quality": "roundness"}, "quality.*circle_distance"),
        ({"keep_ratio": 0.0}, "keep_ratio"),
        ({"tolerance_mm": 0.0}, "above 0"),
        ({"most_evaluations": 8}, "at least n² = 9"),
        ({"plains": 12}, "did you mean 'planes'"),
    ],
)
def test_bad_options(parameters: dict[str, object], message: str) -> None:
    scan = revolution_scan(shape=(40, 20))
    with pytest.raises(InputError, match=message):
        find_axis(scan.vertices_mm, scan.faces, method="seed", **parameters)


def test_a_cloud_has_no_sections() -> None:
    with pytest.raises(InputError, match="need triangles"):
        find_axis(revolution_scan(shape=(40, 20)).vertices_mm, method="seed")
