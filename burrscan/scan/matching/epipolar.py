"""Where in the projector a camera pixel can possibly look: its epipolar curve."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from burrscan.arrays import Floats32
from burrscan.rig import NO_DISTORTION, Rig, View
from burrscan.triangulation import camera_rays

_NEAREST_BASELINES = 0.5
"""Depth in baselines: nearer, a camera and a projector side by side hardly see the same."""
_FARTHEST_BASELINES = 1e4
"""Depth in baselines: beyond, a point's column moves by focal length over 1e4, a fraction of a pixel."""
_CURVED_NODES = 9
"""Of a curve that the projector's lens bends, even in inverse depth; a straight line needs two."""


def epipolar_nodes(rig: Rig) -> Floats32:
    """Nodes (h, w, n, 2) of every pixel's curve as (column, row), from near to far, columns rising.

    Without lens distortion the curve is straight and has two nodes; otherwise it is a polyline in even steps
    of inverse depth, from half a baseline to ten thousand. NaN where a node is behind the projector.
    O(pixels · nodes); remembered per rig.
    """
    pose = tuple(np.asarray(rig.T_projector_camera).ravel().tolist())
    nodes: Floats32 = _nodes(rig.camera, rig.projector, pose)
    return nodes


@lru_cache(maxsize=2)
def _nodes(camera: View, projector: View, pose: tuple[float, ...]) -> Floats32:
    rig = Rig(camera, projector, np.array(pose).reshape(4, 4))
    straight = projector.distortion == NO_DISTORTION
    nearest, farthest = _NEAREST_BASELINES * rig.baseline_mm, _FARTHEST_BASELINES * rig.baseline_mm
    depths = 1.0 / np.linspace(1.0 / nearest, 1.0 / farthest, 2 if straight else _CURVED_NODES)
    rays = camera_rays(camera)
    nodes = np.stack([rig.correspond(rays * z) for z in depths], axis=-2).astype(np.float32)
    if np.nanmedian(nodes[..., -1, 0] - nodes[..., 0, 0]) < 0.0:
        nodes = nodes[..., ::-1, :]
    nodes = np.ascontiguousarray(nodes)
    nodes.flags.writeable = False
    return nodes
