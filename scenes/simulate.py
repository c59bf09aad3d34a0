"""From a scene to a scanner that looks at it, and the truth."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.rig import Rig
from burrscan.scanner import Patterns
from scenes.electronics.sensor import expose
from scenes.finish import finish_bsdf
from scenes.light import Light, stock_light
from scenes.renderer import activate
from scenes.scene import SceneSpec, content_hash
from scenes.transport.hits import Hits, centre_hits
from scenes.transport.optics import Optics
from scenes.transport.profile import PixelProfile
from scenes.transport.store import stored
from scenes.transport.trace import trace
from scenes.transport.world import wheel_mesh
from scenes.truth import Truth, truth_of
from scenes.wheel import Wheel, build_wheel


class SimulatedScanner:
    """A :class:`burrscan.Scanner` in front of a simulated scene.

    Parameters
    ----------
    light
        The scene's light.
    scene
        The electronics and the surround.
    rig
        The calibration that algorithms are told.
    identity
        Fixes the noise. Pictures are counted: the n-th picture of two equal scanners has the same noise.

    """

    def __init__(self, light: Light, *, scene: SceneSpec, rig: Rig, identity: tuple[int, ...]) -> None:
        self._light = light
        self._scene = scene
        self._rig = rig
        self._identity = identity
        self._taken = 0

    @property
    def rig(self) -> Rig:
        """The calibration as the algorithm is told it."""
        return self._rig

    @property
    def camera(self) -> CameraSheet:
        """The camera's data sheet."""
        return self._scene.camera.sheet

    @property
    def projector(self) -> ProjectorSheet:
        """The projector's data sheet."""
        return self._scene.projector.sheet

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show each pattern, expose for ``exposure_ms`` and return the images, (F, h, w) DN.

        Raises
        ------
        InputError
            When the exposure is outside what the camera offers, or a pattern does not fit the projector.

        """
        shortest, longest = self.camera.exposure_range_ms
        if not shortest <= exposure_ms <= longest:
            raise InputError(
                f"exposure of {exposure_ms:g} ms is outside the camera's {shortest:g} to {longest:g}"
            )
        if patterns.frames.shape[1:] != self._rig.projector.shape:
            raise InputError(
                f"patterns of {patterns.frames.shape[1:]} do not fit a projector of "
                f"{self._rig.projector.shape}"
            )
        received = self._light.relight(_projected(patterns, self.projector))
        received += self._light.ambient * self._scene.light.ambient
        first = self._taken
        self._taken += len(patterns)
        return expose(
            received,
            camera=self._scene.camera,
            exposure_ms=exposure_ms,
            identity=self._identity,
            first_frame=first,
        )


def _projected(patterns: Patterns, projector: ProjectorSheet) -> Any:
    """Light of the patterns; frames that do not vary along the rows stay broadcast."""
    light = projector.light.astype(np.float32)
    if patterns.frames.strides[1] == 0:
        return np.broadcast_to(light[patterns.frames[:, :1]], patterns.frames.shape)
    return light[patterns.frames]


@dataclass(frozen=True)
class Simulation:
    """A scene ready to be scanned.

    ``scanner()`` gives a fresh scanner; fresh scanners of one simulation see the same light and the same
    noise.
    """

    scene: SceneSpec
    truth: Truth
    light: Light
    identity: tuple[int, ...]
    timings_s: Mapping[str, float]

    def scanner(self) -> SimulatedScanner:
        """A scanner that has taken no picture yet."""
        return SimulatedScanner(
            self.light, scene=self.scene, rig=self.scene.rig.rig(), identity=self.identity
        )


def simulate(
    scene: SceneSpec, *, identity: tuple[int, ...] = (0,), cache_dir: Path | None = None
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

    Raises
    ------
    InputError
        When the scene cannot be built, or needs a renderer that this machine lacks.

    """
    mi = activate()
    clock = [time.perf_counter()]
    wheel = build_wheel(scene.wheel, scene.burrs)
    clock.append(time.perf_counter())
    optics = optics_of(scene)
    pose = scene.pose.T_camera_part(standoff_mm=scene.rig.standoff_mm, middle_z_mm=_middle_z_mm(wheel))
    mesh = wheel_mesh(mi, wheel, pose, finish_bsdf(scene.finish, channels="mono"))
    light, hits = _light(mi, mesh, optics, scene, cache_dir)
    clock.append(time.perf_counter())
    truth = truth_of(scene, wheel=wheel, rig=optics.rig, T_camera_part=pose, hits=hits, light=light)
    clock.append(time.perf_counter())
    names = ("wheel", "transport", "truth")
    timings = {name: b - a for name, a, b in zip(names, clock, clock[1:], strict=False)}
    return Simulation(scene=scene, truth=truth, light=light, identity=identity, timings_s=timings)


def optics_of(scene: SceneSpec) -> Optics:
    """The true rig of a scene, with its lenses."""
    return Optics(
        rig=scene.rig.rig(),
        standoff_mm=scene.rig.standoff_mm,
        profile=PixelProfile(fill=scene.projector.fill, blur_px=scene.projector.blur_px),
    )


def _light(
    mi: Any, mesh: Any, optics: Optics, scene: SceneSpec, cache_dir: Path | None
) -> tuple[Light, Hits]:
    render = scene.render
    bare = mi.load_dict({"type": "scene", "wheel": mesh})
    hits = centre_hits(mi, bare, optics)
    if str(mi.variant()).startswith("scalar"):
        return stock_light(
            mi, mesh, optics, hits, samples=render.samples, bounces=render.bounces, seed=render.seed
        ), hits
    key = content_hash(
        scene.wheel, list(scene.burrs), scene.finish, scene.pose, scene.rig, scene.projector, render
    )
    transport = stored(
        cache_dir,
        key,
        lambda: trace(mi, bare, optics, samples=render.samples, bounces=render.bounces, seed=render.seed),
    )
    return transport, hits


def _middle_z_mm(wheel: Wheel) -> float:
    z: Floats = wheel.generatrix_zr_mm[:, 0]
    return float(0.5 * (z.min() + z.max()))
