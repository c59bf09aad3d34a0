"""The error budget: what each stage is given when the stages before it are replaced."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from bench.budget import budget
from burrscan.pipeline import Pipeline
from tests.bench.ideal import RIG, evidence


@pytest.mark.parametrize("brightness", [7.0, None])
def test_the_burrs_see_the_scans_light_in_every_substitution(
    monkeypatch: pytest.MonkeyPatch, brightness: float | None
) -> None:
    whole = evidence()
    light = None if brightness is None else np.full(RIG.camera.shape, brightness, np.float32)
    outcome = replace(whole.outcome, scan=replace(whole.outcome.scan, radiance=light))
    sights = []

    def inspected(*_mesh: Any, sight: Any = None, **_rest: Any) -> Any:
        sights.append(sight)
        return outcome.inspection

    monkeypatch.setattr(budget, "inspect_surface", inspected)
    monkeypatch.setattr(budget, "surface", lambda *_scan: outcome.surface)
    budget.scan_budget(replace(whole, outcome=outcome), Pipeline(), rig=RIG)
    assert len(sights) == len(budget.SUBSTITUTIONS) - 1  # the pipeline as it is was inspected before
    for sight in sights:
        assert (sight is None) == (brightness is None)
        assert sight is None or (sight.radiance == brightness).all()
