"""One view of a rod with a burr of 1 mm at 8 degrees: a mesh that `detect` answers in a third of a second."""

from __future__ import annotations

import numpy as np
import trimesh

from bench.synthetic.depth_view import single_view
from bench.synthetic.ordinary_parts import closed, turned
from burrscan.arrays import Floats


def rod_view() -> trimesh.Trimesh:
    """80 mm long and thick, about the z axis, seen along -x; noise of 0.01 mm."""

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        tent = np.clip(1.0 - np.abs(angle - np.radians(8.0)) * 40.0 / 1.5, 0.0, None)
        return np.asarray(1.0 + tent / 40.0 * (r > 39.0) * (np.abs(z) < 20.0))

    outline = closed([(-40.0, 0.0), (-40.0, 40.0), (40.0, 40.0), (40.0, 0.0)])
    part = turned(outline, around=1440, lift=lift)
    seen = single_view(*part, np.array([-1.0, 0.0, 0.0]), pixels=120, sigma=0.01, seed=1)
    return trimesh.Trimesh(*seen, process=False)
