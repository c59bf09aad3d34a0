"""Noise added to a scan, to see what a scanner as noisy as the paper's would have shown."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

PAPER_MM = 1.0
"""The paper's own word: "the noise level is in the order of magnitude of 1 mm" (section 3.2)."""


def along_rays(vertices_mm: Floats, sigma_mm: float, *, seed: int = 5) -> Floats:
    """Vertices (V, 3) in the camera frame, each moved along its camera ray by independent Gaussian noise."""
    ray = vertices_mm / np.linalg.norm(vertices_mm, axis=1)[:, None]
    return np.asarray(vertices_mm + sigma_mm * np.random.default_rng(seed).normal(size=(len(ray), 1)) * ray)
