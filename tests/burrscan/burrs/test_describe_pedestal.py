"""A burr no wider than a pixel stands on a pedestal: pixels that hold a part of it, and are not the burr."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.api import inspect_mesh
from burrscan.burrs import describe
from burrscan.burrs.describe import Site
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import first_ridge, fit_ridge
from burrscan.inspection import Value

_SPACING_MM, _NOISE_MM, _WIDE_MM = 0.6, 0.02, 2.2
FLAKE = 0.15, 0.4
"""Heights, mm, of pedestal and crest: of a flake 0.9 mm high and 0.45 wide, on matt paint."""


def height(pedestal_mm: float, crest_mm: float, *, sign: int = 1, seed: int = 0) -> Value:
    """What is told of a line of vertices on a low bank of noisy ones."""
    u, v = (
        a.ravel() for a in np.meshgrid(np.arange(0.0, 30.0, _SPACING_MM), np.arange(-3.0, 3.1, _SPACING_MM))
    )
    lift = pedestal_mm * np.clip(1.0 - np.abs(v) / (0.5 * _WIDE_MM), 0.0, None)
    lift[np.abs(v) < 0.1] = crest_mm
    lift += _NOISE_MM * np.random.default_rng(seed).standard_normal(len(lift))
    patch = Patch(u, v, lift, np.full(len(u), _NOISE_MM))
    first = first_ridge(patch, spacing_mm=_SPACING_MM, start=(0.0, 30.0))
    assert first is not None
    ridge = fit_ridge(patch, first, spacing_mm=_SPACING_MM)
    on = np.abs(v) < 0.5 * _WIDE_MM
    site = Site(np.arange(len(u)), on, sign, 20.0)
    field: Any = SimpleNamespace(spacing_mm=_SPACING_MM, local_mm=patch.sigma_mm)
    frame: Any = SimpleNamespace(patch=patch)
    ridge = replace(ridge, parameters=np.append(pedestal_mm, ridge.parameters[1:]))  # as it came out there
    return describe._height(field, site, ridge, frame, edged=False, facing=0.0)


def test_the_crest_tells_where_the_ridge_that_fits_is_the_pedestal(monkeypatch: pytest.MonkeyPatch) -> None:
    told = height(*FLAKE)
    assert told.value == pytest.approx(FLAKE[1], abs=0.1)
    assert abs(told.value - 0.9) < 3.0 * told.sigma
    monkeypatch.setattr(describe, "_NO_PEDESTAL", np.inf)
    without = height(*FLAKE)
    assert without.value < 0.3
    assert 0.9 - without.value > 5.0 * without.sigma


@pytest.mark.parametrize("seed", range(4))
def test_noise_is_no_crest(seed: int) -> None:
    """The highest of a slice's vertices is above the ridge by noise alone."""
    assert height(0.06, 0.06, seed=seed).value < 0.09


def test_a_nick_whose_walls_mirror_has_no_crest() -> None:
    assert height(*FLAKE, sign=-1).value < 0.3


def test_a_mound_ten_times_lower_than_what_stands_on_it_is_not_its_ridge(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A burr near the border of a mound of shared errors was called in the mound's own middle."""
    scan = revolution_scan(burrs=(RidgeBurr(10.0, 0.3, 1.2),), sigma_mm=0.02)
    (burr,) = inspect_mesh(scan.vertices_mm, scan.faces).burrs
    for times, called in ((8.0, 1), (12.0, 0)):
        told = Value(times * burr.height_mm.value, 0.5)
        monkeypatch.setattr(describe, "_height", lambda *_, told=told, **__: told)
        assert len(inspect_mesh(scan.vertices_mm, scan.faces).burrs) == called
