"""A pulley under a rig with no symmetry to hide behind, for the tests of transport and their reference."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from burrscan.arrays import Floats, Floats32
from burrscan.rig import View
from scenes.pose import PoseSpec
from scenes.rig import RigSpec
from scenes.transport.optics import Optics
from scenes.transport.world import wheel_mesh
from scenes.wheel import Wheel, build_wheel, load_wheel

FINISHES = {"ground": {"alpha": 0.2}, "turned": {"alpha_u": 0.1, "alpha_v": 0.35}}
RUNS = 24
"""Independent images of direct light on either side."""


def pulley() -> Wheel:
    """Grooves that light each other."""
    return build_wheel(load_wheel("grooved_pulley"), facet_error_mm=0.02)


def pose(spec: RigSpec) -> Floats:
    return PoseSpec(elevation_deg=12.0, roll_deg=20.0).T_camera_part(
        standoff_mm=spec.standoff_mm, middle_z_mm=0.0
    )


def bsdf(finish: str) -> dict[str, Any]:
    conductor = {"type": "roughconductor", "distribution": "ggx", "eta": 1.5, "k": 7.0, **FINISHES[finish]}
    return {"type": "twosided", "conductor": conductor}


def uneven(spec: RigSpec) -> Optics:
    """A rig with no symmetry to hide behind: shifted principal points, a rolled projector."""
    rig = spec.rig()
    camera = replace(rig.camera, cx=rig.camera.cx + 4.3, cy=rig.camera.cy - 2.8)
    projector = replace(rig.projector, cx=rig.projector.cx - 3.4, cy=rig.projector.cy + 5.25)
    return Optics(replace(rig, camera=camera, projector=projector), spec.standoff_mm)


def patterns(view: View) -> Floats32:
    """White, a sine of 16 pixels, random blocks, one Gray-code-like stripe pattern."""
    rng = np.random.default_rng(4)
    column, row = np.arange(view.width), np.arange(view.height)
    sine = 0.5 + 0.5 * np.sin(2.0 * np.pi * column / 16.0)
    blocks = rng.random((view.height // 4 + 1, view.width // 4 + 1))[row[:, None] // 4, column // 4]
    stripes = (column // 8 + row[:, None] // 16) % 2
    return np.stack(
        [np.ones(view.shape), np.broadcast_to(sine, view.shape), blocks, stripes.astype(float)]
    ).astype(np.float32)


def stripes_on(mi: Any, finish: str) -> tuple[Any, Any, Optics, Floats32]:
    """The pulley's mesh, a scene of it, the rig and the patterns that are compared with stock Mitsuba."""
    spec = RigSpec(scale=0.15)
    optics = uneven(spec)
    mesh = wheel_mesh(mi, pulley(), pose(spec), bsdf(finish))
    return mesh, mi.load_dict({"type": "scene", "wheel": mesh}), optics, patterns(optics.rig.projector)


def blocks(images: Floats32) -> Floats:
    """Means over 16 × 16 pixels of (runs, frames, h, w) images."""
    runs, frames, h, w = images.shape
    size = 16
    cut = images[:, :, : h // size * size, : w // size * size].astype(float)
    return np.asarray(cut.reshape(runs, frames, h // size, size, w // size, size).mean(axis=(3, 5)))
