"""Where a curve ends: an edge, or a place that another part of the wheel hides."""

from __future__ import annotations

from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from burrscan.burrs.edges import View, _hidden
from burrscan.burrs.field import Field
from burrscan.generatrix.polyline import join

_HUB_MM, _RIM_MM, _LOWER_MM = 30.0, 60.0, 20.0
"""Radii of a hub and its flange, and how much lower the flange's face lies."""


def flange(radius_mm: float) -> Field:
    """Four vertices of the flange's face at one radius, all around."""
    angle = np.radians([0.0, 90.0, 180.0, 270.0])
    foot = np.tile([_LOWER_MM, radius_mm], (4, 1))
    return cast(Field, SimpleNamespace(foot=foot, normal=np.tile([-1.0, 0.0], (4, 1)), angle=angle))


@pytest.mark.parametrize("further_mm", [500.0, 5000.0])
def test_a_hub_hides_its_root_and_nothing_hides_what_is_past_a_rim(further_mm: float) -> None:
    """From the end of the axis the hub's wall is not seen, and its end face covers the flange's root."""
    line = join(
        [np.array([[0.0, 0.0], [0.0, _HUB_MM]]), np.array([[_LOWER_MM, _HUB_MM], [_LOWER_MM, _RIM_MM]])]
    )
    above = np.array([0.0, 0.0, -further_mm])
    view = View(line, np.stack([above, np.array([10.0, 0.0, -further_mm])]))
    on = np.arange(4)
    root, rim = flange(_HUB_MM + 0.5), flange(_RIM_MM - 0.5)
    assert _hidden(root, on, 1.5, view).all() != _hidden(root, on, -1.5, view).all()
    assert not _hidden(rim, on, 1.5, view).any()
    assert not _hidden(rim, on, -1.5, view).any()


def test_what_one_of_both_does_not_reach_is_hidden() -> None:
    line = join([np.array([[0.0, 0.0], [0.0, _HUB_MM]]), np.array([[_LOWER_MM, 40.0], [_LOWER_MM, _RIM_MM]])])
    above, aside = np.array([0.0, 0.0, -500.0]), np.array([-400.0, 0.0, -300.0])
    on, face = np.array([0]), flange(41.0)  # on the far side of the hub from where the projector stands
    free, shaded = (View(line, np.stack([above, other])) for other in (above, aside))
    steps = (-2.0, 2.0)
    assert not any(_hidden(face, on, step, free).any() for step in steps)
    assert any(_hidden(face, on, step, shaded).any() for step in steps)
