"""How finely a lens that blurs must be sampled for the light of single pixels to be right."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from burrscan.arrays import Floats
from burrscan.pose import placed
from scenes.transport.hits import centre_hits
from scenes.transport.optics import Optics

_POINTS_PER_PX2 = 9.0
"""Samples per squared projector pixel of the blur circle: what the finest stripes (6.5 px) keep of their
modulation is then 1 to 3 % off in a pixel."""
_LEAST, _MOST = 64, 256
"""Samples of a pixel: fewer points of a net in six dimensions are spread badly over two of them (7 % off in a
circle of one pixel with 16, 0.6 % with 64); 256 are enough for a circle of 6 px, in wider ones the finest
stripes are hardly modulated."""
_NEARLY_ALL = 95.0
"""Percentile of the pixels' blur that is sampled as finely as that."""


def direct_samples(mi: Any, scene: Any, optics: Optics, *, least: int) -> int:
    """Samples of a pixel's direct light, a power of two: ``least``, or more where lenses blur.

    Parameters
    ----------
    mi, scene, optics
        As of :func:`scenes.transport.trace.trace`.
    least
        Without blur; a power of two.

    Notes
    -----
    O(pixels) rays.

    """
    if not (optics.camera_aperture_mm or optics.projector_aperture_mm):
        return least
    points = centre_hits(mi, scene, optics).points_mm
    points = points[np.isfinite(points[..., 2])]
    if not len(points):
        return least
    circle_px = float(np.percentile(circles_px(optics, points), _NEARLY_ALL))
    wanted = _POINTS_PER_PX2 * 0.25 * np.pi * circle_px**2
    more = 1 << math.ceil(math.log2(max(wanted, _LEAST)))
    return max(least, min(more, _MOST))


def circles_px(optics: Optics, points_mm: Floats) -> Floats:
    """(N,) diameters of the blur circles at points (N, 3), camera frame, of both lenses together.

    In projector pixels; squares add up. A thin lens: aperture times focal length times the difference of the
    inverse distances of what is seen and of what is in focus.
    """
    near = points_mm[:, 2]
    far = placed(optics.rig.T_projector_camera, points_mm)[:, 2]
    seen = optics.camera_aperture_mm * np.abs(1.0 - near / optics.camera_focus_mm)  # on the part, mm
    lit = optics.projector_aperture_mm * np.abs(1.0 - far / optics.projector_focus_mm)
    return np.asarray(np.hypot(seen, lit) * optics.rig.projector.fx / far)
