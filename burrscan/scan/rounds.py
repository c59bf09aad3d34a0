"""One round of an adaptive scan: show, look, read; and settle, once it is known which pixels to believe."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, Image
from burrscan.codes.code import patterns
from burrscan.scan.exposure import Response
from burrscan.scan.known_light import light_bias_px
from burrscan.scan.matching.matched import Reading, read
from burrscan.scan.stripes import Stripes
from burrscan.scan.validity.interreflection_sigma import interreflection_sigma_px
from burrscan.scan.validity.mixed_pixels import mixed_pixels
from burrscan.scanner import Patterns, Scanner

_EXACT_PX, _LEFT = 0.03, 0.2
"""Taking off the known light's bias leaves nothing of what levels are rounded by, and as a standard deviation
this share of what exceeds that: footprints are no parallelograms, nor is light linear across them. Of five
rendered wheels it leaves, beside what is stated, 0.005, 0.0075 and 0.014 to 0.02 px of 0.03, 0.06 and
0.11, beside glints."""


@dataclass(frozen=True)
class Round:
    """What was shown and seen, and every pixel's best column, believed or not."""

    code: Stripes
    shown: Patterns
    images: Image
    reading: Reading


def look(
    scanner: Scanner, code: Stripes, *, exposure_ms: float, response: Response, intensity: Floats | None
) -> Round:
    """Show the stripes at an intensity (H, W) per projector pixel, expose, and read."""
    view = scanner.rig.projector
    frames = code.frames(view.shape)
    shown = patterns(frames, code.names, view=view, sheet=scanner.projector, intensity=intensity)
    images = scanner.capture(shown, exposure_ms)
    dark_e = response.black_e_per_ms * np.float32(exposure_ms)
    reading = read(images, code, camera=scanner.camera, rig=scanner.rig, dark_e=dark_e)
    return Round(code, shown, images, reading)


def settled(one: Round, believed: Bools, scanner: Scanner) -> Reading:
    """The round's reading at the pixels believed.

    Mixed pixels are left out, the known light's bias is taken off, and what that leaves, and interreflected
    light moves columns by, widens the sigmas.
    """
    reading = one.reading.without(~believed)
    reading = reading.without(mixed_pixels(reading, one.images, one.code, camera=scanner.camera))
    bias_px = light_bias_px(reading.u_px, reading.v_px, one.shown, one.code, sheet=scanner.projector)
    u_px = reading.u_px - bias_px
    unsure = np.hypot(reading.sigma_u_px, _LEFT * np.maximum(np.abs(bias_px) - _EXACT_PX, 0.0))
    moved = interreflection_sigma_px(u_px, unsure, reading.lost)
    return replace(reading, u_px=u_px, sigma_u_px=np.hypot(unsure, moved))
