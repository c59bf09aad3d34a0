"""Rays of the projector tell the paths of the camera where interreflected light comes from."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from burrscan.arrays import Floats
from scenes.scene import scene_from
from scenes.simulate import simulate
from scenes.transport import photons
from scenes.transport import trace as tracing
from scenes.transport.arrivals import Finds
from scenes.transport.guide import together
from scenes.transport.hits import may_see
from scenes.transport.photons import _AS_PATHS, photon_finds
from scenes.transport.refine import most_of_a_path
from scenes.transport.rows import SparseRows
from scenes.transport.trace import trace
from scenes.truth import Truth
from tests.scenes.pulley import stripes_on

FLANK = {
    "name": "a hub of turned steel",
    "wheel": "paper",
    "finish": "turned",
    "rig": {"scale": 0.5},
    "pose": {"elevation_deg": 23.82, "roll_deg": -13.17, "yaw_deg": 1.5865},
}
"""Its face is dark where the camera looks at it flatly, and mirrors the roundings of its rims."""


def row(light: list[float], pixels: list[int], count: int, first: float) -> Finds:
    starts = np.searchsorted(pixels, np.arange(count + 1)).astype(np.int64)
    values = np.array(light, np.float32)
    return Finds(
        SparseRows(starts, np.arange(len(light), dtype=np.int32), values),
        np.full((len(light), 3), first, np.float32) + np.arange(len(light), dtype=np.float32)[:, None],
    )


@pytest.mark.parametrize("bent", [False, True])
def test_what_they_bring_is_the_light_that_paths_find(
    mi: Any, *, bent: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From either end: fluxes through lenses here, radiances there. The sum over the picture to 3 %."""
    _, scene, optics, _ = stripes_on(mi, "ground")
    if bent:
        lens = (-0.12, 0.3, 1e-3, -2e-3, 0.1)
        rig = optics.rig
        camera, projector = (replace(one, distortion=lens) for one in (rig.camera, rig.projector))
        optics = replace(optics, rig=replace(rig, camera=camera, projector=projector))
    traced = [trace(mi, scene, optics, samples=128, bounces=n, error=np.inf) for n in (2, 3)]
    light = [float(one.white_indirect.sum()) for one in traced]
    monkeypatch.setattr(photons, "_GRID", (1024, 1024))
    finds = photon_finds(mi, scene, optics, seed=1)
    found = [float(one.light.row_sums().sum()) / _AS_PATHS for one in finds]
    assert found[0] == pytest.approx(light[1], rel=0.03)
    assert found[1] == pytest.approx(light[1] - light[0], rel=0.1)


def test_what_they_find_is_seen_by_its_pixel(mi: Any) -> None:
    _, scene, optics, _ = stripes_on(mi, "ground")
    finds = photon_finds(mi, scene, optics, seed=1)
    for one in finds:
        assert np.linalg.norm(one.directions, axis=1) == pytest.approx(1.0, abs=1e-4)
        assert (one.light.values > 0.0).all()
    lit = finds[0].light.row_sums() > 0.0
    assert lit.sum() > 1000
    assert not (lit & ~may_see(mi, scene, optics).ravel()).any()


def test_finds_are_joined_pixel_by_pixel() -> None:
    one, other = row([1.0, 2.0, 3.0], [0, 2, 2], 4, 0.0), row([5.0, 7.0], [1, 2], 4, 100.0)
    both = together(one, other)
    assert both.light.starts.tolist() == [0, 1, 2, 5, 5]
    assert both.light.values.tolist() == [1.0, 5.0, 2.0, 3.0, 7.0]
    assert both.directions[both.light.columns, 0].tolist() == [0.0, 100.0, 1.0, 2.0, 101.0]


def test_a_path_counts_for_what_its_neighbourhood_may_err_by() -> None:
    """58 % of a bright pixel's light by the default error, less where stripes cancel; no error, no bound."""
    seen = np.ones((9, 9), np.bool_)
    seen[:, 0] = False
    light = np.stack([np.full((9, 9), 2.0), np.full((9, 9), 2.0), np.zeros((9, 9))])
    most = most_of_a_path(light, 0.0 * light, seen=seen, error=0.023)
    assert most[seen] == pytest.approx(25.0 * 0.023 * 2.0)
    assert np.isinf(most[~seen]).all()
    light[1] *= 0.25
    least = most_of_a_path(light, 0.0 * light, seen=seen, error=0.023)
    assert least[4, 4] == pytest.approx(0.5 * 25.0 * 0.046)
    assert np.isinf(most_of_a_path(light, 0.0 * light, seen=seen, error=np.inf)).all()


def flank(**render: float) -> Truth:
    return simulate(scene_from({**FLANK, "render": render}, source="test"), cache_dir=None).truth


@pytest.mark.study
def test_what_roundings_mirror_onto_a_dark_flank_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """One path in 10,000 meets it, and brings 20 times the pixel's light; half of it is theirs.

    Against plain paths, 65,536 a pixel. One of 544 paths of a pixel brought 250 times its light.
    """
    found = flank()
    monkeypatch.setattr(tracing, "most_of_a_path", lambda *_, seen, **__: np.full(seen.shape, np.inf))
    monkeypatch.setattr(tracing, "together", lambda one, _: one)
    plain = flank()
    place = np.zeros(found.direct.shape, np.bool_)
    place[315:327, 195:207] = True
    monkeypatch.setattr(tracing, "may_see", lambda *_: place)
    true = np.mean([flank(samples=4096, error=1e9, seed=seed).indirect[place] for seed in range(16)], axis=0)

    def wrong(truth: Truth) -> Floats:
        return np.asarray(np.abs(truth.indirect[place] - true) / (truth.direct[place] + true))

    assert np.median(wrong(found)) < 0.1
    assert np.median(wrong(plain)) > 0.15
    assert wrong(found).max() < 2.0
    assert wrong(plain).max() > 20.0
