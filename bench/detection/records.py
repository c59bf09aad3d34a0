"""From the records of a run to detection curves, with the false calls they were bought with."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from bench.detection.curve import PodCurve, Share, shares
from bench.detection.hit_miss import fit_hit_miss
from bench.detection.signal import fit_signal
from bench.run.records import Record, count_failed
from bench.statistics.flips import mean_test
from burrscan.arrays import Bools, Floats
from burrscan.errors import InputError

Model = Literal["hit/miss", "signal"]
ALPHA = 0.05
"""Intervals of false calls hold for 95 of 100 such sets of scenes."""
ONE_SIZE = 1.05
"""Sizes within this factor are one."""


@dataclass(frozen=True)
class Detection:
    """What a variant detects. A detection curve says nothing without the false calls, so both stand here.

    Parameters
    ----------
    name
        The variant, and which of its cases.
    size_name
        What size means, such as ``height_mm``.
    curve
        The fit, or None where these burrs allow none; ``why_not`` says why.
    shares
        Found of all burrs by size, with exact bounds: what the curve is fitted to.
    false_calls_per_wheel, false_calls_interval
        Mean over cases with a result, with its 95 % interval over scenes.
    wheels
        Cases with a result.
    failed
        Cases without one; all their burrs count as missed.

    """

    name: str
    size_name: str
    curve: PodCurve | None
    why_not: str
    shares: tuple[Share, ...]
    false_calls_per_wheel: float
    false_calls_interval: tuple[float, float]
    wheels: int
    failed: int


def detections(
    records: Sequence[Record], *, by: str | None = None, size: str = "height_mm"
) -> list[Detection]:
    """A hit/miss curve for every variant, and for every value of a parameter such as ``finish``."""
    variants = dict.fromkeys(record.variant for record in records)
    values = dict.fromkeys(record.parameters.get(by) for record in records) if by else {None: None}
    return [
        detection(records, variant=variant, where={by: value} if by else {}, size=size)
        for variant in variants
        for value in values
    ]


def detection(
    records: Sequence[Record],
    *,
    variant: str,
    where: Mapping[str, Any] | None = None,
    burrs: Mapping[str, Any] | None = None,
    size: str = "height_mm",
    model: Model = "hit/miss",
    floor: bool = False,
    ceiling: bool = False,
) -> Detection:
    """How a variant's detection grows with burr size.

    Parameters
    ----------
    records
        Of a run, all variants: a failed case's burrs are known from the others.
    variant
        Which.
    where
        Case parameters to values, to look at some cases only, such as ``{"finish": "polished"}``.
    burrs
        Keys of the records' burr tables to values, to look at some burrs only, such as
        ``{"section": "flake"}``. False calls are those of all chosen cases: a false call is on no burr.
    size
        A burr's size: a key of the records' burr tables (``height_mm``, ``width_mm``), or a swept parameter
        (such as an incidence).
    model
        ``"hit/miss"``, or ``"signal"``: the measured height against the true one, with the
        lowest of those measured as the threshold.
    floor, ceiling
        See :func:`fit_hit_miss`; with ``"signal"``, ``ceiling`` allows hidden burrs.

    """
    chosen = [r for r in records if all(r.parameters.get(k) == v for k, v in (where or {}).items())]
    mine = [record for record in chosen if record.variant == variant]
    sizes, hits, heights = _burrs(mine, _known_burrs(chosen), burrs or {}, size)
    curve, why_not = None, "burrs of one size only: no curve"
    try:
        if of_one_size(sizes):
            pass
        elif model == "signal":
            lowest = float(np.nanmin(heights, initial=np.inf))
            curve = fit_signal(sizes, heights, threshold=lowest, hidden=ceiling)
        else:
            curve = fit_hit_miss(sizes, hits, floor=floor, ceiling=ceiling)
    except InputError as error:
        why_not = str(error)
    calls, interval, wheels = _false_calls(mine)
    return Detection(
        name=", ".join([variant, *(str(value) for value in {**(where or {}), **(burrs or {})}.values())]),
        size_name=size,
        curve=curve,
        why_not="" if curve else why_not,
        shares=shares(sizes, hits) if len(sizes) else (),
        false_calls_per_wheel=calls,
        false_calls_interval=interval,
        wheels=wheels,
        failed=count_failed(mine),
    )


def sections(records: Sequence[Record]) -> tuple[str, ...]:
    """The sections of the true burrs (triangle, rounded, rolled, flake), in the order in which they come."""
    return tuple(
        dict.fromkeys(
            str(burr["section"])
            for record in records
            for burr in record.burrs
            if burr.get("section") and burr["height_mm"] > 0.0
        )
    )


def of_one_size(sizes: Floats) -> bool:
    """Whether burrs are so much alike that the slope of a curve through them would be chance."""
    some = sizes[sizes > 0.0]
    return bool(len(some)) and bool(some.max() <= ONE_SIZE * some.min())


def _known_burrs(records: Sequence[Record]) -> dict[str, tuple[Mapping[str, Any], ...]]:
    """Case to its true burrs, from any variant that has them."""
    known: dict[str, tuple[Mapping[str, Any], ...]] = {}
    for record in records:
        known[record.case] = record.burrs or known.get(record.case, ())
    return known


def _burrs(
    records: Sequence[Record],
    known: Mapping[str, tuple[Mapping[str, Any], ...]],
    which: Mapping[str, Any],
    size: str,
) -> tuple[Floats, Bools, Floats]:
    """True sizes (N,), found or not, heights measured (NaN: none)."""
    rows = [
        row
        for record in records
        for row in _rows(
            record,
            [
                burr
                for burr in record.burrs or known[record.case]
                if all(burr.get(key) == value for key, value in which.items())
            ],
            size,
        )
    ]
    table = np.array(rows, dtype=float).reshape(-1, 3)
    return table[:, 0], table[:, 1] > 0.0, table[:, 2]


def _rows(
    record: Record, burrs: Sequence[Mapping[str, Any]], size: str
) -> Iterator[tuple[float, bool, float]]:
    for burr in burrs:
        found = bool(burr["found"]) and record.failure is None
        error = burr.get("height_error_mm") if found else None  # a method may call a burr and state no height
        measured = np.nan if error is None else burr["height_mm"] + error
        yield float(burr.get(size, record.parameters.get(size, np.nan))), found, float(measured)


def _false_calls(records: Sequence[Record]) -> tuple[float, tuple[float, float], int]:
    """Mean false calls over cases with a result, its interval over scenes, and how many cases."""
    scenes: dict[str, list[float]] = {}
    for record in records:
        if record.failure is None:
            scenes.setdefault(record.scene_hash, []).append(record.metrics.get("false_calls", np.nan))
    test = mean_test(np.array([np.mean(calls) for calls in scenes.values()]))
    low, high = test.interval(ALPHA)
    return test.value, (max(low, 0.0), high), sum(map(len, scenes.values()))
