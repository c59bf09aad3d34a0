"""Camera and projector electronics as written in a scene file.

The camera follows the linear model of EMVA 1288 (release 4.0 linear, section 2): photons make electrons with
Poisson noise, electrons above the full well are lost, read noise is added, and the sum is quantised. Where a
scene wants a response curve, it acts on the sum before it is quantised (release 4.0 general, section 2).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from pydantic import Field

from burrscan.arrays import Floats
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.documents import STRICT
from scenes.electronics.response import ResponseSpec

Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Crosstalk = Annotated[tuple[tuple[float, float, float], ...], Field(max_length=3)]


@dataclass(frozen=True)
class CameraSpec:
    """The camera's electronics, named as EMVA 1288 release 4.0 does.

    The defaults are those of a 1.3 megapixel global-shutter sensor of 10 bits, 1280 × 1024, of the class of
    onsemi's PYTHON 1300.

    Parameters
    ----------
    bit_depth
        Bits per value, 8 to 12.
    full_well_e
        Electrons at saturation.
    read_noise_e
        Temporal dark noise, electrons RMS.
    black_level_dn
        DN without light.
    shortest_ms, longest_ms
        Exposures that the shutter offers.
    white_exposure_ms
        Exposure at which light 1 (a white diffuser at the standoff under full white) just fills the well: it
        holds the projector's brightness, the lens's f-number and the quantum efficiency together.
    dark_current_e_per_s
        Electrons that the dark adds (EMVA 1288, section 4); they are shot noise's too.
    vignetting
        Light lost in the corners of the sensor, by the law of cos⁴; see
        :func:`scenes.electronics.drift.falloff`.
    response
        The curve of a camera that is not linear.
    crosstalk
        (3, 3): what each colour channel makes of each band of the light, ones on the diagonal; of a scene in
        colour only. None by default. A sensor with a Bayer mosaic has some 0.05 to 0.15 off the diagonal
        (Caspi, Kiryati, Shamir 1998, section 3, measure such matrices for a camera and a projector).

    """

    __pydantic_config__ = STRICT

    bit_depth: Annotated[int, Field(ge=8, le=12)] = 10
    full_well_e: Positive = 10_000.0
    read_noise_e: NotNegative = 6.0
    black_level_dn: NotNegative = 8.0
    shortest_ms: Positive = 0.05
    longest_ms: Positive = 200.0
    white_exposure_ms: Positive = 20.0
    dark_current_e_per_s: NotNegative = 0.0
    vignetting: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    response: ResponseSpec = ResponseSpec()
    crosstalk: Crosstalk = ()

    @property
    def sheet(self) -> CameraSheet:
        """What the maker states."""
        return CameraSheet(
            bit_depth=self.bit_depth,
            full_well_e=self.full_well_e,
            read_noise_e=self.read_noise_e,
            black_level_dn=self.black_level_dn,
            exposure_range_ms=(self.shortest_ms, self.longest_ms),
            response=() if self.response.linear else (self._light_of_dn,),
            crosstalk=self.crosstalk,
        )

    @property
    def _light_of_dn(self) -> tuple[float, ...]:
        return self.response.light_of_dn(bit_depth=self.bit_depth, black_level_dn=self.black_level_dn)

    @property
    def electrons_per_ms(self) -> float:
        """Electrons that light 1 makes in a millisecond."""
        return self.full_well_e / self.white_exposure_ms

    def mean_e(self, light: Floats, exposure_ms: float) -> Floats:
        """Expected electrons of some light; the well is not bounded here."""
        return (self.electrons_per_ms * light + 1e-3 * self.dark_current_e_per_s) * exposure_ms

    def variance_e2(self, mean_e: Floats) -> Floats:
        """Their variance: photons, reading, rounding (EMVA 1288, section 2.3)."""
        return mean_e + self.read_noise_e**2 + self.sheet.rounding_e2(mean_e)


@dataclass(frozen=True)
class ProjectorSpec:
    """The projector: 8 bits, a power-law response, a finite contrast, and the profile of its pixels.

    The defaults: the power of sRGB displays (IEC 61966-2-1 is within a level of 2.2), and a contrast of some
    thousand to one, as DLP engines have it. Gaps and blur follow Mitsuba's bilinear projector unless set.

    Parameters
    ----------
    gamma, contrast
        Light of level L is ``1/contrast + (1 - 1/contrast) (L/255)**gamma``.
    fill
        Lit width of a pixel as a share of the pitch; the mirrors of a DLP chip cover some 0.92 of the area,
        0.96 of the pitch.
    blur_px
        Width of the lens's blur, projector pixels.
    flicker
        Relative RMS change of brightness from picture to picture; none by default, as of an LED whose current
        is controlled and whose frames the shutter follows.
    vignetting
        Light lost in the corners of the raster, likewise.
    crosstalk
        (3, 3): the light of each band in each primary, ones on the diagonal; of a scene in colour only. None
        by default; filters of a projector's colour wheel overlap by a few percent.

    """

    __pydantic_config__ = STRICT

    gamma: Positive = 2.2
    contrast: Annotated[float, Field(gt=1.0)] = 1000.0
    fill: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    blur_px: Annotated[float, Field(ge=0.0, le=1.0)] = 1.0
    flicker: NotNegative = 0.0
    vignetting: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    crosstalk: Crosstalk = ()

    @property
    def sheet(self) -> ProjectorSheet:
        """What the maker states."""
        return ProjectorSheet(
            ProjectorSheet.gamma(gamma=self.gamma, contrast=self.contrast).light, self.crosstalk
        )
