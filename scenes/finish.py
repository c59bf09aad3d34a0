"""Surface finishes: measured metals, isotropic or turned, oxide and dust, and a matte white coating.

Optical constants (wavelength in nm, n, k), tabulated at refractiveindex.info (public domain) from

- aluminium: A. D. Rakić, Appl. Opt. 34, 4755 (1995), evaporated film;
- steel: B. Karlsson and C. G. Ribbing, J. Appl. Phys. 53, 6340 (1982), austenitic stainless;
- brass: M. R. Querry, Contractor Report CRDC-CR-85034 (1985), 70 % Cu, 30 % Zn;
- chrome: P. B. Johnson and R. W. Christy, Phys. Rev. B 9, 5056 (1974): 0.555 of green light at right angles;
- chrome-film: A. D. Rakić, A. B. Djurišić, J. M. Elazar and M. L. Majewski, Appl. Opt. 37, 5271 (1998), their
  Brendel-Bormann fit to films of several laboratories: 0.65 of it;
- copper, gold: P. B. Johnson and R. W. Christy, Phys. Rev. B 6, 4370 (1972).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from burrscan.arrays import Floats
from burrscan.documents import STRICT
from burrscan.errors import InputError
from burrscan.variants import suggest

Metal = Literal["aluminium", "steel", "brass", "chrome", "chrome-film", "copper", "gold"]
Channels = Literal["mono", "rgb", "red", "green", "blue"]
Alpha = Annotated[float, Field(ge=0.01, le=1.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]

_TORN_ALPHA, _TORN_SHARE = 0.3, 1.5
"""Roughness of torn metal: at least a coarsely ground one, and half as rough again as the wheel's. No
measurement; guards against burrs that shine like the turned face."""
_HARMONICS = 4
"""Of the roughness round a wheel: slow variation, as clamping and wear make it, and no texture."""
_ROUND_TEXELS = 1024
"""Round the wheel: a third of a degree, far finer than a quarter turn of the fourth harmonic."""
_SMALLEST_ALPHA = 0.01
"""As of a finish's key: below, a lobe is narrower than what sampling finds."""

# the colours are near the dominant wavelengths of the sRGB primaries
_WAVELENGTHS_NM: dict[Channels, tuple[float, ...]] = {
    "mono": (550.0,),
    "rgb": (611.0, 549.0, 464.0),
    "red": (611.0,),
    "green": (549.0,),
    "blue": (464.0,),
}
_CONSTANTS = {
    "aluminium": (
        (442.80, 0.60790, 5.3676),
        (476.87, 0.72780, 5.7781),
        (516.60, 0.87340, 6.2418),
        (563.57, 1.0728, 6.7839),
        (619.93, 1.3660, 7.4052),
        (652.25, 1.5724, 7.7354),
    ),
    "steel": (
        (440.0, 1.6386, 3.0555),
        (460.0, 1.7169, 3.1785),
        (480.0, 1.7921, 3.2933),
        (500.0, 1.8636, 3.4010),
        (520.0, 1.9349, 3.5072),
        (540.0, 2.0072, 3.6166),
        (560.0, 2.0807, 3.7298),
        (580.0, 2.1557, 3.8451),
        (600.0, 2.2325, 3.9594),
        (620.0, 2.3122, 4.0504),
        (640.0, 2.3962, 4.1378),
    ),
    "brass": (
        (440.0, 1.191, 1.797),
        (460.0, 0.994, 1.883),
        (480.0, 0.816, 2.046),
        (500.0, 0.686, 2.250),
        (520.0, 0.602, 2.464),
        (540.0, 0.549, 2.668),
        (550.0, 0.527, 2.765),
        (560.0, 0.505, 2.860),
        (580.0, 0.468, 3.059),
        (600.0, 0.450, 3.253),
        (620.0, 0.449, 3.434),
        (640.0, 0.444, 3.609),
    ),
    "chrome": (
        (431.0, 2.19, 3.04),
        (451.0, 2.33, 3.14),
        (471.0, 2.51, 3.24),
        (496.0, 2.75, 3.30),
        (521.0, 2.94, 3.33),
        (549.0, 3.18, 3.33),
        (582.0, 3.22, 3.30),
        (617.0, 3.17, 3.30),
        (659.0, 3.09, 3.34),
    ),
    "chrome-film": (
        (431.91, 1.8853, 3.7635),
        (444.06, 1.9786, 3.8289),
        (456.56, 2.0753, 3.8913),
        (469.40, 2.1754, 3.9501),
        (482.61, 2.2784, 4.0048),
        (496.19, 2.3839, 4.0552),
        (510.15, 2.4916, 4.1009),
        (524.50, 2.6008, 4.1414),
        (539.26, 2.7109, 4.1766),
        (554.43, 2.8213, 4.2063),
        (570.03, 2.9314, 4.2305),
        (586.06, 3.0404, 4.2492),
        (602.55, 3.1476, 4.2625),
        (619.50, 3.2524, 4.2706),
        (636.93, 3.3541, 4.2739),
        (654.85, 3.4522, 4.2727),
    ),
    "copper": (
        (430.5, 1.25, 2.305),
        (450.9, 1.24, 2.397),
        (471.4, 1.25, 2.483),
        (495.9, 1.22, 2.564),
        (520.9, 1.18, 2.608),
        (548.6, 1.02, 2.577),
        (579.4, 0.70, 2.704),
        (616.8, 0.30, 3.205),
        (659.5, 0.22, 3.747),
    ),
    "gold": (
        (430.5, 1.45, 1.948),
        (450.9, 1.38, 1.914),
        (471.4, 1.31, 1.849),
        (495.9, 1.04, 1.833),
        (520.9, 0.62, 2.081),
        (548.6, 0.43, 2.455),
        (579.4, 0.29, 2.863),
        (616.8, 0.21, 3.272),
        (659.5, 0.14, 3.697),
    ),
}
"""Wavelength in nm, n, k; the sources stand at the head of this module."""


@dataclass(frozen=True)
class FinishSpec:
    """How a surface reflects.

    Parameters
    ----------
    texture
        ``isotropic``, ``turned`` or ``matte`` (a white diffuse coating, on which nothing else has a say but
        ``coating_reflectance``).
    metal
        Whose optical constants.
    alpha
        GGX roughness (Walter et al. 2007) of an isotropic finish: sqrt(2) times the rms slope of the surface.
    alpha_along, alpha_across
        Roughness of a turned finish along its grooves, that is along the circumference, and across them. The
        slopes of a groove of feed f by a tool of nose radius R are uniform within ±f / (2 R): a medium cut of
        f = 0.4 mm, R = 0.8 mm has rms 0.14, alpha 0.20, and chip marks add to it. Ward (1992, table 1) fitted
        0.04 to 0.13 along and 0.09 to 0.16 across rolled and lightly brushed metal, finer than a lathe's.
    diffuse_share
        Share of the surface covered by oxide or dust, which is diffuse.
    diffuse_reflectance
        Of the oxide or dust.
    coating_reflectance
        Of the matte coating.
    roughness_variation, roughness_seed
        Share by which the roughness slowly rises and falls round the wheel, as tools wear and settings shift:
        the first four harmonics of the circumference with random phases, their largest swing this share.

    """

    __pydantic_config__ = STRICT

    texture: Literal["isotropic", "turned", "matte"] = "isotropic"
    metal: Metal = "aluminium"
    alpha: Alpha = 0.2
    alpha_along: Alpha = 0.08
    alpha_across: Alpha = 0.3
    diffuse_share: Share = 0.0
    diffuse_reflectance: Share = 0.4
    coating_reflectance: Share = 0.8
    roughness_variation: Annotated[float, Field(ge=0.0, le=0.8)] = 0.0
    roughness_seed: Annotated[int, Field(ge=0)] = 0


FINISHES = {
    "polished": FinishSpec(alpha=0.08),
    "ground": FinishSpec(alpha=0.2),
    "blasted": FinishSpec(alpha=0.45),
    "turned": FinishSpec(texture="turned"),
    "oxidised": FinishSpec(alpha=0.2, diffuse_share=0.3),
    "matte": FinishSpec(texture="matte"),
}


def named_finish(name: str, *, metal: Metal = "aluminium") -> FinishSpec:
    """A finish of the catalogue, on a metal.

    Raises
    ------
    InputError
        With the nearest name, when there is none of this name.

    """
    if name not in FINISHES:
        raise InputError(f"unknown finish '{name}': {suggest(name, list(FINISHES))}")
    return replace(FINISHES[name], metal=metal)


@dataclass(frozen=True)
class LocalFinish:
    """The finish of a part of the wheel, told by what differs from the wheel's.

    Parameters
    ----------
    name
        A finish of the catalogue, on the wheel's metal; ``wheel``, the default, is the wheel's own.
    texture, metal, alpha, alpha_along, alpha_across, diffuse_share, diffuse_reflectance, coating_reflectance
        Override that finish, as in :class:`FinishSpec`.

    """

    __pydantic_config__ = STRICT

    name: Literal["wheel", "polished", "ground", "blasted", "turned", "oxidised", "matte"] = "wheel"
    texture: Literal["isotropic", "turned", "matte"] | None = None
    metal: Metal | None = None
    alpha: Alpha | None = None
    alpha_along: Alpha | None = None
    alpha_across: Alpha | None = None
    diffuse_share: Share | None = None
    diffuse_reflectance: Share | None = None
    coating_reflectance: Share | None = None

    def on(self, wheel: FinishSpec) -> FinishSpec:
        """The finish itself, on a wheel of that finish."""
        base = wheel if self.name == "wheel" else named_finish(self.name, metal=wheel.metal)
        stated = {k: v for k, v in vars(self).items() if k != "name" and v is not None}
        return replace(base, **stated)


def local_finish(finish: Any) -> Any:
    """A local finish by name as a table; anything else as it is."""
    return {"name": finish} if isinstance(finish, str) else finish


LocalFinishKey = Annotated[LocalFinish | None, BeforeValidator(local_finish)]
"""The key ``finish`` of a burr, a zone or a blemish: a name or a table."""


def torn(wheel: FinishSpec) -> FinishSpec:
    """The finish of a burr that states none: a torn surface on a wheel of that finish.

    A fracture has no lay, so it is isotropic; it is rougher than the cut beside it: alpha is 1.5 times the
    wheel's largest and at least 0.3, an rms slope of 12 degrees. That is an assumption, between ``ground``
    and ``blasted``: no measured reflectance of burr flanks was found. A coating covers burrs too.
    """
    if wheel.texture == "matte":
        return wheel
    roughest = max(wheel.alpha_along, wheel.alpha_across) if wheel.texture == "turned" else wheel.alpha
    return replace(
        wheel,
        texture="isotropic",
        alpha=min(max(_TORN_ALPHA, _TORN_SHARE * roughest), 1.0),
        roughness_variation=0.0,
    )


def optical_constants(metal: Metal, wavelengths_nm: tuple[float, ...]) -> tuple[Floats, Floats]:
    """Index n and extinction k of a metal, interpolated linearly between the measured wavelengths."""
    wavelength, n, k = np.array(_CONSTANTS[metal]).T
    return np.interp(wavelengths_nm, wavelength, n), np.interp(wavelengths_nm, wavelength, k)


def finish_bsdf(finish: FinishSpec, *, channels: Channels) -> dict[str, Any]:
    """The Mitsuba plugin dictionary of a finish, two-sided.

    A turned finish needs a mesh whose dp/du runs along the circumference, as :class:`scenes.wheel.Wheel` has.

    Parameters
    ----------
    finish
        What it is.
    channels
        ``mono`` for one channel at 550 nm, ``rgb`` for three, or one of the three by its name.

    """
    return two_sided(one_sided_bsdf(finish, channels=channels))


def one_sided_bsdf(finish: FinishSpec, *, channels: Channels, mi: Any = None) -> dict[str, Any]:
    """As :func:`finish_bsdf`, to be blended with others before it is made two-sided.

    Where the roughness varies round the wheel, ``mi`` is needed, the activated Mitsuba module.
    """
    if finish.texture == "matte":
        return diffuse_bsdf(finish.coating_reflectance)
    metal = _conductor(finish, channels, mi)
    if finish.diffuse_share == 0.0:
        return metal
    return {
        "type": "blendbsdf",
        "weight": finish.diffuse_share,
        "bsdf_0": metal,
        "bsdf_1": diffuse_bsdf(finish.diffuse_reflectance),
    }


def roughness_round(finish: FinishSpec, turns: Floats) -> Floats:
    """(N,) factor on a finish's alpha at these shares of a turn, between 1 - and 1 + its variation."""
    harmonics = np.arange(1, _HARMONICS + 1)
    random = np.random.default_rng(finish.roughness_seed)
    phases, sizes = (
        random.uniform(0.0, 2.0 * np.pi, _HARMONICS),
        random.uniform(0.5, 1.0, _HARMONICS) / harmonics,
    )
    finely = np.linspace(0.0, 1.0, 721)
    waves, swing = (
        np.cos(2.0 * np.pi * at[..., None] * harmonics + phases) @ sizes for at in (np.asarray(turns), finely)
    )
    return np.asarray(1.0 + finish.roughness_variation * waves / np.abs(swing).max())


def two_sided(bsdf: dict[str, Any]) -> dict[str, Any]:
    """The same reflection on both sides of a surface."""
    return {"type": "twosided", "bsdf": bsdf}


def diffuse_bsdf(reflectance: float) -> dict[str, Any]:
    """An even diffuser."""
    return {"type": "diffuse", "reflectance": {"type": "rgb", "value": [reflectance] * 3}}


def _conductor(finish: FinishSpec, channels: Channels, mi: Any) -> dict[str, Any]:
    n, k = optical_constants(finish.metal, _WAVELENGTHS_NM[channels])
    alpha_u, alpha_v = (
        (finish.alpha_along, finish.alpha_across)
        if finish.texture == "turned"
        else (finish.alpha, finish.alpha)
    )
    return {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha_u": _alpha(finish, alpha_u, mi),
        "alpha_v": _alpha(finish, alpha_v, mi),
        "eta": _spectrum(n),
        "k": _spectrum(k),
    }


def _alpha(finish: FinishSpec, alpha: float, mi: Any) -> float | dict[str, Any]:
    """Roughness, or a texture of it round the wheel where it varies."""
    if finish.roughness_variation == 0.0:
        return alpha
    turns = (np.arange(_ROUND_TEXELS) + 0.5) / _ROUND_TEXELS
    values = np.clip(alpha * roughness_round(finish, turns), _SMALLEST_ALPHA, 1.0)
    return {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.tile(values.astype(np.float32), (2, 1))[..., None]),
        "raw": True,
        "wrap_mode": "repeat",
    }


def _spectrum(values: Floats) -> dict[str, Any]:
    if len(values) == 1:
        return {"type": "spectrum", "value": float(values[0])}
    return {"type": "rgb", "value": [float(value) for value in values]}
