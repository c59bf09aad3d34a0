"""Cameras zoomed on a burr, and stock Mitsuba's interreflected light there: a reference pixel by pixel."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Bools, Floats, Floats32
from scenes.finish import FinishSpec, finish_bsdf
from scenes.pose import PoseSpec
from scenes.rig import RigSpec
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics
from scenes.transport.stock import stock_images
from scenes.transport.trace import trace
from scenes.transport.world import wheel_mesh
from scenes.wheel import AxialRidge, BurrSpec, Nick, RimBurr, WheelSpec, build_wheel

RUNS, SAMPLES = 16, 256
"""Of the reference: 4096 paths a pixel, their scatter known from 16 independent runs."""
DIRECT_SAMPLES = 32
"""Of the direct light in each run: where both are compared its variance is a millionth of the other's."""
DRUM = WheelSpec("drum", ((-30.0, 20.0), (-30.0, 70.0, 1.0), (30.0, 70.0, 1.0), (30.0, 20.0)))
GROOVED = WheelSpec(
    "grooved",
    (
        (-30.0, 20.0),
        (-30.0, 70.0, 1.0),
        (-6.0, 70.0, 0.5),
        (-5.0, 58.0, 1.0),
        (5.0, 58.0, 1.0),
        (6.0, 70.0, 0.5),
        (30.0, 70.0, 1.0),
        (30.0, 20.0),
    ),
)
_TURNED = FinishSpec(texture="turned", alpha_along=0.06, alpha_across=0.22)


@dataclass(frozen=True)
class Zoom:
    """What the camera looks at: a burr of a wheel, in a finish, at the default rig's scale."""

    wheel: WheelSpec
    burr: BurrSpec
    finish: FinishSpec
    roll_deg: float = 0.0
    elevation_deg: float = 8.0
    at_mm: tuple[float, float, float] | None = None


ZOOMS = {
    "ridge-polished": Zoom(DRUM, AxialRidge(-25.0, 2.0, 2.0, -10.0, 12.0), FinishSpec(alpha=0.07)),
    "ridge-lying-ground": Zoom(
        DRUM, AxialRidge(15.0, 1.5, 2.0, -10.0, 12.0), FinishSpec(alpha=0.18), roll_deg=80.0
    ),
    "ridge-turned": Zoom(DRUM, AxialRidge(10.0, 1.5, 2.0, -10.0, 12.0), _TURNED),
    "rim-ground": Zoom(DRUM, RimBurr(5.0, 40.0, 1.5, 1.5, 2), FinishSpec(alpha=0.2), elevation_deg=25.0),
    "nick-chrome": Zoom(DRUM, Nick(12.0, 1.5, 2.5, -10.0, 12.0), FinishSpec(metal="chrome", alpha=0.1)),
    "groove-polished": Zoom(
        GROOVED,
        AxialRidge(-60.0, 1.5, 2.0, 8.0, 20.0),
        FinishSpec(alpha=0.1),
        roll_deg=85.0,
        elevation_deg=4.0,
        at_mm=(58.5, 0.0, 4.0),
    ),
}


@dataclass(frozen=True)
class Reference:
    """Stock Mitsuba's white image of a scene: direct light, mean of the interreflected and its variance."""

    direct: Floats
    mean: Floats
    variance: Floats


@dataclass(frozen=True)
class Compared:
    """A scene traced and rendered: our transport, and the reference of the interreflected light.

    ``mean`` and ``variance`` (h, w) of the reference's mean; ``direct`` (h, w) of stock Mitsuba; ``other`` is
    another tracing, which only says what pixels are compared: chosen by the light of one side they would be
    chosen by its luck. ``shift_px`` (h, w) of stripes against the reference's; ``own_shift_px`` and
    ``own_white`` against a third tracing's stripes and white image. NaN without stripes.
    """

    light: LightTransport
    other: LightTransport
    mean: Floats
    variance: Floats
    direct: Floats
    shift_px: Floats
    own_shift_px: Floats
    own_white: Floats

    @property
    def compared(self) -> Bools:
        """Pixels with interreflected more than a fifth of the direct light, and any light to speak of."""
        bright = np.percentile(self.direct[self.direct > 0.0], 99.0)
        strong = self.other.white_indirect > np.maximum(0.2 * self.direct, 3e-4 * bright)
        return np.asarray(strong & (self.variance > 0.0))

    def z(self, indirect: Floats32 | Floats, sigma: Floats32 | Floats) -> Floats:
        """(h, w) error of an image of interreflected light over both standard errors; NaN elsewhere."""
        with np.errstate(divide="ignore", invalid="ignore"):
            z = (indirect - self.mean) / np.sqrt(sigma.astype(float) ** 2 + self.variance)
        return np.where(self.compared, z, np.nan)


def optics_on(point_mm: Floats, *, shape: tuple[int, int], scale: float) -> Optics:
    """The default rig with the camera's raster cut down to ``shape`` about a point of the camera frame."""
    spec = RigSpec(scale=scale)
    rig = spec.rig()
    camera = rig.camera
    x, y = (
        camera.fx * point_mm[0] / point_mm[2],
        camera.fy * point_mm[1] / point_mm[2],
    )
    height, width = shape
    cut = replace(camera, width=width, height=height, cx=(width - 1) / 2.0 - x, cy=(height - 1) / 2.0 - y)
    return Optics(replace(rig, camera=cut), spec.standoff_mm)


class Rendered:
    """A zoomed scene, ready to be traced and to be rendered by stock Mitsuba.

    Parameters
    ----------
    mi
        The activated vectorised Mitsuba module.
    zoom
        The scene.
    shape
        Rows and columns of the camera.
    scale
        Of the rig.

    """

    def __init__(self, mi: Any, zoom: Zoom, *, shape: tuple[int, int] = (40, 48), scale: float = 1.0) -> None:
        wheel = build_wheel(zoom.wheel, [zoom.burr])
        pose = PoseSpec(elevation_deg=zoom.elevation_deg, roll_deg=zoom.roll_deg)
        T = pose.T_camera_part(standoff_mm=600.0, middle_z_mm=0.0)
        crest = wheel.burrs[0].ridge_mm
        point = np.array(zoom.at_mm) if zoom.at_mm else crest[len(crest) // 2]
        self.optics = optics_on(T[:3, :3] @ point + T[:3, 3], shape=shape, scale=scale)
        self._mi, self._mesh = mi, wheel_mesh(mi, wheel, T, finish_bsdf(zoom.finish, channels="mono"))
        self._bare = mi.load_dict({"type": "scene", "wheel": self._mesh})

    def traced(self, seed: int = 0) -> LightTransport:
        """Our transport."""
        return trace(self._mi, self._bare, self.optics, seed=seed)

    def reference(self, samples: int = SAMPLES) -> Reference:
        """Stock Mitsuba's light, with and without interreflections, ``samples`` paths in each run."""
        white = np.ones((1, *self.optics.rig.projector.shape), np.float32)
        (whole,), (direct,) = (
            self.stock(white, 3, samples=samples),
            self.stock(white, 1, samples=DIRECT_SAMPLES),
        )
        return Reference(
            direct.mean(axis=0),
            whole.mean(axis=0) - direct.mean(axis=0),
            (whole.var(axis=0, ddof=1) + direct.var(axis=0, ddof=1)) / RUNS,
        )

    def stock(self, light: Floats32, bounces: int, *, samples: int = SAMPLES) -> Floats:
        """(frames, runs, h, w) images by stock Mitsuba under (frames, H, W) patterns."""
        seeds = range(1000, 1000 + RUNS)
        images = [
            stock_images(
                self._mi, self._mesh, self.optics, frame, samples=samples, bounces=bounces, seeds=seeds
            )
            for frame in light
        ]
        return np.stack(images).astype(float)


def compare(
    rendered: Rendered,
    *,
    known: Reference | None = None,
    stripes_px: float | None = None,
    samples: int = SAMPLES,
) -> Compared:
    """Trace a zoomed scene, and hold it against stock Mitsuba.

    Parameters
    ----------
    rendered
        The scene.
    known
        Its reference, where it was rendered before.
    stripes_px
        Period of the stripes that are compared too, in three steps; None for white alone.
    samples
        Paths of each run of the reference.

    """
    known = known or rendered.reference(samples)
    traced, other = rendered.traced(), rendered.traced(seed=1)
    shift_px = own_shift_px = own_white = np.full(known.mean.shape, np.nan)
    if stripes_px is not None:
        third = rendered.traced(seed=2)
        own_white = (traced.white_indirect - third.white_indirect).astype(float)
        stripes = _stripes(rendered.optics, stripes_px)
        stock = rendered.stock(stripes, 3, samples=samples).mean(axis=1)
        ours = _phasor(traced.relight(stripes))
        shift_px, own_shift_px = (
            np.angle(ours * np.conj(_phasor(one))) * stripes_px / (2.0 * np.pi)
            for one in (stock, third.relight(stripes))
        )
    return Compared(
        traced, other, known.mean, known.variance, known.direct, shift_px, own_shift_px, own_white
    )


def _stripes(optics: Optics, period_px: float) -> Floats32:
    """Three steps of a sine along the columns, (3, H, W)."""
    turns = np.arange(optics.rig.projector.width) / period_px + np.arange(3)[:, None] / 3.0
    frames = (0.5 + 0.5 * np.cos(2.0 * np.pi * turns)).astype(np.float32)
    return np.repeat(frames[:, None], optics.rig.projector.height, axis=1)


def _phasor(images: Floats32 | Floats) -> NDArray[np.complex128]:
    return np.asarray(np.tensordot(np.exp(2j * np.pi * np.arange(3) / 3.0), images, axes=1))
