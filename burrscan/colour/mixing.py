"""How much of each primary each channel sees: the one matrix that a scan in colour has to undo.

Between primaries and channels there are the projector's crosstalk P, the metal's colour g and the camera's
crosstalk C: ``channels = C diag(g) P diag(f) · light``, f being the primaries' brightness (Caspi, Kiryati &
Shamir 1998, eq. 4). Only the product matters to a scan. Undoing all of it in the pictures costs no light; to
show patterns that are precompensated by the inverse of P one would have to lift the dark, for there is no
negative light, and it is the dark that adapted patterns live on.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Image, freeze
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.linear import linear_camera, linear_images
from burrscan.scan.exposure import ladder_ms
from burrscan.scanner import Patterns, Scanner

CHANNELS = 3
"""Red, green and blue, of the camera and of the projector."""
_PROBES = ("probe-red", "probe-green", "probe-blue", "probe-black")
_LEAST_SHARE, _MOST_SHARE = 0.1, 0.9
"""Of the well, between which a pixel tells the mixing: darker is noise, brighter may clip in a channel."""
_ENOUGH_PIXELS = 200
"""The mixing is a mean over them: so many leave a hundredth of its value even at a tenth of noise a pixel."""
_LEAST_OWN = 0.02
"""Of the best channel's: a primary seen less has to be so bright against the others that nothing is left to
scan with."""
_SINGULAR = 0.05
"""Least singular value of the balanced mixing: unmixing multiplies the noise by up to its inverse, 20."""


@dataclass(frozen=True)
class Mixing:
    """A mixing matrix, the primaries' balance that goes with it, and its inverse.

    Parameters
    ----------
    matrix
        (channels, primaries) light of each primary at full in each channel, in any unit.

    Raises
    ------
    InputError
        When a channel sees next to nothing of its primary, or the channels cannot be told apart.

    """

    matrix: Floats

    def __post_init__(self) -> None:
        freeze(self, matrix=np.asarray(self.matrix, dtype=float))
        own = np.diag(self.matrix)
        if self.matrix.shape != (CHANNELS, CHANNELS) or own.min() < _LEAST_OWN * own.max():
            raise InputError(
                f"the channels see {np.round(own / own.max(), 3).tolist()} of their own primaries: too "
                "little of one of them to scan in colour"
            )
        if np.linalg.svd(self.mixed, compute_uv=False)[-1] < _SINGULAR:
            raise InputError("camera and projector mix the colours so much that they cannot be told apart")

    @property
    def balance(self) -> Floats:
        """(primaries,) light of each primary, 1 for the weakest: so dimmed, all channels see the same."""
        own = np.diag(self.matrix)
        return np.asarray(own.min() / own)

    @property
    def mixed(self) -> Floats:
        """(channels, primaries) of the balanced primaries; white fills the brightest channel to 1."""
        balanced = self.matrix * self.balance
        return np.asarray(balanced / balanced.sum(axis=1).max())

    @property
    def unmix(self) -> Floats:
        """(primaries, channels) what gives each primary's picture of the channels' pictures."""
        return np.asarray(np.linalg.inv(self.mixed))


def mixing_of(camera: CameraSheet, projector: ProjectorSheet, *, own: Floats) -> Mixing:
    """The mixing of calibrated devices in front of a part of known colour.

    Parameters
    ----------
    camera, projector
        Their ``crosstalk`` counts; none is none.
    own
        (3,) what each channel sees of its own primary on the part, such as the diagonal of
        :func:`measured_mixing`. It is taken for the part's colour: a projector whose primaries differ in
        brightness beyond that is described by the measured matrix only.

    """
    c, p = (_square(sheet.crosstalk) for sheet in (camera, projector))
    colour = np.linalg.solve(c * p.T, own)  # own_k = Σ_b C[k, b] P[b, k] g_b
    return Mixing(c @ np.diag(colour) @ p)


def _square(crosstalk: tuple[tuple[float, ...], ...]) -> Floats:
    return np.array(crosstalk) if crosstalk else np.eye(CHANNELS)


def measured_mixing(scanner: Scanner) -> tuple[Mixing, int]:
    """Measure the mixing on the part itself, and say how many pictures that took.

    Each primary is shown alone at full, then none, at the middle of the camera's exposures first and at
    others where too few pixels are well exposed. The matrix is the ratio of sums over the pixels that no
    primary clips and that the brightest exposes to a tenth of the well; noise averages out of it.

    Raises
    ------
    InputError
        When no exposure shows enough of the part, or the colours cannot be told apart.

    """
    frames = 0
    ladder = ladder_ms(scanner.camera, ratio=6.0)
    for exposure_ms in sorted(ladder, key=lambda t: abs(np.log(t / np.sqrt(ladder[0] * ladder[-1])))):
        images = scanner.capture(_probes(scanner), exposure_ms)
        frames += len(images)
        light, usable = _probed(images, scanner.camera)
        if usable.sum() >= _ENOUGH_PIXELS:
            return Mixing(light[:, usable].sum(axis=1, dtype=float).T), frames
    raise InputError(
        "no exposure shows enough of the part to measure its colour: fewer than "
        f"{_ENOUGH_PIXELS} pixels between {_LEAST_SHARE:.0%} and {_MOST_SHARE:.0%} of the well"
    )


def _probes(scanner: Scanner) -> Patterns:
    levels = np.concatenate([255 * np.eye(CHANNELS, dtype=np.uint8), np.zeros((1, CHANNELS), np.uint8)])
    shape = (len(levels), *scanner.rig.projector.shape, CHANNELS)
    return Patterns(np.broadcast_to(levels[:, None, None].astype(np.uint8), shape), _PROBES)


def _probed(images: Image, raw: CameraSheet) -> tuple[Floats32, Bools]:
    """(primary, h, w, channel) electrons that each primary adds, and where they are to be trusted."""
    electrons = linear_electrons(images, raw)
    clipped = (images >= raw.clipped_dn).any(axis=(0, -1))
    brightest = electrons[:CHANNELS].max(axis=(0, -1)) / np.float32(raw.full_well_e)
    usable = ~clipped & (brightest > _LEAST_SHARE) & (brightest < _MOST_SHARE)
    return electrons[:CHANNELS] - electrons[CHANNELS], np.asarray(usable)


def linear_electrons(images: Image, raw: CameraSheet) -> Floats32:
    """Electrons of raw images of any shape, the response taken off."""
    sheet = linear_camera(raw)
    dn = linear_images(images, raw).astype(np.float32)
    return np.asarray((dn - np.float32(sheet.black_level_dn)) * np.float32(1.0 / sheet.gain_dn_per_e))
