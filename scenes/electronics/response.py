"""Response curves of cameras: from the share of the full well to the share of the range."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.optimize import brentq

from burrscan.arrays import Floats
from burrscan.documents import STRICT
from burrscan.errors import InputError

_KNOTS = 65_537
"""Of the curve, even in light: one per step of 16 bits, so that a straight line between two is as good as
the curve."""
_DARKEST = 1e-12
"""Where the search for the linear start's end begins: the equation has a pole at no light."""


@dataclass(frozen=True)
class ResponseSpec:
    """A curve between the electrons and the analogue-digital converter. None by default: EMVA 1288's camera.

    Parameters
    ----------
    gamma
        Output is light to this power, with a linear start as ITU-R BT.709-6 has it, for a power below one
        would lift the noise in the dark without limit; BT.709's own is 0.45.
    toe_slope
        Slope of that linear start; BT.709 has 4.5.
    knee
        Share of the full well from which on the sensor is logarithmic, its slope unbroken, as in
        linear-logarithmic sensors (Storm, Henderson, Hurwitz et al. 2006); 1 leaves it out. The power acts
        on what the knee leaves.
    table
        Output of evenly spaced light from 0 to 1, rising from 0 to 1: a measured curve, in place of all this.

    Raises
    ------
    InputError
        When the table does not rise from 0 to 1.

    """

    __pydantic_config__ = STRICT

    gamma: Annotated[float, Field(ge=0.1, le=1.0)] = 1.0
    toe_slope: Annotated[float, Field(gt=1.0)] = 4.5
    knee: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    table: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        table = np.asarray(self.table)
        if len(table) and not (table[0] == 0.0 and table[-1] == 1.0 and (np.diff(table) > 0.0).all()):
            raise InputError("camera.response.table must rise from 0 to 1, each value above the one before")

    @property
    def linear(self) -> bool:
        """Whether there is no curve at all."""
        return self.gamma == 1.0 and self.knee == 1.0 and not self.table

    @property
    def knots(self) -> Floats:
        """Output at evenly spaced light from 0 to 1; between them it is interpolated linearly."""
        return _knots(self)

    def light_of_dn(self, *, bit_depth: int, black_level_dn: float) -> tuple[float, ...]:
        """(2**bit_depth,) light of each DN; below the black level the curve goes on straight."""
        top = (1 << bit_depth) - 1
        dn = np.arange(top + 1.0)
        output = (dn - black_level_dn) / (top - black_level_dn)
        light = np.linspace(0.0, 1.0, _KNOTS)
        start = light[1] / self.knots[1]
        return tuple(np.where(output < 0.0, output * start, np.interp(output, self.knots, light)).tolist())


@lru_cache(maxsize=8)
def _knots(spec: ResponseSpec) -> Floats:
    light = np.linspace(0.0, 1.0, _KNOTS)
    if spec.table:
        return np.interp(light, np.linspace(0.0, 1.0, len(spec.table)), spec.table)
    return power_with_toe(linear_logarithmic(light, spec.knee), gamma=spec.gamma, slope=spec.toe_slope)


def linear_logarithmic(light: Floats, knee: float) -> Floats:
    """Linear up to the knee, logarithmic beyond it with the same slope there, scaled to end at 1."""
    bent = np.where(light <= knee, light, knee * (1.0 + np.log(np.maximum(light, knee) / knee)))
    return np.asarray(bent / (knee * (1.0 - np.log(knee))))


def power_with_toe(light: Floats, *, gamma: float, slope: float) -> Floats:
    """Power law with a linear start, value and slope unbroken where they meet (ITU-R BT.709-6, item 1.2).

    The start ends at x with ``(1 + a) x**gamma - a = slope x`` and ``(1 + a) gamma x**(gamma - 1) = slope``.
    """
    if gamma == 1.0:
        return light
    end = brentq(lambda x: slope * (x ** (1.0 - gamma) - x * (1.0 - gamma)) / gamma - 1.0, _DARKEST, 1.0)
    offset = slope * end * (1.0 - gamma) / gamma
    return np.where(light < end, slope * light, (1.0 + offset) * light**gamma - offset)
