"""True burrs and burrs found as places in the true part frame."""

from __future__ import annotations

import numpy as np

from bench.score.matching import Place
from burrscan.arrays import Floats
from burrscan.inspection import Burr
from burrscan.pose import placed
from scenes.wheel import TrueBurr


def along_axis_mm(T_part_found: Floats, z_found_mm: Floats) -> Floats:
    """Positions along the true axis of positions along the axis found, any shape."""
    on_axis = np.stack([np.zeros_like(z_found_mm), np.zeros_like(z_found_mm), z_found_mm], axis=-1)
    return placed(T_part_found, on_axis)[..., 2]


def true_place(burr: TrueBurr) -> Place:
    """A true burr's place; only a rim burr counts as an arc, for ridges are narrower than the tolerance."""
    return Place(
        side=burr.side,
        angle_deg=burr.angle_deg,
        arc_deg=burr.arc_deg / 2.0 if burr.kind == "rim" else 0.0,
        z_start_mm=burr.z_start_mm,
        z_end_mm=burr.z_end_mm,
        height_mm=burr.height_mm,
    )


def found_place(burr: Burr, *, T_part_camera: Floats, T_part_found: Floats) -> Place:
    """A burr found, carried to the true part frame: its middle by its pose, its extent by the axis found.

    Where a method states no pose, its angle tells the middle (the pipeline lets no burr pass that states
    both and means two places: :mod:`burrscan.burrs.agreement`).
    """
    ends = along_axis_mm(T_part_found, np.array([burr.z_start_mm.value, burr.z_end_mm.value]))
    if np.isfinite(burr.T_mesh_burr).all():
        x, y, _ = placed(T_part_camera, burr.T_mesh_burr[:3, 3])
    else:
        stated = np.radians(burr.angle_deg.value)
        x, y, _ = T_part_found[:3, :3] @ [np.cos(stated), np.sin(stated), 0.0]
    angle = float(np.degrees(np.arctan2(y, x)))
    return Place(burr.side, angle, 0.0, float(ends.min()), float(ends.max()), burr.height_mm.value)
