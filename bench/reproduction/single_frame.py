"""Sections 1 and 2: many pictures against a single one, and how long a scan takes."""

from __future__ import annotations

import numpy as np

from bench.reproduction.clocked import FRAME_MS
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Claim, Numbers, Section, Table, number
from bench.reproduction.photometry import MOST, VIEWS
from bench.reproduction.range_scan import distances_mm
from burrscan.arrays import Floats

SCANS = {
    "seed": "Gray code and sines in adapted light (seed)",
    "single_shot": "adapted stripes in one picture, after [11]",
    "adaptive": "default",
}
ONLINE_S = 0.1
"""Of a robot that follows what it sees: ten looks a second, the slowest that visual servoing is used with."""
_COVERED, _MEDIAN, _FAR, _FRAMES = range(4)
"""Columns of a view's numbers."""
_SHOWN, _COMPUTED = range(2)
"""Columns of the times, seconds."""


def measure(lab: Lab) -> Numbers:
    """Coverage, distances to the truth and pictures for every view; what one at full size takes."""
    turns = lab.turns_deg(VIEWS)
    rows = np.empty((len(SCANS), len(turns), 4))
    for view, turn in enumerate(turns):
        for row, method in zip(rows, SCANS, strict=True):
            scan = lab.glance("wheel", method, spin_deg=turn)
            row[view] = (scan.coverage(), *distances_mm(scan), number(scan.arrays, "frames"))
    whole = [lab.scan("wheel", method).arrays for method in SCANS]
    times = [(1e-3 * number(each, "shown_ms"), number(each, "computed_s")) for each in whole]
    return {"rows": rows, "times": np.array(times)}


def draw(n: Numbers) -> Section:
    """A table of what pictures buy, and the verdicts."""
    seed, single, default = (np.nanmedian(of, axis=0) for of in n["rows"])
    rows = tuple(
        (title, *_cells(of), f"{times[_SHOWN]:.1f} s", f"{times[_COMPUTED]:.2f} s")
        for title, of, times in zip(SCANS.values(), n["rows"], n["times"], strict=True)
    )
    total = {name: float(times.sum()) for name, times in zip(SCANS, n["times"], strict=True)}
    many, one = n["times"][:2]
    at_once = 1e-3 * FRAME_MS * float(seed[_FRAMES])
    a, b = n["rows"][:2]
    nearer = a[:, _MEDIAN] < np.nan_to_num(b[:, _MEDIAN], nan=np.inf)
    share = float(np.mean(nearer & (a[:, _COVERED] > b[:, _COVERED])))
    return Section(
        title="Many pictures, one picture, and latency",
        reports="The scanner can deliver its data on the fly; online control needs high speed and low "
        "latency "
        "(section 1). A similar adaptive strategy was presented for single frames in real time [11].",
        measured=f"In {n['rows'].shape[1]} views all around on half the raster; times of one at full size. A "
        f"picture lasts its exposure, and {FRAME_MS:.1f} ms at least. The seed's {seed[_FRAMES]:.0f} "
        f"pictures last {many[_SHOWN]:.1f} s and its decoding and mesh take {many[_COMPUTED]:.2f} s of one "
        f"core; a single picture (with the bracket that exposes it, {single[_FRAMES]:.0f}) {one[_SHOWN]:.1f} "
        f"s and {one[_COMPUTED]:.2f} s.",
        claims=(
            Claim("2", "Gray code with sines measures better than a single adapted frame [11]",
                  "chosen for the wheel",
                  f"{_short(seed)}; single frame {_short(single)}", _short(default),
                  "yes" if share >= MOST else "partly" if share > 0.0 else "no",
                  f"more measured and closer in {share:.0%} of the views, {MOST:.0%} count; our single frame "
                  "is after the idea of [11], not its code"),
            Claim("1", "the scanner can deliver its data on the fly", "on the fly",
                  f"{total['seed']:.1f} s to a mesh; single frame {total['single_shot']:.1f} s",
                  f"{total['adaptive']:.1f} s",
                  "yes" if total["seed"] < ONLINE_S else "partly" if at_once < 1.0 else "no",
                  f"below {ONLINE_S:g} s would be. Exposures of up to 200 ms decide; with light for "
                  f"{FRAME_MS:.0f} ms each, the seed's pictures would last {at_once:.2f} s. The paper has no "
                  "figure; its single-frame forerunner [11] is what it calls real-time"),
        ),
        tables=(Table(("scan", "measured", "median distance", "over 1 mm off", "pictures", "they last",
                       "computing"), rows, "Median (least to largest) of the views"),),
    )  # fmt: skip


def _short(of: Floats) -> str:
    return f"{of[_COVERED]:.0%} measured, {1e3 * of[_MEDIAN]:.0f} µm off, {of[_FRAMES]:.0f} pictures"


def _cells(of: Floats) -> tuple[str, ...]:
    def span(column: int, form: str, factor: float = 1.0) -> str:
        low, middle, high = factor * np.array(
            [statistic(of[:, column]) for statistic in (np.nanmin, np.nanmedian, np.nanmax)]
        )
        return f"{middle:{form}} ({low:{form}} to {high:{form}})"

    return (
        span(_COVERED, ".1%"),
        span(_MEDIAN, ".0f", 1e3) + " µm",
        span(_FAR, ".2%"),
        span(_FRAMES, ".0f"),
    )
