"""What stands out of its surroundings: a burr among higher ones, and one ripple among many."""

from __future__ import annotations

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.burrs import local_cfar
from burrscan.burrs.detect import Region, regions
from burrscan.burrs.field import Field, field_of
from burrscan.burrs.local_cfar import convincing
from burrscan.generatrix import fit_generatrix
from scenes.wheel import build_wheel, load_wheel
from tests.burrscan.burrs.test_no_curve import TORN, ridge
from tests.burrscan.parts import angle_in_frame_deg, exact_axis, scattered_scan, turned

_RIDGES = ((3.0, 0.3), (-3.0, 1.4), (8.0, 1.5), (-8.0, 4.0))
"""Angle (degrees) and height (mm): the first stands among the others."""


def among_larger(_z: Floats, r: Floats, angle: Floats) -> Floats:
    """A low ridge, and three higher ones on the same rows and within 20 mm, triangular."""
    lift = np.zeros_like(angle)
    for at, height in _RIDGES:
        lift += height * np.clip(1.0 - np.abs(angle - np.radians(at)) * r / 1.5, 0.0, None)
    return lift


def ripples(z: Floats, r: Floats, angle: Floats) -> Floats:
    """Teeth of 0.5 mm every 7 mm all the way round, on a few rows."""
    x = (angle * r) % 7.0 - 3.5
    return np.asarray(0.5 * np.clip(1.0 - np.abs(x) / 0.75, 0.0, None) * (np.abs(z) < 4.0))


def called(
    lift: object, seed: int, *, scan_of_one_view: bool = False
) -> tuple[Field, list[Region], list[float]]:
    """The field, its regions, and the angles (degrees, as drawn) of those that convince."""
    scan = scattered_scan("cylinder", lift, seed=seed)  # type: ignore[arg-type]
    axis = exact_axis(scan)
    curve = fit_generatrix(scan.vertices_mm, scan.faces, axis)
    field = field_of(scan.vertices_mm, scan.faces, axis, curve, sigma_mm=None)
    found = regions(field, false_calls_per_wheel=1e-6)
    kept = convincing(field, found, cores=scan_of_one_view)
    zero = angle_in_frame_deg(scan, axis, 0.0)
    sense = np.sign(turned(angle_in_frame_deg(scan, axis, 10.0) - zero))
    angles = []
    for region in kept:
        inside = region.cells[field.cell[:, 0], field.cell[:, 1]]
        middle = np.degrees(np.angle(np.exp(1j * field.angle[inside]).mean()))
        angles.append(sense * turned(float(middle) - zero))
    return field, found, angles


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_small_ridge_among_larger_ones_is_kept(seed: int) -> None:
    _, _, angles = called(among_larger, seed)
    assert sorted(angles) == pytest.approx(sorted(at for at, _ in _RIDGES), abs=0.3)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_one_ripple_of_many_is_none(seed: int) -> None:
    _, found, angles = called(ripples, seed)
    assert len(found) > 20
    assert angles == []


def test_the_order_of_the_regions_is_kept() -> None:
    field, found, _ = called(among_larger, 6)
    kept = convincing(field, found)
    assert len(kept) == len(_RIDGES)
    turned_round = convincing(field, found[::-1])
    assert [id(one) for one in turned_round] == [id(one) for one in kept[::-1]]
    assert [id(one) for one in found if any(one is other for other in kept)] == [id(one) for one in kept]


@pytest.mark.study
def test_what_box_found_a_burr_does_not_decide_if_it_stands_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """Eight burrs of 0.6 to 1.9 mm, one to three pixels wide: means of three columns lose most of them."""
    burrs = [
        ridge(-58.6, 0.59, 2.47, section="flake", lean_deg=35.0),
        ridge(-39.9, 1.29, 2.96),
        ridge(-24.8, 1.32, 0.97),
        ridge(-11.9, 1.71, 1.55, section="flake", **TORN),
        ridge(2.0, 1.91, 2.86, section="rolled", curl_deg=120.0),
        ridge(16.2, 0.75, 1.73),
        ridge(34.2, 1.56, 2.93, section="rolled", curl_deg=120.0),
        ridge(49.0, 1.28, 2.03, section="rounded", height_rms=0.1),
    ]
    wheel = build_wheel(load_wheel("stepped_hub"), burrs, facet_error_mm=0.01)
    view = np.array([-0.98, 0.0, -0.2])
    scans = [single_view(*wheel.welded(), view, pixels=200, sigma=0.037, seed=seed) for seed in range(2)]
    assert [len(inspect_mesh(*scan).burrs) for scan in scans] == [8, 8]
    monkeypatch.setattr(local_cfar, "_boxes", lambda region: {tuple(min(n, 3) for n in region.box)})
    assert max(len(inspect_mesh(*scan).burrs) for scan in scans) < 4


@pytest.mark.parametrize("seed", [7, 8])
def test_the_far_side_is_no_measure_of_the_near_one(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """A burr of 0.37 mm on chrome stood out by 28 sigma, but not from an end face's far side in the dark."""

    def dark_on_the_far_side(_z: Floats, r: Floats, angle: Floats) -> Floats:
        noise = 0.3 * np.random.default_rng(seed).standard_normal(len(angle))
        low_ridge = 0.15 * np.clip(1.0 - np.abs(angle) * r / 1.5, 0.0, None)
        return np.where(np.abs(angle) > np.radians(40.0), noise, low_ridge)

    def near(*, scanned: bool) -> list[float]:
        found = called(dark_on_the_far_side, seed, scan_of_one_view=scanned)[2]
        return [angle for angle in found if abs(angle) < 30.0]

    assert near(scanned=True) == []  # this view's far side is within what a camera faces
    monkeypatch.setattr(local_cfar, "_FACED", np.radians(35.0))
    assert near(scanned=True) == pytest.approx([0.0], abs=1.0)
    assert near(scanned=False) == []
