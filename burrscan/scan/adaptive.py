"""Adaptive scanning of shiny metal (section 2 of Claes, Koninckx, Bruyninckx 2005, carried on).

A bracket tells each camera pixel's response. A crude round at full light and an exposure that suits the
bright pixels tells where they look. From both follow intensities per projector pixel, and a final round at
a longer exposure, dimmed where the metal shines, measures all of them; what both rounds know is fused.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats
from burrscan.correspondence import Scan
from burrscan.errors import InputError
from burrscan.linear import linear
from burrscan.scan.exposure import Response, bracket, even
from burrscan.scan.fill_columns import fill_columns
from burrscan.scan.intensity import intensities
from burrscan.scan.lens import lens_of
from burrscan.scan.matching.matched import LEAST_FREQUENCIES, Reading
from burrscan.scan.plan import plan_exposures_ms
from burrscan.scan.rounds import look, settled
from burrscan.scan.stripes import stripes
from burrscan.scan.validity.fusion import believed, fuse
from burrscan.scanner import Scanner
from burrscan.triangulation import epipolar_v


def scan_adaptive(
    scanner: Scanner,
    *,
    frames: int = 60,
    crude_frequencies: int = 7,
    bracket_ratio: float = 17.0,
    least_intensity: float = 0.02,
    max_sigma_px: float = 0.35,
) -> Scan:
    """Scan with per-pixel intensities that keep every lit camera pixel within its range.

    Parameters
    ----------
    scanner
        The instrument.
    frames
        Pictures in all: what the bracket, the crude round and a white picture leave goes to the final round.
    crude_frequencies
        Stripe frequencies of the crude round, three frames each.
    bracket_ratio
        Between the exposures of the bracket.
    least_intensity
        The dimmest light that still carries a pattern; below it 8 bits, of which five levels are left, and
        the projector's black level spoil the sine. What is brighter still the crude round tells.
    max_sigma_px
        Pixels with a larger stated sigma are not accepted.

    Notes
    -----
    With the default camera: 5 pictures for the bracket, 21 crude, 33 final, 1 white; 60 in all.
    O(frames · pixels + lit pixels · frequencies · columns).

    Raises
    ------
    burrscan.errors.InputError
        When ``frames`` leave fewer than five frequencies for the final round.

    """
    scanner = linear(scanner)
    camera = scanner.camera
    response = bracket(scanner, ratio=bracket_ratio, black_rungs=1)
    width = scanner.rig.projector.width
    frequencies = (frames - response.frames - 3 * crude_frequencies - 1) // 3
    if frequencies < LEAST_FREQUENCIES:
        least = response.frames + 3 * crude_frequencies + 1 + 3 * LEAST_FREQUENCIES
        raise InputError(f"{frames} frames are too few for this adaptive scan: give it at least {least}")
    crude_code, final_code = stripes(crude_frequencies, width=width), stripes(frequencies, width=width)
    period_px = 1.0 / float(np.sqrt(np.mean(final_code.per_column**2)))
    crude_ms, final_ms = plan_exposures_ms(
        response,
        camera=camera,
        period_px=period_px,
        steps=(len(crude_code), len(final_code)),
        max_sigma_px=max_sigma_px,
        least=least_intensity,
    )
    first = look(scanner, crude_code, exposure_ms=crude_ms, response=response, intensity=None)
    intensity = _intensity(
        scanner,
        first.reading.blanked(max_sigma_px=max_sigma_px),
        response,
        exposure_ms=final_ms,
        period_px=period_px,
        steps=len(final_code),
        max_sigma_px=max_sigma_px,
        least=least_intensity,
    )
    last = look(scanner, final_code, exposure_ms=final_ms, response=response, intensity=intensity)
    white = scanner.capture(even(scanner, levels=(255,)), final_ms)[0]
    belief = believed(first.reading, last.reading, max_sigma_px=max_sigma_px)
    lens = lens_of(last.reading, last.images, last.code, rig=scanner.rig)
    crude, final = (
        settled(one, pixels, scanner, radiance=response.radiance, lens=lens)
        for one, pixels in zip((first, last), belief, strict=True)
    )
    return Scan(
        correspondence=fuse(crude, final, width=width, max_sigma_px=max_sigma_px),
        frames=response.frames + len(crude_code) + len(final_code) + 1,
        exposures_ms=(final_ms, crude_ms),
        white=white,
        saturated=crude.clipped & final.clipped,
        pattern=last.shown.frames[-1],
        image=last.images[-1],
        intensity=intensity.astype(np.float32),
        radiance=response.radiance,
        notes={"rounds": 2.0},
    )


def _intensity(
    scanner: Scanner,
    crude: Reading,
    response: Response,
    *,
    exposure_ms: float,
    period_px: float,
    steps: int,
    max_sigma_px: float,
    least: float,
) -> Floats:
    """From what the crude round knows to the light of the final one."""
    known = np.isfinite(crude.u_px)
    lit = response.signal_e_per_ms * exposure_ms > 3.0 * scanner.camera.read_noise_e
    guessed = fill_columns(crude.u_px, known, wanted=lit)
    return intensities(
        guessed,
        epipolar_v(guessed, scanner.rig),
        response,
        np.where(known, crude.sigma_u_px, np.float32(np.inf)),
        shape=scanner.rig.projector.shape,
        camera=scanner.camera,
        exposure_ms=exposure_ms,
        period_px=period_px,
        steps=steps,
        max_sigma_px=max_sigma_px,
        least=least,
    )
