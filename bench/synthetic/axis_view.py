"""One noisy view of a part from anywhere, with its true axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.synthetic.axis_parts import FAMILIES
from bench.synthetic.depth_view import posed_view
from bench.synthetic.revolution import RevolutionScan

REACHES_PX = (0.0, 0.0, 1.5, 4.0, 10.0)
"""Of the noise, drawn alike; two in five views have noise of each pixel's own."""
NOISE = (0.0005, 0.002)
"""Least and largest, of the part's size; their logarithm is drawn evenly."""


@dataclass(frozen=True)
class PartView:
    """A view, its truth, and how far its noise reaches, in pixels."""

    scan: RevolutionScan
    reach_px: float


def part_view(family: str, number: int, *, seed: int) -> PartView:
    """The ``number``-th view of a family of :data:`bench.synthetic.axis_parts.FAMILIES`.

    The same part, direction, noise and pose for the same seed.
    """
    identity = (list(FAMILIES).index(family), number, seed)
    rng = np.random.default_rng(identity)
    vertices, faces = FAMILIES[family](rng)
    low, high = np.log10(NOISE)
    sigma = float(np.ptp(vertices, axis=0).max()) * float(10.0 ** rng.uniform(low, high))
    reach_px = float(rng.choice(REACHES_PX))
    points, triangles, pose = posed_view(
        vertices, faces, rng, sigma=sigma, reach_px=reach_px, seed=(*identity, 1)
    )
    return PartView(RevolutionScan(points, triangles, pose, sigma), reach_px)
