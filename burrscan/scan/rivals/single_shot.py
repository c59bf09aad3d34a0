"""One picture tells the geometry; what the pictures before it told adapts its pattern.

After the adaptively coded structured light that the seed names as its forerunner (its reference [11]:
Koninckx, Griesser, Van Gool 2003; Koninckx, Van Gool 2006): stripes all over the scene, identified within the
one picture, whose light and width follow the scene as the pictures before saw it. There lines across the
stripes identify them where they meet the epipolar lines; here the order of three levels of light does, which
needs no colour and no row, so that it holds on metal of any reflectance.

A bracket gives each pixel's response, with which a picture becomes relative light whatever the reflectance.
A first shot in even light says where the pixels look; the second one is dimmed where the metal shines, at a
longer exposure, with stripes as wide as the camera can tell apart. Columns come from one of the two alone:
the second, unless it tells of fewer pixels.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Floats32, Image
from burrscan.codes.code import patterns
from burrscan.correspondence import Correspondence, Scan
from burrscan.linear import linear
from burrscan.scan.exposure import Response, best_exposure_ms, bracket
from burrscan.scan.fill_columns import fill_columns
from burrscan.scan.intensity import intensities
from burrscan.scan.rivals.shot_code import stripe_light
from burrscan.scan.rivals.shot_match import Shot, accepted, read_shot
from burrscan.scanner import Patterns, Scanner
from burrscan.triangulation import epipolar_v

_STEPS = 25
"""Half the pixels of a window: what they average out, as steps of a phase would."""
_STRIPE_CAMERA_PX = 4.0
"""Camera pixels a stripe: two would just resolve it, and its width is what tells it."""
_WIDEST_PX = 12.0
"""Projector columns: a wider stripe has fewer borders, and borders are what tells the column."""
_LEAST_SIGNAL = 3.0
"""Over read noise at full light: below, a pixel cannot tell dark from bright."""


def scan_single_shot(
    scanner: Scanner,
    *,
    stripe_px: float = 4.0,
    least_intensity: float = 0.02,
    max_sigma_px: float = 0.4,
) -> Scan:
    """Scan with one adapted pattern.

    Parameters
    ----------
    scanner
        The instrument.
    stripe_px
        Width of the first shot's stripes, projector columns.
    least_intensity
        The dimmest light that still carries a pattern.
    max_sigma_px
        Pixels with a larger stated sigma are not accepted.

    Notes
    -----
    Frames: the bracket, the first shot, the one that is read, which serves as the white picture, too. A
    column rests on a window of 21 × 5 pixels: corners, burrs and depth edges within it are rounded off or
    lost, which is what a single picture costs.

    """
    scanner = linear(scanner)
    response = bracket(scanner, black_rungs=1)
    width = scanner.rig.projector.width
    period_px = 2.0 * stripe_px
    first_ms = best_exposure_ms(
        response, camera=scanner.camera, period_px=period_px, steps=_STEPS, max_sigma_px=max_sigma_px
    )
    first, even_shown, even_image = _shoot(
        scanner, response, None, exposure_ms=first_ms, stripe_px=stripe_px, name="first"
    )
    mask = accepted(first, width=width, max_sigma_px=max_sigma_px)
    final_ms = _longest_ms(scanner, response, least=least_intensity)
    lit = response.signal_e_per_ms * final_ms > _LEAST_SIGNAL * scanner.camera.read_noise_e
    guessed = fill_columns(np.where(mask, first.u_px, np.float32(np.nan)), mask, wanted=lit)
    stripe_px = _stripe_px(first, stripe_px)
    light = intensities(
        guessed,
        epipolar_v(guessed, scanner.rig),
        response,
        np.full(mask.shape, np.inf, np.float32),
        shape=scanner.rig.projector.shape,
        camera=scanner.camera,
        exposure_ms=final_ms,
        period_px=2.0 * stripe_px,
        steps=_STEPS,
        max_sigma_px=max_sigma_px,
        least=least_intensity,
    )
    final, shown, image = _shoot(
        scanner, response, light, exposure_ms=final_ms, stripe_px=stripe_px, name="adapted"
    )
    mask, before = (accepted(shot, width=width, max_sigma_px=max_sigma_px) for shot in (final, first))
    if before.sum() > mask.sum():
        final, mask, final_ms = first, before, first_ms
        shown, image, light = even_shown, even_image, np.ones_like(light)
    nan = np.float32(np.nan)
    return Scan(
        correspondence=Correspondence(
            np.where(mask, final.u_px, nan), np.where(mask, final.sigma_px, nan), mask
        ),
        frames=response.frames + 2,
        exposures_ms=(final_ms,),
        white=image,
        saturated=image >= scanner.camera.clipped_dn,
        pattern=shown.frames[0],
        image=image,
        intensity=light.astype(np.float32),
        notes={"stripe_px": stripe_px},
    )


def _shoot(
    scanner: Scanner,
    response: Response,
    intensity: Floats | None,
    *,
    exposure_ms: float,
    stripe_px: float,
    name: str,
) -> tuple[Shot, Patterns, Image]:
    """Show one pattern, take one picture, read it."""
    view, camera = scanner.rig.projector, scanner.camera
    light = stripe_light(width=view.width, stripe_px=stripe_px)
    shown = patterns([light], (f"stripes-u-{name}",), view=view, sheet=scanner.projector, intensity=intensity)
    image = scanner.capture(shown, exposure_ms)[0]
    full_e = response.signal_e_per_ms * np.float32(exposure_ms)
    dark_e = response.black_e_per_ms * np.float32(exposure_ms)
    electrons = ((image - camera.black_level_dn) / camera.gain_dn_per_e).astype(np.float32)
    floor = camera.read_noise_e**2 + 1.0 / (12.0 * camera.gain_dn_per_e**2)
    usable = (image < camera.clipped_dn) & (full_e > _LEAST_SIGNAL * camera.read_noise_e)
    seen = np.where(usable, (electrons - dark_e) / np.maximum(full_e, 1e-6), 0.0).astype(np.float32)
    weight: Floats32 = np.where(usable, full_e**2 / (np.maximum(electrons, 0.0) + floor), 0.0)
    shot = read_shot(
        seen,
        weight.astype(np.float32),
        light,
        magnification=view.fx / scanner.rig.camera.fx,
        stripe_px=stripe_px,
    )
    return shot, shown, image


def _longest_ms(scanner: Scanner, response: Response, *, least: float) -> float:
    """The exposure at which the dimmest light still suits the brightest pixels, all but one in a thousand."""
    seen = response.white_e_per_ms[response.signal_e_per_ms > 0.0]
    brightest = float(np.quantile(seen, 0.999)) if seen.size else 0.0
    low, high = scanner.camera.exposure_range_ms
    return float(np.clip(0.8 * scanner.camera.full_well_e / max(least * brightest, 1e-9), low, high))


def _stripe_px(shot: Shot, before_px: float) -> float:
    """Stripes that nine in ten of the pixels see at least some camera pixels wide."""
    slopes = shot.slope[np.isfinite(shot.slope)]
    if not slopes.size:
        return before_px
    return float(np.clip(np.rint(_STRIPE_CAMERA_PX * np.quantile(slopes, 0.9)), 2.0, _WIDEST_PX))
