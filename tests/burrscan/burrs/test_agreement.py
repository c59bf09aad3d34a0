"""A burr states one place, or is refused with words; so is a method that cannot be called."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import burrscan
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.sense import in_sense
from burrscan.burrs import burrs_residual
from burrscan.errors import InputError
from burrscan.inspection import Axis, Burr, Generatrix, Value
from burrscan.pipeline import Pipeline, Stage, check
from tests.tiers import some_of

SCAN = revolution_scan(sigma_mm=0.03, seed=4, shape=(300, 90), burrs=(RidgeBurr(angle_deg=20.0),))
HERE = __name__
NOT_STATED = Value(float("nan"), float("nan"))


def inspect(burrs: str) -> burrscan.Inspection:
    return burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.03, burrs=f"{HERE}:{burrs}")


def finder(change: Callable[[Burr], Any]) -> Callable[..., Any]:
    """The shipped finder, with something planted in what it says."""

    def find(vertices: Any, faces: Any, axis: Axis, curve: Generatrix, *, sigma_mm: Any) -> tuple[Any, ...]:
        return tuple(change(b) for b in burrs_residual(vertices, faces, axis, curve, sigma_mm=sigma_mm))

    return find


def value(number: float) -> Value:
    return Value(number, 0.01)


same = finder(lambda burr: burr)
turned_away = finder(lambda burr: replace(burr, angle_deg=value(burr.angle_deg.value + 77.0)))
shifted = finder(
    lambda b: replace(b, z_start_mm=value(b.z_end_mm.value + 5.0), z_end_mm=value(b.z_end_mm.value + 9.0))
)
backwards = finder(lambda burr: replace(burr, z_start_mm=burr.z_end_mm, z_end_mm=burr.z_start_mm))
placeless = finder(lambda burr: replace(burr, angle_deg=NOT_STATED, T_mesh_burr=np.full((4, 4), np.nan)))
skewed = finder(lambda burr: replace(burr, T_mesh_burr=2.0 * burr.T_mesh_burr))
tables = finder(lambda burr: {"angle_deg": burr.angle_deg.value})
without_angle = finder(lambda burr: replace(burr, angle_deg=NOT_STATED))
without_pose = finder(lambda burr: replace(burr, T_mesh_burr=np.full((4, 4), np.nan)))


@some_of(
    ("name", "message"),
    [
        ("turned_away", r"burr 0: angle_deg is .* but T_mesh_burr lies at .* deg: state one place"),
        (
            "shifted",
            r"burr 0: z_start_mm is .* but T_mesh_burr lies at z = .* count extents in the part frame",
        ),
        ("backwards", "swap them"),
        ("placeless", "neither angle_deg nor T_mesh_burr is stated"),
        ("skewed", "no rigid motion"),
        ("tables", "must return a tuple of burrscan.Burr, not a tuple that holds dict"),
    ],
    first=3,
)
def test_a_burr_that_states_two_places_is_refused_when_it_comes_in(name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        inspect(name)


def test_what_a_method_does_not_know_may_be_nan() -> None:
    whole = inspect("same").burrs[0]
    assert inspect("without_angle").burrs[0].angle_deg.value == pytest.approx(whole.angle_deg.value)
    assert inspect("without_pose").burrs[0].angle_deg == whole.angle_deg


def test_the_seeds_mean_angle_is_where_its_pose_is() -> None:
    found = burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.03, burrs="seed")
    (burr,) = found.burrs
    x, y, _ = (found.T_part_mesh @ burr.T_mesh_burr)[:3, 3]
    assert np.degrees(np.arctan2(y, x)) == pytest.approx(burr.angle_deg.value, abs=1e-6)


def backwards_axis(vertices: Any, faces: Any, *, sigma_mm: Any) -> Axis:
    axis = burrscan.find_axis(vertices, faces, sigma_mm=sigma_mm)
    turn = perpendicular_basis(-axis.direction).T @ perpendicular_basis(axis.direction)
    both = np.kron(np.eye(2), turn)
    return replace(axis, direction=-axis.direction, covariance=both @ axis.covariance @ both.T)


def test_an_axis_of_ones_own_that_points_the_other_way_changes_nothing() -> None:
    usual = burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.03)
    other = burrscan.inspect_mesh(SCAN.vertices_mm, SCAN.faces, sigma_mm=0.03, axis=f"{HERE}:backwards_axis")
    np.testing.assert_allclose(other.axis.direction, usual.axis.direction)
    np.testing.assert_allclose(other.axis.covariance, usual.axis.covariance, atol=1e-12)
    assert other.burrs[0].angle_deg.value == pytest.approx(usual.burrs[0].angle_deg.value)


@pytest.mark.parametrize(
    ("axis", "message"),
    [
        ("z", "must return a burrscan.Axis, not str"),
        (Axis(np.zeros(3), np.array([0.0, 0.0, 2.0]), np.eye(4), "mine"), "has the length 2"),
        (Axis(np.full(3, np.nan), np.array([0.0, 0.0, 1.0]), np.eye(4), "mine"), "three finite numbers"),
    ],
)
def test_an_axis_that_is_none_is_refused(axis: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        in_sense(axis, method="mine")


def lacks_sigma(vertices_mm: Any, faces: Any, axis: Any, generatrix: Any) -> tuple[()]:  # noqa: ARG001
    return ()


def wants_more(vertices: Any, faces: Any, axis: Any, curve: Any, *, sigma_mm: Any, light: Any) -> tuple[()]:  # noqa: ARG001
    return ()


def takes_a_mesh_only(vertices_mm: Any, faces: Any, *, sigma_mm: Any) -> tuple[()]:  # noqa: ARG001
    return ()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        (
            "lacks_sigma",
            r"cannot be called as \(vertices_mm, faces, axis, generatrix, sigma_mm=...\): .*sigma_mm",
        ),
        ("wants_more", "'light'"),
        ("takes_a_mesh_only", "too many positional arguments"),
    ],
)
def test_a_wrong_signature_is_refused_before_anything_runs(name: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        check(Pipeline(burrs=Stage(f"{HERE}:{name}")))


def test_what_a_stage_needs_may_come_from_the_suite() -> None:
    check(Pipeline(burrs=Stage(f"{HERE}:wants_more", {"light": 1.0})))
