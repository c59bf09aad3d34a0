"""The Cramér-Rao bound of a scan: how fine the frames that were really shown let a column be known.

Each camera pixel's expected electrons in frame f are ``t_f r (a D_f(u) + I_f) + t_f b``: exposure t, the rate
r, direct light D through the pixel's own footprint, interreflected light I. Unknown are the column u, the
direct amplitude a and the steady light b; interreflected light is taken as known, so that no decoder that has
to find it can pass the bound. With independent noise of variance σ² = mean + read noise² + quantisation the
Fisher information is ``Σ_f ∇μ ∇μᵀ / σ²`` (Kay, Fundamentals of Statistical Signal Processing I, section 3.9,
without its variance term, below a percent here), and the bound is the square root of its inverse's uu entry.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats, Floats32, Image, Ints
from burrscan.devices import ProjectorSheet
from burrscan.scanner import PassThrough, Patterns, Scanner
from scenes.scene import SceneSpec
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows

_FRAMES_AT_ONCE = 12
_DERIVATIVE = ((1, 45.0 / 60.0), (2, -9.0 / 60.0), (3, 1.0 / 60.0))
"""Weights of a central difference of sixth order: exact to 1 % for sines of down to 5 px."""


@dataclass(frozen=True)
class Shot:
    """One call of :meth:`burrscan.scanner.Scanner.capture`."""

    patterns: Patterns
    exposure_ms: float


class WatchedScanner(PassThrough):
    """Pass pictures through and remember what was shown and for how long, in ``shots``."""

    def __init__(self, scanner: Scanner) -> None:
        super().__init__(scanner)
        self.shots: list[Shot] = []

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture, and remember."""
        self.shots.append(Shot(patterns, exposure_ms))
        return self._scanner.capture(patterns, exposure_ms)


def bound_px(light: LightTransport, scene: SceneSpec, shots: Sequence[Shot], *, every: int = 8) -> Floats32:
    """Cramér-Rao bound (h, w) of the projector column for the frames that were shown.

    Parameters
    ----------
    light
        The traced transport.
    scene
        Electronics and surround; flicker, vibration and vignetting are left out.
    shots
        What was shown. A frame whose mean fills the well tells nothing.
    every
        Only every so many rows of the camera are computed; the others are NaN.

    Returns
    -------
    ndarray
        Projector pixels; NaN where nothing is known.

    Notes
    -----
    O(frames · nnz / every).

    """
    height, width = light.camera_shape
    rows = np.arange(0, height, every)
    pixels = (rows[:, None] * width + np.arange(width)).ravel()
    direct = _direct_of(light, pixels)
    indirect = replace(light, direct=empty_rows(height * width))
    steady = light.ambient.ravel()[pixels].astype(float) * scene.light.ambient
    fisher = np.zeros((6, len(pixels)))
    for shone, slope, exposure_ms in _chunks(shots, scene.projector.sheet):
        _add(
            fisher,
            direct.relight(shone),
            direct.relight(slope),
            indirect.relight(shone)[:, rows].reshape(len(shone), 1, -1),
            steady=steady,
            scene=scene,
            exposure_ms=exposure_ms,
        )
    bound = np.full((height, width), np.nan, np.float32)
    bound[rows] = _inverse(fisher).reshape(len(rows), width)
    return bound


def _direct_of(light: LightTransport, pixels: Ints) -> LightTransport:
    """The direct light alone of some camera pixels, in one row."""
    part = light.direct
    counts = (part.starts[1:] - part.starts[:-1])[pixels]
    starts = np.concatenate([[0], np.cumsum(counts)])
    taken = np.repeat(part.starts[:-1][pixels] - starts[:-1], counts) + np.arange(starts[-1])
    some = SparseRows(starts, part.columns[taken], part.values[taken])
    shape = (1, len(pixels))
    nan = np.full(shape, np.nan, np.float32)
    return LightTransport(
        shape, light.projector_shape, some, empty_rows(len(pixels)), nan, nan, nan, nan, nan
    )


def _chunks(shots: Sequence[Shot], sheet: ProjectorSheet) -> Iterator[tuple[Floats32, Floats32, float]]:
    """Light and its change per column of a few frames at a time, and their exposure."""
    table = sheet.light.astype(np.float32)
    for shot in shots:
        frames = shot.patterns.frames
        plain = frames.strides[1] == 0
        for first in range(0, len(frames), _FRAMES_AT_ONCE):
            some = frames[first : first + _FRAMES_AT_ONCE]
            light = table[some[:, :1] if plain else some]
            slope = _slope(light)
            yield np.broadcast_to(light, some.shape), np.broadcast_to(slope, some.shape), shot.exposure_ms


def _slope(light: Floats32) -> Floats32:
    """Change of light per column, 0 at the very borders."""
    reach, width = len(_DERIVATIVE), light.shape[2]
    slope = np.zeros_like(light)
    inner = slope[..., reach : width - reach]
    for step, weight in _DERIVATIVE:
        ahead, behind = light[..., reach + step :], light[..., reach - step :]
        inner += np.float32(weight) * (ahead[..., : width - 2 * reach] - behind[..., : width - 2 * reach])
    return slope


def _add(
    fisher: Floats,
    direct: Floats32,
    slope: Floats32,
    indirect: Floats32,
    *,
    steady: Floats,
    scene: SceneSpec,
    exposure_ms: float,
) -> None:
    """Add some frames' information: uu, ua, ub, aa, ab, bb."""
    camera = scene.camera
    rate = camera.electrons_per_ms * exposure_ms
    dark = 1e-3 * camera.dark_current_e_per_s * exposure_ms
    sheet = camera.sheet
    for one, change, other in zip(direct, slope, indirect, strict=True):
        mean = rate * (one[0] + other[0] + steady) + dark
        variance = mean + camera.read_noise_e**2 + sheet.rounding_e2(mean)
        weight = np.where(mean < camera.full_well_e, 1.0 / variance, 0.0)
        u, a = rate * change[0].astype(float), rate * one[0].astype(float)
        fisher += weight * np.stack([u * u, u * a, u * rate, a * a, a * rate, np.full_like(a, rate * rate)])


def _inverse(fisher: Floats) -> Floats:
    """Square root of the uu entry of the inverse, NaN where there is none."""
    uu, ua, ub, aa, ab, bb = fisher
    with np.errstate(divide="ignore", invalid="ignore"):
        explained = (ua * ua * bb - 2.0 * ua * ub * ab + ub * ub * aa) / (aa * bb - ab * ab)
        left = uu - explained
        return np.where(left > 1e-9 * uu, 1.0 / np.sqrt(left), np.nan)
