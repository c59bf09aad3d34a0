"""Light in a scene: whatever turns projected patterns into what the camera's pixels receive.

Two things do: the transport traced once (:class:`scenes.transport.matrix.LightTransport`), and, where no
vectorised renderer runs, stock Mitsuba rendering pattern by pattern (:class:`StockLight`).
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from burrscan.arrays import Floats32
from scenes.transport.hits import Hits
from scenes.transport.optics import Optics
from scenes.transport.stock import stock_ambient, stock_image


class Light(Protocol):
    """Projected light to camera light, and what it says of each camera pixel. All arrays are (h, w)."""

    @property
    def ambient(self) -> Floats32:
        """Light under a uniform surround of radiance 1."""

    @property
    def u_px(self) -> Floats32:
        """Projector column, weighted by the direct light of the pixel's footprint."""

    @property
    def v_px(self) -> Floats32:
        """Projector row, likewise."""

    @property
    def spread_px(self) -> Floats32:
        """Standard deviation of the projector column over the footprint."""

    @property
    def white_direct(self) -> Floats32:
        """Direct light under full white."""

    @property
    def white_indirect(self) -> Floats32:
        """Interreflected light under full white."""

    def relight(self, light: Floats32) -> Floats32:
        """Camera light (F, h, w) under projected light (F, H, W)."""


@dataclass(frozen=True)
class StockLight:
    """Stock Mitsuba, one rendering per pattern; its noise is new in each. Footprints are taken as points."""

    ambient: Floats32
    u_px: Floats32
    v_px: Floats32
    spread_px: Floats32
    white_direct: Floats32
    white_indirect: Floats32
    render: Callable[[Floats32], Floats32]

    def relight(self, light: Floats32) -> Floats32:
        """Camera light (F, h, w) under projected light (F, H, W)."""
        return self.render(light)


def stock_light(
    mi: Any,
    mesh: Any,
    optics: Optics,
    hits: Hits,
    *,
    samples: int,
    bounces: int,
    seed: int,
) -> StockLight:
    """Render a scene by stock Mitsuba, pattern by pattern.

    Raises
    ------
    InputError
        When the rig needs more than stock Mitsuba has.

    """
    seeds = itertools.count(seed)

    def render(light: Floats32, depth: int = bounces) -> Floats32:
        frames = [
            stock_image(mi, mesh, optics, frame, samples=samples, bounces=depth, seed=next(seeds))
            for frame in light
        ]
        return np.stack(frames)

    white = np.ones((1, *optics.rig.projector.shape), np.float32)
    direct = render(white, 1)[0]
    uv = np.where((direct > 0.0)[..., None], optics.rig.correspond(hits.points_mm), np.nan)
    slopes = np.gradient(uv[..., 0])
    return StockLight(
        ambient=stock_ambient(mi, mesh, optics, samples=samples, bounces=max(bounces - 1, 1), seed=seed),
        u_px=uv[..., 0].astype(np.float32),
        v_px=uv[..., 1].astype(np.float32),
        spread_px=(np.hypot(*slopes) / np.sqrt(12.0)).astype(np.float32),
        white_direct=direct,
        white_indirect=np.maximum(render(white)[0] - direct, 0.0),
        render=render,
    )
