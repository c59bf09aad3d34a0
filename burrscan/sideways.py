"""Rigs whose baseline runs along the projector's columns: its raster, counted a quarter turn on.

Scans code columns and triangulation reads them. Where the projector stands above or below its camera, depth
moves light from row to row, and columns say nothing of it. The same projector, laid on its side, has columns
where it had rows: the same pixels on the same rays by other numbers, ``(u, v)`` becomes ``(v, W - 1 - u)``.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Image, Levels
from burrscan.correspondence import Correspondence
from burrscan.rig import Rig
from burrscan.scanner import PassThrough, Patterns, Scanner

_CLEARLY = 1.2
"""By how much the baseline must run along the columns rather than across them: a rig at 45 degrees, which
either would do for, stays as it is, and an error of calibration does not decide it."""
_QUARTER = np.array([[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""The projector's frame to that of the projector on its side: x' = y, y' = -x."""


def runs_along_columns(rig: Rig) -> bool:
    """Whether the baseline lies along the projector's columns: rows tell depth then."""
    across, along = np.abs(rig.T_projector_camera[:2, 3])
    return bool(along > _CLEARLY * across)


def quarter_turned(rig: Rig) -> Rig:
    """The same rig with its projector's raster laid on its side."""
    p = rig.projector
    k1, k2, p1, p2, k3 = p.distortion
    view = replace(
        p,
        width=p.height,
        height=p.width,
        fx=p.fy,
        fy=p.fx,
        cx=p.cy,
        cy=p.width - 1.0 - p.cx,
        distortion=(k1, k2, -p2, p1, k3),
    )
    return Rig(rig.camera, view, _QUARTER @ rig.T_projector_camera)


def across_columns(rig: Rig) -> Rig:
    """The rig itself where its baseline runs across its projector's columns, else the quarter-turned one."""
    return quarter_turned(rig) if runs_along_columns(rig) else rig


def on_its_side(frames: Levels) -> Levels:
    """Frames (F, H, W, ...) of the projector in the raster of the one on its side, (F, W, H, ...); a view."""
    turned: Levels = frames.swapaxes(1, 2)[:, ::-1]
    return turned


def along_baseline(correspondence: Correspondence, rig: Rig) -> tuple[Correspondence, Rig]:
    """Columns and rows by the raster whose columns tell depth, and the rig of that raster.

    Both stay as they are where the baseline runs across the columns, and where rows were not coded.
    """
    v_px, sigma_v_px = correspondence.v_px, correspondence.sigma_v_px
    if not runs_along_columns(rig) or v_px is None or sigma_v_px is None:
        return correspondence, rig
    turned = replace(
        correspondence,
        u_px=v_px,
        sigma_u_px=sigma_v_px,
        v_px=np.float32(rig.projector.width - 1) - correspondence.u_px,
        sigma_v_px=correspondence.sigma_u_px,
    )
    return turned, quarter_turned(rig)


class _OnItsSide(PassThrough):
    """A scanner whose projector lies on its side."""

    @property
    def rig(self) -> Rig:
        """The quarter-turned rig."""
        return quarter_turned(self._scanner.rig)

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show the patterns as the projector stands, and capture."""
        upright = patterns.frames[:, ::-1].swapaxes(1, 2)
        return self._scanner.capture(Patterns(upright, patterns.names), exposure_ms)


def by_columns(scanner: Scanner) -> Scanner:
    """A scanner whose columns tell depth: itself, or the same with its projector laid on its side."""
    return _OnItsSide(scanner) if runs_along_columns(scanner.rig) else scanner
