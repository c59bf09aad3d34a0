"""How large a camera's pixel is on a wheel."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.generatrix.polyline import Polyline
from burrscan.rig import Rig


def pixel_mm(rig: Rig, camera_mm: Floats, line: Polyline) -> float:
    """Footprint of a pixel at the wheel's axis, in the middle of its generatrix, seen squarely.

    The wheel's surface is nearer, so that on what faces the camera a pixel's footprint is no larger.

    Parameters
    ----------
    rig
        The calibration.
    camera_mm
        (3,) the camera's centre, part frame; that frame's origin may be anywhere along the axis.
    line
        The generatrix.

    """
    z = line.nodes_mm[:, 0]
    middle = np.array([0.0, 0.0, 0.5 * float(z.min() + z.max())])
    return float(np.linalg.norm(camera_mm - middle)) / rig.camera.fx
