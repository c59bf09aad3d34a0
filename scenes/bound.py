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

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats, Floats32, Ints
from scenes.scene import SceneSpec
from scenes.shots import Shot, shone
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows, empty_rows

_UNKNOWNS = 5  # u, a, b, c, w
_DERIVATIVE = ((1, 45.0 / 60.0), (2, -9.0 / 60.0), (3, 1.0 / 60.0))
"""Weights of a central difference of sixth order: exact to 1 % for sines of down to 5 px."""


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
    for few, exposure_ms in shone(shots, scene.projector.sheet):
        shape = (len(few), *light.projector_shape)
        frames, slopes = (np.broadcast_to(each, shape) for each in (few, _slope(few)))
        _add(
            fisher,
            direct.relight(frames)[:, 0],
            direct.relight(slopes)[:, 0],
            indirect.relight(frames)[:, 0],
            indirect.relight(slopes)[:, 0],
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
    for one, change, other, other_change in zip(direct, slope, indirect, indirect_slope, strict=True):
        mean = camera.mean_e(one + other + steady, exposure_ms)
        weight = np.where(mean < camera.full_well_e, 1.0 / camera.variance_e2(mean), 0.0)
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
