"""One round of an adaptive scan: show, look, read; and settle, once it is known which pixels to believe."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.codes.code import patterns
from burrscan.scan.exposure import Response
from burrscan.scan.known_light import light_bias_px
from burrscan.scan.lens import Lens, penumbra_sigma_px
from burrscan.scan.matching.matched import Reading, read
from burrscan.scan.matching.two_paths import direct_of_two
from burrscan.scan.stripes import Stripes
from burrscan.scan.validity.interreflection_sigma import interreflection_sigma_px
from burrscan.scan.validity.mixed_pixels import mixed_pixels
from burrscan.scanner import Patterns, Scanner

_LEFT, _PER_BEND = 0.12, 0.7
"""Share of the known light's bias that taking it off leaves where the metal is of one brightness, and per
unit by which the slope of that brightness's logarithm changes from one pixel to the next: there it is not
what a slope makes of it. Of two rendered wheels 0.12 to 0.17 is left, 0.3 to 0.5 beside glints, at edges all.
"""


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
    one_path = read(images, code, camera=scanner.camera, rig=scanner.rig, dark_e=dark_e)
    reading = direct_of_two(images, code, one_path, camera=scanner.camera, rig=scanner.rig)
    return Round(code, shown, images, reading)


def settled(one: Round, believed: Bools, scanner: Scanner, *, radiance: Floats32, lens: Lens) -> Reading:
    """The round's reading at the pixels believed.

    Mixed pixels are left out, the known light's bias is taken off, and what that leaves, and a lens out of
    focus and interreflected light move columns by, widens the sigmas. ``radiance`` (h, w) is what each pixel
    sees of white light.
    """
    reading = one.reading.without(~believed)
    reading = reading.without(mixed_pixels(reading, one.images, one.code, camera=scanner.camera))
    circles_px = lens.circles_px(reading.u_px, scanner.rig)
    bias_px = light_bias_px(
        reading.u_px,
        reading.v_px,
        radiance,
        one.shown,
        one.code,
        sheet=scanner.projector,
        circles_px=circles_px,
    )
    u_px = reading.u_px - bias_px
    unsure = np.hypot(reading.sigma_u_px, left(radiance) * np.abs(bias_px))
    if circles_px.any():
        unsure = np.hypot(unsure, penumbra_sigma_px(radiance, known=believed, circles_px=circles_px))
    moved = interreflection_sigma_px(u_px, unsure, reading.lost)
    return replace(reading, u_px=u_px, sigma_u_px=np.hypot(unsure, moved))


def left(radiance: Floats32) -> Floats32:
    """(h, w) share of the known light's bias that may be left, as a standard deviation. O(pixels)."""
    log = np.pad(np.log(np.maximum(radiance, np.float32(1e-12))), 1, mode="edge")
    across, down = (np.abs(np.diff(log, 2, axis=axis)) for axis in (1, 0))
    bend = np.maximum(across[1:-1], down[:, 1:-1])
    return np.minimum(np.hypot(np.float32(_LEFT), np.float32(_PER_BEND) * bend), np.float32(1.0))
