"""From a scene to a scanner that looks at it, and the truth."""

from __future__ import annotations

import dataclasses
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from burrscan.arrays import Floats
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.scanner import Scanner
from burrscan.sideways import across_columns, runs_along_columns
from scenes.colour import BANDS, MONO, ColourScanner
from scenes.finish import Channels
from scenes.light import Light, stock_light
from scenes.renderer import activate
from scenes.scanner import SimulatedScanner
from scenes.scene import SceneSpec, content_hash
from scenes.stores import Store
from scenes.surface.parts import SurfacePart, surface_parts, zone_ends_mm
from scenes.transport.hits import Hits, centre_hits
from scenes.transport.optics import Optics
from scenes.transport.profile import PixelProfile
from scenes.transport.store import stored
from scenes.transport.trace import trace
from scenes.transport.world import wheel_shapes
from scenes.truth import Truth, truth_of
from scenes.wheel import Cut, Wheel, build_wheel


@dataclass(frozen=True)
class Simulation:
    """A scene ready to be scanned.

    ``scanner()`` gives a fresh scanner; fresh scanners of one simulation see the same light and the same
    noise. A scene in colour has the light of its three ``bands``; ``light`` and ``truth`` are the green's.
    """

    scene: SceneSpec
    truth: Truth
    light: Light
    identity: tuple[int, ...]
    timings_s: Mapping[str, float]
    bands: tuple[Light, ...] = ()

    def scanner(self, *, sheets: tuple[CameraSheet, ProjectorSheet] | None = None) -> Scanner:
        """A scanner that has taken no picture yet, told the true data sheets or others."""
        told = self.scene.calibration.told(self.scene.rig.rig())
        if self.bands:
            return ColourScanner(
                self.bands, scene=self.scene, rig=told, identity=self.identity, sheets=sheets
            )
        return SimulatedScanner(self.light, scene=self.scene, rig=told, identity=self.identity, sheets=sheets)


def simulate(
    scene: SceneSpec,
    *,
    identity: tuple[int, ...] = (0,),
    cache_dir: Path | Store | None = None,
    milled: tuple[Cut, ...] = (),
) -> Simulation:
    """Build a scene, trace its light once, and gather the truth.

    Parameters
    ----------
    scene
        The scene.
    identity
        Identity of the case: fixes every noise stream.
    cache_dir
        Where traced transports are kept for the next time; None keeps none.
    milled
        Passes of a mill that has been over the wheel.

    Raises
    ------
    InputError
        When the scene cannot be built, or needs a renderer that this machine lacks.

    """
    mi = activate()
    clock = [time.perf_counter()]
    wheel = build_wheel(scene.wheel, scene.burrs, cuts_mm=zone_ends_mm(scene.zone), milled=milled)
    parts = surface_parts(wheel, scene.finish, burrs=scene.burrs, zones=scene.zone, blemishes=scene.blemish)
    clock.append(time.perf_counter())
    optics = optics_of(scene)
    pose = scene.pose.T_camera_part(standoff_mm=scene.rig.standoff_mm, middle_z_mm=_middle_z_mm(wheel))
    bands: dict[Channels, tuple[Light, Hits]] = {}
    for band in BANDS if scene.channels == "rgb" else MONO:
        shapes = wheel_shapes(mi, wheel, pose, parts, channels=band)
        bands[band] = _light(mi, shapes, parts, optics, scene, band, cache_dir, milled)
    light, hits = bands["green" if scene.channels == "rgb" else "mono"]
    clock.append(time.perf_counter())
    truth = truth_of(scene, wheel=wheel, rig=optics.rig, T_camera_part=pose, hits=hits, light=light)
    clock.append(time.perf_counter())
    names = ("wheel", "transport", "truth")
    timings = {name: b - a for name, a, b in zip(names, clock, clock[1:], strict=False)}
    return Simulation(
        scene=scene,
        truth=truth,
        light=light,
        identity=identity,
        timings_s=timings,
        bands=tuple(one for one, _ in bands.values()) if scene.channels == "rgb" else (),
    )


def optics_of(scene: SceneSpec) -> Optics:
    """The true rig of a scene, columns across the baseline (:mod:`burrscan.sideways`), with its lenses."""
    return Optics(
        rig=across_columns(scene.rig.rig()),
        standoff_mm=scene.rig.standoff_mm,
        camera_aperture_mm=scene.rig.camera.aperture_mm,
        projector_aperture_mm=scene.rig.projector.aperture_mm,
        camera_focus_mm=scene.rig.camera.focus_mm or scene.rig.standoff_mm,
        projector_focus_mm=scene.rig.projector.focus_mm or scene.rig.standoff_mm,
        profile=PixelProfile(fill=scene.projector.fill, blur_px=scene.projector.blur_px),
    )


def _light(
    mi: Any,
    shapes: dict[str, Any],
    parts: tuple[SurfacePart, ...],
    optics: Optics,
    scene: SceneSpec,
    band: Channels,
    cache_dir: Path | Store | None,
    milled: tuple[Cut, ...],
) -> tuple[Light, Hits]:
    render = scene.render
    bare = mi.load_dict({"type": "scene", **shapes})
    hits = centre_hits(mi, bare, optics, faces_of={part.name: part.faces for part in parts})
    if str(mi.variant()).startswith("scalar"):
        return stock_light(
            mi, shapes, optics, hits, samples=render.samples, bounces=render.bounces, seed=render.seed
        ), hits
    key = content_hash(
        scene.wheel,
        list(scene.burrs),
        scene.finish,
        list(scene.zone),
        list(scene.blemish),
        scene.pose,
        scene.rig,
        [scene.projector.fill, scene.projector.blur_px],
        render,
        mi.__version__,
        mi.variant(),
        *([] if band == "mono" else [band]),
        *(["lenses by nets"] if optics.camera_aperture_mm or optics.projector_aperture_mm else []),
        *(["on its side"] if runs_along_columns(scene.rig.rig()) else []),
        *map(dataclasses.asdict, milled),
    )
    transport = stored(
        cache_dir,
        key,
        lambda: trace(mi, bare, optics, **dataclasses.asdict(render)),
    )
    return transport, hits


def _middle_z_mm(wheel: Wheel) -> float:
    z: Floats = wheel.generatrix_zr_mm[:, 0]
    return float(0.5 * (z.min() + z.max()))
