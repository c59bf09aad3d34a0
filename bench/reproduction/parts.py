"""What a section of the page consists of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from burrscan.arrays import Floats

Numbers = Mapping[str, NDArray[Any]]
"""What a section measured: named arrays, numbers as arrays without a dimension."""
Verdict = Literal["yes", "partly", "no"]
Side = Literal["seed", "default"]
SIDES: tuple[Side, ...] = ("seed", "default")
"""The two columns of the page."""
MOST = 0.9
"""Share of the views in which a claim must hold."""
Variant = Literal["seed", "default", ""]


@dataclass(frozen=True)
class Claim:
    """One statement of the paper and what became of it.

    Parameters
    ----------
    where
        Section, figure or table of the paper.
    statement
        What it says, in few words.
    paper, seed, default
        The figure there, by our port of its method, and by the default; "–" where there is none.
    agrees
        Whether the port shows what the paper says.
    why
        Where it does not: the reason that was found.

    """

    where: str
    statement: str
    paper: str
    seed: str
    default: str
    agrees: Verdict
    why: str = ""


@dataclass(frozen=True)
class Picture:
    """A picture with its heading, and the variant it belongs to (both where empty)."""

    title: str
    body: Markup
    variant: Variant = ""
    legend: tuple[tuple[str, str], ...] = ()
    """Colour (CSS, or a variant's ``v0`` to ``v5``) and meaning."""


@dataclass(frozen=True)
class Table:
    """Rows of text under heads; the first column names the row."""

    heads: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    title: str = ""


@dataclass(frozen=True)
class Section:
    """A part of the page.

    Parameters
    ----------
    title
        Its heading.
    reports
        What the paper reports.
    measured
        What we measure, and whether they agree.
    pictures, tables, claims
        What is shown; claims also go to the table at the head of the page.

    """

    title: str
    reports: str
    measured: str
    claims: tuple[Claim, ...]
    pictures: tuple[Picture, ...] = ()
    tables: tuple[Table, ...] = field(default=())


def number(numbers: Numbers, key: str) -> float:
    """One of the numbers."""
    return float(numbers[key])


def both(say: Callable[[Side], str]) -> tuple[str, str]:
    """What there is to say of each variant."""
    return say("seed"), say("default")


def middle_half(values: Floats, say: Callable[[float], str]) -> str:
    """The median and, in brackets, the middle half of values (N,); those that are NaN are left out."""
    low, middle, high = (say(value) for value in np.nanpercentile(values, [25, 50, 75]))
    return f"{middle} ({low} to {high})"


def whole_range(values: Floats, say: Callable[[float], str]) -> str:
    """The median and, in brackets, the least and the largest of values (N,); a dash where none is known."""
    known = values[np.isfinite(values)]
    if not len(known):
        return "–"
    return f"{say(float(np.median(known)))} ({say(known.min())} to {say(known.max())})"


def verdict(held: Sequence[bool]) -> Verdict:
    """All, some or none."""
    return "yes" if all(held) else "partly" if any(held) else "no"
