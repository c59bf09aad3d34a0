"""What may be left, against the formula for independent looks; and what is learnt of the metal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burrscan.cell.belief import SURE, belief_of, density_of
from burrscan.cell.chart import Chart, chart_of
from burrscan.cell.outlook import Outlook, outlook
from tests.burrscan.cell.parts import facing, generatrix, rig


def _all_shown(chart: Chart) -> Outlook:
    """A look from in front of everywhere."""
    view = outlook(chart, rig(), facing(0.0), chart.angles)
    return replace(view, shows=np.ones((2, *chart.shape)))


def test_left_is_the_chance_of_a_burr_that_every_look_missed() -> None:
    chart = chart_of(generatrix())
    view = _all_shown(chart)
    half = np.zeros(chart.shape)
    half[:, : chart.shape[1] // 2] = 1.0
    for looks in (1, 2, 3):
        belief = belief_of(chart, [(view, half)] * looks)
        share = 0.5 + 0.5 * (1.0 - SURE) ** looks
        # nothing found on the rest: the rate of an exponential mean of 2 has become one over 1/2 + the rest
        assert belief.rate(chart, burrs=2.0) == pytest.approx(1.0 / (0.5 + 1.0 - share))
        assert belief.left_in(chart, burrs=2.0) == pytest.approx(share / 1.5)


def test_left_agrees_with_burrs_thrown_at_random() -> None:
    chart = chart_of(generatrix())
    view = _all_shown(chart)
    rng = np.random.default_rng(1)
    densities = [rng.uniform(size=chart.shape) for _ in range(2)]
    belief = belief_of(chart, [(view, density) for density in densities])
    weight = np.broadcast_to(chart.area_mm2[:, None], chart.shape).ravel()
    parts: dict[int, list[bool]] = {}
    for _ in range(8000):
        # parts differ in how many burrs they have
        place = rng.choice(weight.size, size=rng.poisson(rng.exponential(2.0)), p=weight / weight.sum())
        missed = np.ones(len(place), bool)
        for density in densities:
            missed &= rng.uniform(size=len(place)) > SURE * density.ravel()[place]
        parts.setdefault(int((~missed).sum()), []).append(bool(missed.any()))
    for found in range(4):
        belief.found = np.array([found, 0.0])
        stated, count = belief.left_in(chart, burrs=2.0), len(parts[found])
        z = (np.mean(parts[found]) - stated) / np.sqrt(stated * (1.0 - stated) / count)
        assert count > 300
        assert abs(z) < 4.0


def test_burrs_lie_as_those_that_were_found() -> None:
    """What no look has shown across the burr's line is left for burrs that lie so, and for those only."""
    chart = chart_of(generatrix())
    view = _all_shown(chart)
    along = np.stack([np.ones(chart.shape), np.zeros(chart.shape)])
    belief = belief_of(chart, [(replace(view, shows=along), np.ones(chart.shape))])
    assert belief.left == pytest.approx(0.5 * (1.0 - SURE) + 0.5)
    belief.found = np.array([6.0, 0.0])
    assert belief.lines == pytest.approx([7.0 / 8.0, 1.0 / 8.0])
    assert belief.left == pytest.approx(7.0 / 8.0 * (1.0 - SURE) + 1.0 / 8.0)


def test_the_density_of_a_full_grid_is_one() -> None:
    chart = chart_of(generatrix())
    view = outlook(chart, rig(), facing(0.0), chart.angles)
    # a point per pixel of 0.5 mm, as a camera that looks along the normal would measure
    angle, z = np.meshgrid(np.arange(-0.2, 0.2, 0.5 / 80.0), np.arange(10.0, 30.0, 0.5))
    points = np.stack([80.0 * np.cos(angle), 80.0 * np.sin(angle), z], axis=-1).reshape(-1, 3)
    density = density_of(chart, points, view, px_mm=0.5)
    inside = density[5:9, [0, 1, 118, 119]]
    assert inside.min() > 0.9
    assert density[:, 50:70].max() == 0.0


def test_a_metal_that_does_not_answer_near_the_mirror_is_learnt() -> None:
    chart = chart_of(generatrix())
    view = outlook(chart, rig(), facing(0.0), chart.angles)
    dark = view.tilt_deg < 10.0
    belief = belief_of(chart, [(view, np.where(view.seen & ~dark, 1.0, 0.0))] * 3)
    answer = belief.answer(view.tilt_deg)
    assert answer[view.seen & dark].mean() < answer[view.seen & ~dark].mean() - 0.2
