"""The Cramér-Rao bounds of a scan: how fine the frames that were really shown let a column be known.

Each camera pixel's expected electrons in frame f are ``t_f r (a D_f(u) + I_f) + t_f b``: exposure t, the
rate r, direct light D through the pixel's own footprint, interreflected light I. With independent noise of
variance σ² = mean + read noise² + quantisation the Fisher information of the unknowns is ``Σ_f ∇μ ∇μᵀ / σ²``
(Kay, Fundamentals of Statistical Signal Processing I, section 3.9, without its variance term, below a percent
here), and the bound is the square root of its inverse's uu entry.

Two bounds, for what a decoder may know of the interreflected light. *Known*: unknown are the column u, the
direct amplitude a and the steady light b; no decoder that has to find the rest can pass it. *Second path*:
the interreflected light is taken for one more path of unknown strength c and column w, ``I_f = c I_f(w)``;
that is what a decoder is up against that knows the shape of the second path but neither where it comes from
nor how strong it is.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Floats32, Image, Ints
from burrscan.devices import ProjectorSheet
from burrscan.scanner import PassThrough, Patterns, Scanner
from scenes.scene import SceneSpec
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows

_FRAMES_AT_ONCE = 12
"""Bounds memory: frames of a megapixel take 4 MB each, and twice for their slopes."""
_UNKNOWNS = 5  # u, a, b, c, w
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


@dataclass(frozen=True)
class Bounds:
    """Cramér-Rao bounds (h, w) of the projector column, projector pixels; NaN where nothing is known.

    ``known_px`` with the interreflected light known, ``second_path_px`` with a second path's strength and
    column unknown; never below the first.
    """

    known_px: Floats32
    second_path_px: Floats32


def bounds_of(light: LightTransport, scene: SceneSpec, shots: Sequence[Shot], *, every: int = 8) -> Bounds:
    """Cramér-Rao bounds of the projector column for the frames that were shown.

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

    Notes
    -----
    O(frames · nnz / every).

    """
    height, width = light.camera_shape
    rows = np.arange(0, height, every)
    pixels = (rows[:, None] * width + np.arange(width)).ravel()
    direct, indirect = (_alone(part, light, pixels) for part in (light.direct, light.indirect))
    steady = light.ambient.ravel()[pixels].astype(float) * scene.light.ambient
    fisher = np.zeros((_UNKNOWNS, _UNKNOWNS, len(pixels)))
    for shone, slope, exposure_ms in _chunks(shots, scene.projector.sheet):
        _add(
            fisher,
            direct.relight(shone)[:, 0],
            direct.relight(slope)[:, 0],
            indirect.relight(shone)[:, 0],
            indirect.relight(slope)[:, 0],
            steady=steady,
            scene=scene,
            exposure_ms=exposure_ms,
        )
    images = np.full((2, height, width), np.nan, np.float32)
    for image, unknowns in zip(images, (3, _UNKNOWNS), strict=True):
        image[rows] = _bound(fisher[:unknowns, :unknowns]).reshape(len(rows), width)
    return Bounds(images[0], np.fmax(images[0], images[1]))


def _alone(part: SparseRows, light: LightTransport, pixels: Ints) -> LightTransport:
    """One part of the light of some camera pixels, in one row, as if it were direct."""
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
    indirect_slope: Floats32,
    *,
    steady: Floats,
    scene: SceneSpec,
    exposure_ms: float,
) -> None:
    """Add some frames' information on u, a, b, c and w."""
    camera = scene.camera
    rate = camera.electrons_per_ms * exposure_ms
    dark = 1e-3 * camera.dark_current_e_per_s * exposure_ms
    sheet = camera.sheet
    for one, change, other, other_change in zip(direct, slope, indirect, indirect_slope, strict=True):
        mean = rate * (one + other + steady) + dark
        variance = mean + camera.read_noise_e**2 + sheet.rounding_e2(mean)
        weight = np.where(mean < camera.full_well_e, 1.0 / variance, 0.0)
        gradient = rate * np.stack([change, one, np.ones_like(one), other, other_change]).astype(float)
        fisher += weight * gradient[:, None] * gradient[None]


def _bound(fisher: Floats) -> Floats:
    """Square root of the first entry of the inverse of (k, k, n) matrices, (n,); NaN where there is none.

    An unknown without any information is none: a pixel without interreflected light has no second path.
    """
    size = np.sqrt(np.einsum("iin->in", fisher))
    present = size > 0.0
    size = np.where(present, size, 1.0)
    scaled = np.moveaxis(fisher / (size[:, None] * size[None]), 2, 0)
    others = scaled[:, 1:, 1:] + np.eye(len(size) - 1) * np.where(present[1:].T, 1e-12, 1.0)[:, None]
    coupling = scaled[:, 1:, :1]
    explained = (coupling * np.linalg.solve(others, coupling))[..., 0].sum(axis=1)
    left = np.where(present[0], 1.0 - explained, 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(left > 1e-9, 1.0 / (size[0] * np.sqrt(left)), np.nan)
