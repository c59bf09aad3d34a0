"""Where an axis lies of which a flat face is nearly all that was seen: its bore and its rim decide."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import closed, turned
from burrscan.arrays import Floats
from burrscan.axis.fitting.fit import Fit, refine
from burrscan.axis.fitting.scales import thickness_of, unlikelihood
from burrscan.axis.points.cloud import canonical_cloud, voxel_moments
from burrscan.axis.profile import MOST_ROUND, _annealed, likeliest
from tests.tiers import some_of

_OUTLINE = [(-6.0, 9.0), (6.0, 9.0), (6.3, 9.3), (6.3, 45.0), (5.8, 45.5), (-6.0, 45.5)]
_TOP = np.array([0.0, 0.0, 6.3])


@pytest.fixture(scope="module")
def plate() -> Floats:
    """Two thirds of it, seen 20 degrees from its end; noise of 0.01 mm."""
    tilt = np.radians(20.0)
    view = -np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    points, _ = single_view(*turned(closed(_OUTLINE)), view, pixels=260, sigma=0.01, seed=1)
    return np.asarray(points[points[:, 0] < 20.0])


@some_of("off_mm", [(1.0, 0.0), (0.0, -2.0), (3.0, 3.0), (-5.0, 1.0)])
def test_noise_that_shrinks_leads_to_the_axis_from_afar(plate: Floats, off_mm: tuple[float, float]) -> None:
    """Noise as small as the face's leaves the bore out, and the axis where the start was."""
    cloud = canonical_cloud(plate, None)
    _, rows = voxel_moments(cloud.points, cloud.weights)
    means, counts = rows[:, 1:4] / rows[:, :1], rows[:, 0] / rows[:, 0].mean()
    direction = cloud.rotation.T @ np.array([0.0, 0.0, 1.0])
    start = cloud.rotation.T @ (_TOP + np.array([*off_mm, 0.0]) - cloud.mean_mm) / cloud.scale_mm

    def off(fit: Fit) -> float:
        place = cloud.mean_mm + cloud.scale_mm * (cloud.rotation @ fit.place)
        return float(np.linalg.norm(np.cross(place - _TOP, cloud.rotation @ fit.frame[:, 2])))

    plain = refine(means, counts, direction, start, blur=0.02, steps=8, sigma=3e-4)
    assert off(plain) > 0.2
    assert off(_annealed(means, plain)) < 0.05


def test_where_the_round_side_fits_it_decides(plate: Floats) -> None:
    points = plate / 30.0
    fit = refine(points, np.empty(0), np.array([0.0, 0.0, 1.0]), _TOP / 30.0, blur=0.02, steps=2)
    seen = thickness_of(points, fit)
    told = [
        replace(seen, telling=100.0, inliers=100.0 * share, log_radius=seen.log_radius - more)
        for share, more in ((MOST_ROUND, 0.0), (1.0, 0.1), (0.1, 0.2))
    ]
    assert np.all(np.diff([unlikelihood(one, fit) for one in told]) < 0.0)
    assert likeliest([(fit, one) for one in told])[1] is told[1]
    assert likeliest([(fit, one) for one in told[2:]])[1] is told[2]
