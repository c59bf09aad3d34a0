"""What a structured-light scan knows of each camera pixel."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from burrscan.arrays import Bools, Floats32, Image, Levels, freeze


@dataclass(frozen=True)
class Correspondence:
    """Projector coordinates per camera pixel.

    Parameters
    ----------
    u_px, v_px
        (h, w) projector column and row, NaN where unknown; ``v_px`` is None where only columns were coded
        (the rig's epipolar geometry then gives it).
    sigma_u_px, sigma_v_px
        (h, w) stated standard deviations, NaN where unknown.
    mask
        (h, w) True where the scan accepts the pixel.

    """

    u_px: Floats32
    sigma_u_px: Floats32
    mask: Bools
    v_px: Floats32 | None = None
    sigma_v_px: Floats32 | None = None

    def __post_init__(self) -> None:
        freeze(self, u_px=self.u_px, sigma_u_px=self.sigma_u_px, mask=self.mask)
        freeze(self, v_px=self.v_px, sigma_v_px=self.sigma_v_px)


@dataclass(frozen=True)
class Scan:
    """A scanning strategy's result: the correspondence, what it cost, and pictures for people.

    Parameters
    ----------
    correspondence
        What was decoded.
    frames
        Pictures taken in all, probing included.
    exposures_ms
        The distinct exposures of the final sequence.
    white
        (h, w) DN, the scene under even light at the final (first) exposure.
    saturated
        (h, w) True where the camera was clipped in the final sequence's every exposure, so that the pixel
        had no usable value in some pattern.
    pattern, image
        One pattern of the final sequence as projected (levels) and as the camera saw it (DN).
    intensity
        (H, W) light relative to full white that the final patterns may use at each projector pixel, or None
        for a strategy that does not adapt. With several exposures: of the first.
    radiance
        (h, w) electrons per millisecond that full white adds, NaN where the shortest exposure was clipped;
        None for a strategy that has not measured it. Columns are taken from the centroids of this light to
        the pixels' centres (:mod:`burrscan.footprint`).
    notes
        Numbers worth a line in the report, such as ``{"rounds": 2}``.

    """

    correspondence: Correspondence
    frames: int
    exposures_ms: tuple[float, ...]
    white: Image
    saturated: Bools
    pattern: Levels
    image: Image
    intensity: Floats32 | None = None
    radiance: Floats32 | None = None
    notes: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        freeze(self, white=self.white, saturated=self.saturated, pattern=self.pattern, image=self.image)
        freeze(self, intensity=self.intensity, radiance=self.radiance)
