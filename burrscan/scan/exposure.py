"""Bracketing: white and black pictures at several exposures tell every pixel's response.

After Debevec & Malik 1997, for a camera that is linear: the longest exposure that is not clipped is the
least noisy, so it alone is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Image, freeze
from burrscan.devices import CameraSheet
from burrscan.scanner import Patterns, Scanner

_WELL_MEASURED_PX = 0.5
"""Standard deviation: the limit that coverage is counted by, half a projector column."""
_PLANNING_PERIOD_PX = 16.0
"""Of the sine that stands for the code when the exposure is chosen; all codes here end in stripes about as
fine."""
_PLANNING_STEPS = 8
"""Of that sine; the best exposure hardly depends on it, for it scales all pixels' noise alike."""


@dataclass(frozen=True)
class Response:
    """What each camera pixel gets from a fully white and a fully black projector.

    Parameters
    ----------
    white_e_per_ms, black_e_per_ms
        (h, w) electrons per millisecond, black level removed.
    clipped
        (h, w) True where even the shortest bracket was clipped: the response is a lower bound.
    frames
        Pictures taken.

    """

    white_e_per_ms: Floats32
    black_e_per_ms: Floats32
    clipped: Bools
    frames: int

    def __post_init__(self) -> None:
        freeze(self, white_e_per_ms=self.white_e_per_ms, black_e_per_ms=self.black_e_per_ms)
        freeze(self, clipped=self.clipped)

    @property
    def signal_e_per_ms(self) -> Floats32:
        """(h, w) what the projector adds."""
        signal: Floats32 = np.maximum(self.white_e_per_ms - self.black_e_per_ms, 0.0)
        return signal

    @property
    def radiance(self) -> Floats32:
        """(h, w) the same, NaN where it is but a lower bound."""
        return np.where(self.clipped, np.float32(np.nan), self.signal_e_per_ms)


def ladder_ms(camera: CameraSheet, *, ratio: float) -> tuple[float, ...]:
    """Exposures from the longest to the shortest the camera offers, in even ratios of at most ``ratio``."""
    shortest, longest = camera.exposure_range_ms
    rungs = max(2, 1 + int(np.ceil(np.log(longest / shortest) / np.log(ratio))))
    exposures = np.geomspace(longest, shortest, rungs)
    return tuple(float(np.clip(value, shortest, longest)) for value in exposures)


def even(scanner: Scanner, *, levels: tuple[int, ...]) -> Patterns:
    """Even frames, one per level."""
    shape = (len(levels), *scanner.rig.projector.shape)
    frames = np.broadcast_to(np.array(levels, np.uint8)[:, None, None], shape)
    return Patterns(frames, tuple(f"even-{level:03d}" for level in levels))


def bracket(scanner: Scanner, *, ratio: float = 12.0, black_rungs: int = 99) -> Response:
    """Measure the response to white and black at a ladder of exposures.

    Parameters
    ----------
    scanner
        The instrument.
    ratio
        Between neighbouring exposures. A pixel is measured at no less than ``1 / ratio`` of full scale as
        long as the ladder reaches it.
    black_rungs
        How many of the longest exposures also take a black picture; the rest is dark to any purpose.

    """
    camera = scanner.camera
    white = np.full(scanner.rig.camera.shape, np.nan, np.float32)
    black = np.zeros(scanner.rig.camera.shape, np.float32)
    dark = np.zeros(scanner.rig.camera.shape, bool)
    frames = 0
    for rung, exposure_ms in enumerate(ladder_ms(camera, ratio=ratio)):
        levels = (255, 0) if rung < black_rungs else (255,)
        images = scanner.capture(even(scanner, levels=levels), exposure_ms)
        frames += len(levels)
        _measure(white, images[0], exposure_ms, camera, todo=np.isnan(white))
        if len(levels) == 2:
            dark |= _measure(black, images[1], exposure_ms, camera, todo=~dark)
    clipped = np.isnan(white)
    shortest_ms = camera.exposure_range_ms[0]
    white[clipped] = camera.full_well_e / shortest_ms
    return Response(white, black, clipped, frames)


def _measure(into: Floats32, image: Image, exposure_ms: float, camera: CameraSheet, *, todo: Bools) -> Bools:
    """Fill what is still to be measured where ``image`` is not clipped; returns where it was filled."""
    usable = todo & (image < camera.clipped_dn)
    electrons = (image[usable] - camera.black_level_dn) / camera.gain_dn_per_e
    into[usable] = electrons / exposure_ms
    return usable


def sine_sigma_px(
    signal_e: Floats, background_e: Floats, *, camera: CameraSheet, period_px: float, steps: int
) -> Floats:
    """Sigma of a sine stripe's position that electrons, read noise and quantisation allow.

    Parameters
    ----------
    signal_e
        Electrons that full light adds over the dark.
    background_e
        Electrons in the dark.
    camera, period_px, steps
        The instrument and the code.

    """
    floor = camera.read_noise_e**2 + 1.0 / (12.0 * camera.gain_dn_per_e**2)
    sigma_e = np.sqrt(0.5 * signal_e + background_e + floor)
    with np.errstate(divide="ignore"):
        sigma: Floats = period_px / (2.0 * np.pi) * np.sqrt(2.0 / steps) * sigma_e / (0.5 * signal_e)
    return sigma


def served(scanner: Scanner, exposure_ms: float | None) -> tuple[float, int, Floats32 | None]:
    """An exposure fixed by hand, or the one that serves most pixels; frames taken for it; their radiance.

    Without a bracket there is no radiance.
    """
    if exposure_ms is not None:
        return exposure_ms, 0, None
    response = bracket(scanner)
    best = best_exposure_ms(
        response,
        camera=scanner.camera,
        period_px=_PLANNING_PERIOD_PX,
        steps=_PLANNING_STEPS,
        max_sigma_px=_WELL_MEASURED_PX,
    )
    return best, response.frames, response.radiance


def best_exposure_ms(
    response: Response,
    *,
    camera: CameraSheet,
    period_px: float,
    steps: int,
    max_sigma_px: float,
    candidates: int = 120,
) -> float:
    """The one exposure at which most pixels are unclipped and predicted to be finer than ``max_sigma_px``.

    Ties go to the longer exposure. O(candidates · pixels seen).
    """
    exposures = np.geomspace(*camera.exposure_range_ms, candidates)
    counts = [
        int(
            usable_at(
                response,
                float(t),
                camera=camera,
                period_px=period_px,
                steps=steps,
                max_sigma_px=max_sigma_px,
            ).sum()
        )
        for t in exposures
    ]
    return float(exposures[candidates - 1 - int(np.argmax(counts[::-1]))])


def _usable(
    white_e: Floats, black_e: Floats, camera: CameraSheet, period_px: float, steps: int, max_sigma_px: float
) -> Bools:
    sigma = sine_sigma_px(white_e - black_e, black_e, camera=camera, period_px=period_px, steps=steps)
    # three sigmas of shot noise below full well, so that no step clips
    roof = camera.full_well_e - 3.0 * np.sqrt(camera.full_well_e)
    usable: Bools = (sigma <= max_sigma_px) & (white_e < roof)
    return usable


def usable_at(
    response: Response,
    exposure_ms: float,
    *,
    camera: CameraSheet,
    period_px: float = 16.0,
    steps: int = 8,
    max_sigma_px: float = 0.5,
) -> Bools:
    """Pixels that full-range sines at one exposure measure to ``max_sigma_px`` without clipping, flat."""
    seen = response.white_e_per_ms * camera.exposure_range_ms[1] > camera.read_noise_e
    white = response.white_e_per_ms[seen & ~response.clipped].astype(float) * exposure_ms
    black = np.clip(response.black_e_per_ms[seen & ~response.clipped] * exposure_ms, 0.0, white)
    return _usable(white, black, camera, period_px, steps, max_sigma_px)
