"""How well the frames that were really shown could tell a burr from none: the limit of every detector.

The ideal observer of two known pictures in independent Gaussian noise is the matched filter, and all that
counts is ``d'^2 = Σ (μ1 - μ0)² / σ²`` over pixels and frames (Green & Swets 1966; Barrett & Myers,
Foundations of Image Science, 13.2): μ1 with the burr, μ0 of the same scene without. A burr with d' of
hundreds that is missed is the algorithm's fault; one below 5 is nobody's. The same sum against a scene whose
burrs are on the other side of the surface (:func:`other_side`) tells how well a ridge is told from a nick.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from burrscan.arrays import Floats, Floats32
from scenes.scene import SceneSpec
from scenes.shots import Shot, shone
from scenes.transport.matrix import LightTransport
from scenes.truth import Truth
from scenes.wheel.spec import AxialRidge, BurrSpec, Nick

_REACH = 3.0
"""Heights to each side of a burr, beside its width, within which a change of the light counts as its own: a
shadow at 70 degrees of incidence, and as much for its mirror image."""


def other_side(burr: BurrSpec) -> BurrSpec | None:
    """A nick of the size, place and finish of a ridge, a plain ridge for a nick; none for a rim burr."""
    match burr:
        case AxialRidge():
            return Nick(
                burr.angle_deg, burr.height_mm, burr.width_mm, burr.z_start_mm, burr.z_end_mm,
                depth_variation=burr.height_variation, seed=burr.seed, finish=burr.finish,
            )  # fmt: skip
        case Nick():
            return AxialRidge(
                burr.angle_deg, burr.depth_mm, burr.width_mm, burr.z_start_mm, burr.z_end_mm,
                height_variation=burr.depth_variation, seed=burr.seed, finish=burr.finish,
            )  # fmt: skip
        case _:
            return None


def dprime_squared(
    light: LightTransport, bare: LightTransport, scene: SceneSpec, shots: Sequence[Shot]
) -> Floats:
    """(h, w) d'^2 of each pixel over all frames that were shown.

    Parameters
    ----------
    light, bare
        The scene with its burrs, and without them or with those that they are to be told from.
    scene
        Electronics and surround; flicker, vibration and vignetting are left out.
    shots
        What was shown. A full well shows nothing beyond its edge.

    Notes
    -----
    The traced light's own error, :attr:`LightTransport.indirect_sigma`, is taken off each difference, in
    squares: else pixels far from any burr would add up. O(frames · nnz).

    """
    total = np.zeros(light.camera_shape)
    ambient = [one.ambient.astype(float) * scene.light.ambient for one in (light, bare)]
    error = light.indirect_sigma.astype(float) ** 2 + bare.indirect_sigma.astype(float) ** 2
    for few, exposure_ms in shone(shots, scene.projector.sheet):
        frames = np.broadcast_to(few, (len(few), *light.projector_shape))
        _add(total, light.relight(frames), bare.relight(frames), ambient, error, scene, exposure_ms)
    return total


def _add(
    total: Floats,
    with_burrs: Floats32,
    without: Floats32,
    ambient: list[Floats],
    error: Floats,
    scene: SceneSpec,
    exposure_ms: float,
) -> None:
    """Add some frames of one exposure."""
    camera = scene.camera
    rate = camera.electrons_per_ms * exposure_ms
    for one, other in zip(with_burrs, without, strict=True):
        means = [
            np.minimum(camera.mean_e(image + steady, exposure_ms), camera.full_well_e)
            for image, steady in zip((one, other), ambient, strict=True)
        ]
        mean = 0.5 * (means[0] + means[1])
        open_well = mean < camera.full_well_e
        squared = (means[0] - means[1]) ** 2 - np.where(open_well, rate**2 * error, 0.0)
        total += np.maximum(squared, 0.0) / camera.variance_e2(mean)


def burr_dprimes(truth: Truth, squared: Floats) -> tuple[float, ...]:
    """Detectability d' of each true burr, by its own pixels and those that it changes nearby.

    Each pixel counts for the nearest burr. 0 for a burr that no pixel sees. O(burrs · pixels).
    """
    shape = truth.burr_index.shape
    reach_px = np.zeros(len(truth.wheel.burrs))
    distance = np.full((len(truth.wheel.burrs), *shape), np.inf)
    for number, burr in enumerate(truth.wheel.burrs):
        own = truth.burr_index == number
        if own.any():
            depth = float(np.nanmedian(truth.points_mm[own][:, 2]))
            reach_px[number] = (_REACH * burr.height_mm + burr.width_mm) * truth.rig.camera.fx / depth
            distance[number] = ndimage.distance_transform_edt(~own)
    if not len(distance):
        return ()
    nearest = np.argmin(distance, axis=0)
    mine = (distance <= reach_px[:, None, None]) & (nearest == np.arange(len(distance))[:, None, None])
    return tuple(float(np.sqrt(squared[one].sum())) for one in mine)
