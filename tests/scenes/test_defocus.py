"""A rendered wheel near a projector with a wide lens: the scan finds the lens, and sigmas hold."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.scan.adaptive import scan_adaptive
from burrscan.scan.lens import Lens, lens_of
from burrscan.sideways import by_columns
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate

APERTURE_MM = 4.0
DOCUMENT = {
    "wheel": {
        "name": "disc",
        "generatrix": [
            [-15.0, 10.0],
            [-15.0, 34.0, 1.0],
            [0.0, 34.0, 1.0],
            [0.0, 28.0, 0.5],
            [15.0, 28.0, 1.0],
            [15.0, 10.0],
        ],
    },
    "finish": "matte",
    "pose": {"elevation_deg": 15.0, "roll_deg": 20.0},
    "rig": {
        "scale": 0.2,
        "standoff_mm": 180.0,
        "baseline_mm": 50.0,
        "camera": {"width": 1280, "height": 1024, "focal_px": 2900.0},
        "projector": {"width": 1920, "height": 1080, "focal_px": 3400.0, "aperture_mm": APERTURE_MM},
    },
    "render": {"error": 0.1},
}


@pytest.fixture(scope="module")
def simulation() -> Simulation:
    return simulate(scene_from(DOCUMENT, source="test"))


def pulls(simulation: Simulation) -> Floats:
    found = scan_adaptive(by_columns(simulation.scanner())).correspondence
    known = found.mask & (simulation.truth.direct > 0.0) & np.isfinite(simulation.truth.u_px)
    pull: Floats = ((found.u_px - simulation.truth.u_px) / found.sigma_u_px)[known].astype(float)
    return pull


@pytest.mark.study
def test_the_lens_is_found_and_columns_are_as_sure_as_they_say(
    simulation: Simulation, monkeypatch: pytest.MonkeyPatch
) -> None:
    lenses: list[Lens] = []

    def found(*given: Any, **also: Any) -> Lens:
        lenses.append(lens_of(*given, **also))
        return lenses[-1]

    monkeypatch.setattr("burrscan.scan.adaptive.lens_of", found)
    mended = pulls(simulation)
    monkeypatch.setattr("burrscan.scan.adaptive.lens_of", lambda *_, **__: Lens())
    blind = pulls(simulation)
    (lens,) = lenses
    rig = simulation.scene.rig
    assert lens.per_inverse == pytest.approx(APERTURE_MM * rig.rig().projector.fx, rel=0.3)
    assert 1.0 / lens.focus == pytest.approx(rig.standoff_mm, rel=0.04)
    assert np.mean(np.abs(mended) > 4.0) < 0.01
    assert np.mean(np.abs(blind) > 4.0) > 1.6 * np.mean(np.abs(mended) > 4.0)
