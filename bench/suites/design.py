"""Random designs: points spread evenly over the space of some of a scene's parameters."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from burrscan.arrays import Floats
from burrscan.documents import STRICT

_DIGITS = 4
"""Significant digits of a value drawn: a case's name and its record say exactly what was simulated."""

_SETTINGS = ("points", "method", "design_seed")
_OF_A_DRAW = frozenset({"low", "high", "scale", "choices"})


@dataclass(frozen=True)
class Draw:
    """Where one parameter's values come from: bounds, or a list of choices.

    Parameters
    ----------
    low, high
        Bounds of a value drawn.
    scale
        ``linear``: every value is as likely; ``log``: every ratio is. A logarithmic scale needs ``low > 0``.
    choices
        Values of any kind, each as likely as the others, instead of bounds.

    """

    __pydantic_config__ = STRICT

    low: float | None = None
    high: float | None = None
    scale: Literal["linear", "log"] = "linear"
    choices: tuple[Any, ...] = ()

    def value(self, share: float) -> Any:
        """The value at ``share`` (0 to 1) of the way through the distribution."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        low, high = float(self.low or 0.0), float(self.high or 0.0)
        if self.scale == "log":
            return _rounded(low * (high / low) ** share, low, high)
        return _rounded(low + (high - low) * share, low, high)

    def problem(self) -> str:
        """What is wrong with it, or nothing."""
        if self.choices:
            return (
                "" if self.low is None and self.high is None else "has bounds and choices; give one of them"
            )
        if self.low is None or self.high is None:
            return "needs bounds, [low, high] or {low, high, scale}, or a list of choices"
        if self.low >= self.high:
            return f"the lower bound {self.low:g} is not below the upper one {self.high:g}"
        return (
            "a logarithmic scale needs a lower bound above 0"
            if self.scale == "log" and self.low <= 0.0
            else ""
        )

    def __str__(self) -> str:
        """Where values come from, for people; choices are not named."""
        if self.choices:
            return f"one of {len(self.choices)}"
        return f"between {self.low:g} and {self.high:g}{', on a log scale' if self.scale == 'log' else ''}"


@dataclass(frozen=True)
class RandomDesign:
    """Points that fill a space evenly without the cost of a grid.

    Parameters
    ----------
    points
        How many.
    draw
        Dotted path to where its values come from.
    method
        ``sobol``: a Sobol sequence, scrambled after Owen (1998); its first points are the same however many
        are asked for, so that a longer run adds to a shorter one. With less than a hundred points some pairs
        of parameters go together. ``latin_hypercube``: McKay, Beckman and Conover (1979); each parameter's
        range is divided into ``points`` slices and each slice is met once, in an order that spreads pairs of
        parameters evenly (least centred discrepancy, Jin, Chen and Sudjianto 2005).
    design_seed
        Of the design, which belongs to the suite: another seed of a *run* draws other noise and jitter only.

    """

    __pydantic_config__ = STRICT

    points: Annotated[int, Field(ge=1, le=10_000)]
    draw: Annotated[Mapping[str, Draw], Field(min_length=1)]
    method: Literal["sobol", "latin_hypercube"] = "sobol"
    design_seed: Annotated[int, Field(ge=0)] = 0

    def values(self) -> list[dict[str, Any]]:
        """Path to value, point by point. O(points × paths)."""
        return [
            {
                path: draw.value(float(share))
                for (path, draw), share in zip(self.draw.items(), row, strict=True)
            }
            for row in _shares(self.method, self.points, len(self.draw), self.design_seed)
        ]

    def problems(self) -> Iterator[str]:
        """What is wrong with its draws."""
        for path, draw in self.draw.items():
            if problem := draw.problem():
                yield f"random.{path}: {problem}"

    def document(self) -> dict[str, Any]:
        """As it is written in a file."""
        draws = {path: _plain(draw) for path, draw in self.draw.items()}
        return {"points": self.points, "method": self.method, "design_seed": self.design_seed, **draws}


@lru_cache(maxsize=32)
def _shares(method: str, points: int, paths: int, seed: int) -> Floats:
    """(points, paths) in the unit cube; kept, for spreading a Latin hypercube takes a second."""
    from scipy.stats import qmc  # noqa: PLC0415 (a third of a second)

    random = np.random.default_rng(seed)
    if method == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(paths, rng=random, optimization="random-cd").random(points))
    sobol = qmc.Sobol(paths, rng=random)  # balanced by powers of two: take the first points
    return np.asarray(sobol.random_base2((points - 1).bit_length())[:points])


def arranged_design(table: Any) -> Any:
    """A ``[random]`` table in the dataclass's own shape: dotted paths flat, every draw a table."""
    if not isinstance(table, Mapping):
        return table
    settings = {key: value for key, value in table.items() if key in _SETTINGS}
    paths = {key: value for key, value in table.items() if key not in _SETTINGS}
    return {**settings, "draw": {path: _arranged_draw(value) for path, value in _flat(paths)}}


def _flat(tables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Every path with its draw; a table of a draw's own keys is one."""
    for key, value in tables.items():
        if isinstance(value, Mapping) and not _OF_A_DRAW & value.keys():
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _arranged_draw(value: Any) -> Any:
    """A list of two numbers is bounds, any other list is choices."""
    if not isinstance(value, list | tuple):
        return value
    if len(value) == 2 and all(isinstance(v, int | float) and not isinstance(v, bool) for v in value):
        return {"low": value[0], "high": value[1]}
    return {"choices": list(value)}


def _plain(draw: Draw) -> dict[str, Any]:
    if draw.choices:
        return {"choices": list(draw.choices)}
    return {"low": draw.low, "high": draw.high, "scale": draw.scale}


def _rounded(value: float, low: float, high: float) -> float:
    """To a few significant digits of the range's size, and within it."""
    size = max(abs(low), abs(high)) if low <= 0.0 else value
    digits = _DIGITS - 1 - math.floor(math.log10(abs(size)))
    return min(max(round(value, digits), low), high)
