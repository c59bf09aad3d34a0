"""Adaptive scanning of shiny metal (section 2 of Claes, Koninckx, Bruyninckx 2005, carried on).

A bracket tells each camera pixel's response. A crude round at full light and an exposure that suits the
bright pixels tells where they look. From both follow intensities per projector pixel, and a final round at
a longer exposure, dimmed where the metal shines, measures all of them; what both rounds know is fused.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.codes.code import patterns
from burrscan.correspondence import Correspondence, Scan
from burrscan.errors import InputError
from burrscan.linear import linear
from burrscan.scan.consistency import consistent
from burrscan.scan.exposure import Response, bracket, even
from burrscan.scan.guess import fill
from burrscan.scan.intensity import intensities
from burrscan.scan.known_light import light_bias_px
from burrscan.scan.matched import LEAST_FREQUENCIES, Reading, read
from burrscan.scan.plan import plan_exposures_ms
from burrscan.scan.stripes import Stripes, stripes
from burrscan.scan.torn import torn
from burrscan.scan.wander import wander_px
from burrscan.scanner import Patterns, Scanner
from burrscan.triangulation import epipolar_v


def scan_adaptive(
    scanner: Scanner,
    *,
    frames: int = 60,
    crude_frequencies: int = 7,
    bracket_ratio: float = 17.0,
    least_intensity: float = 0.005,
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
        The dimmest light that still carries a pattern; below it 8 bits and the projector's black level spoil
        the sine.
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
    crude, _, _ = _round(scanner, crude_code, crude_ms, response, None, max_sigma_px)
    intensity = _intensity(
        scanner,
        crude,
        response,
        exposure_ms=final_ms,
        period_px=period_px,
        steps=len(final_code),
        max_sigma_px=max_sigma_px,
        least=least_intensity,
    )
    final, shown, images = _round(scanner, final_code, final_ms, response, intensity, max_sigma_px)
    white = scanner.capture(even(scanner, levels=(255,)), final_ms)[0]
    correspondence = _fuse(crude, final, width=width, max_sigma_px=max_sigma_px)
    return Scan(
        correspondence=correspondence,
        frames=response.frames + len(crude_code) + len(final_code) + 1,
        exposures_ms=(final_ms, crude_ms),
        white=white,
        saturated=crude.clipped & final.clipped,
        pattern=shown.frames[-1],
        image=images[-1],
        intensity=intensity.astype(np.float32),
        notes={"rounds": 2.0},
    )


def _round(
    scanner: Scanner,
    code: Stripes,
    exposure_ms: float,
    response: Response,
    intensity: Floats | None,
    max_sigma_px: float,
) -> tuple[Reading, Patterns, Image]:
    """Show, look, read, and take the known light's bias off; pixels that are not accepted are blanked."""
    view = scanner.rig.projector
    frames = code.frames(view.shape)
    shown = patterns(frames, code.names, view=view, sheet=scanner.projector, intensity=intensity)
    images = scanner.capture(shown, exposure_ms)
    dark_e = response.black_e_per_ms * np.float32(exposure_ms)
    reading = read(images, code, camera=scanner.camera, rig=scanner.rig, dark_e=dark_e)
    reading = reading.blanked(max_sigma_px=max_sigma_px)
    reading = reading.without(torn(reading, images, code, camera=scanner.camera))
    bias_px = light_bias_px(reading.u_px, reading.v_px, shown, code, sheet=scanner.projector)
    u_px = reading.u_px - bias_px
    wander = np.float32(wander_px(u_px, reading.sigma_u_px, reading.lost))
    sigma_px = np.hypot(reading.sigma_u_px, wander * reading.lost)
    return replace(reading, u_px=u_px, sigma_u_px=sigma_px), shown, images


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
    guessed = fill(crude.u_px, known, wanted=lit)
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


def _fuse(crude: Reading, final: Reading, *, width: int, max_sigma_px: float) -> Correspondence:
    """Weigh the rounds by their information; where they contradict each other neither is believed."""
    u = np.stack([crude.u_px, final.u_px])
    information = np.nan_to_num(1.0 / np.stack([crude.sigma_u_px, final.sigma_u_px]) ** 2)
    total = information.sum(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = (np.nan_to_num(u) * information).sum(axis=0) / total
        sigma = 1.0 / np.sqrt(total)
        apart = np.abs(u[0] - u[1]) / np.hypot(crude.sigma_u_px, final.sigma_u_px)
        agree = ~(apart > 6.0)
        mask = agree & (sigma <= max_sigma_px) & (mean > -0.5) & (mean < width - 0.5)
    last = information[1] > 0.0
    lost, misfit = np.where(last, final.lost, crude.lost), np.where(last, final.misfit, crude.misfit)
    mask &= consistent(_masked(mean, mask), _masked(sigma, mask), lost, misfit)
    return Correspondence(_masked(mean, mask), _masked(sigma, mask), mask)


def _masked(values: Floats32, mask: Bools) -> Floats32:
    return np.where(mask, values, np.nan).astype(np.float32)
