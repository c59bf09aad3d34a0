"""Sections 1 and 2: many pictures against a single one, and how long a scan takes."""

from __future__ import annotations

import numpy as np

from bench.reproduction.clocked import FRAME_MS
from bench.reproduction.lab import Lab
from bench.reproduction.parts import MOST, Claim, Numbers, Section, Table, number, verdict, whole_range
from bench.reproduction.range_scan import distances_mm
from burrscan.arrays import Floats

SCANS = {
    "seed": "Gray code and sines in adapted light (seed)",
    "single_shot": "adapted stripes in one picture, after [11]",
    "adaptive": "default",
}
ONLINE_S = 0.1
"""Of a robot that follows what it sees: ten looks a second, the slowest that visual servoing is used with."""
_COVERED, _MEDIAN, _FAR, _FRAMES, _SHOWN, _COMPUTED = range(6)
"""Columns of a view's numbers."""


def measure(lab: Lab) -> Numbers:
    """Coverage, distances to the truth, pictures, their time and the computer's, for every view.

    At full size: on half the raster a single frame's stripes are too fine to be told apart.
    """
    turns = lab.turns_deg()
    rows = np.empty((len(SCANS), len(turns), 6))
    for view, turn in enumerate(turns):
        for row, method in zip(rows, SCANS, strict=True):
            scan = lab.scan("wheel", method, spin_deg=turn)
            shown, computed = (number(scan.arrays, key) for key in ("shown_ms", "computed_s"))
            distances = distances_mm(scan)
            row[view] = scan.coverage(), *distances, number(scan.arrays, "frames"), 1e-3 * shown, computed
    return {"rows": rows}


def draw(n: Numbers) -> Section:
    """A table of what pictures buy, and the verdicts."""
    seed, single, default = (_medians(of) for of in n["rows"])
    rows = tuple((title, *_cells(of)) for title, of in zip(SCANS.values(), n["rows"], strict=True))
    total = {
        name: of[_SHOWN] + of[_COMPUTED] for name, of in zip(SCANS, (seed, single, default), strict=True)
    }
    at_once = 1e-3 * FRAME_MS * float(seed[_FRAMES])
    a, b = n["rows"][:2]
    nearer = float(np.mean(a[:, _MEDIAN] < np.nan_to_num(b[:, _MEDIAN], nan=np.inf)))
    more = float(np.mean(a[:, _COVERED] > b[:, _COVERED]))
    return Section(
        title="Many pictures, one picture, and latency",
        reports="The scanner can deliver its data on the fly; online control needs high speed and low "
        "latency "
        "(section 1). A similar adaptive strategy was presented for single frames in real time [11].",
        measured=f"In {n['rows'].shape[1]} views all around. A "
        f"picture lasts its exposure, and {FRAME_MS:.1f} ms at least. The seed's {seed[_FRAMES]:.0f} "
        f"pictures last {seed[_SHOWN]:.1f} s and its decoding and mesh take {seed[_COMPUTED]:.2f} s of one "
        f"core; a single picture (with the bracket that exposes it, {single[_FRAMES]:.0f}) "
        f"{single[_SHOWN]:.1f} s and {single[_COMPUTED]:.2f} s.",
        claims=(
            Claim("2", "Gray code with sines measures better than a single adapted frame [11]",
                  "chosen for the wheel",
                  f"{_short(seed)}; single frame {_short(single)}", _short(default),
                  verdict([more >= MOST, nearer >= MOST]),
                  f"it measures more in {more:.0%} of the views and is closer in {nearer:.0%}: the single "
                  "frame keeps the easiest pixels only. Ours is after the idea of [11], not its code"),
            Claim("1", "the scanner can deliver its data on the fly", "on the fly",
                  f"{total['seed']:.1f} s to a mesh; single frame {total['single_shot']:.1f} s",
                  f"{total['adaptive']:.1f} s",
                  verdict([total["seed"] < ONLINE_S, at_once < 1.0]),
                  f"below {ONLINE_S:g} s would be. Exposures of up to 200 ms decide; with light for "
                  f"{FRAME_MS:.0f} ms each, the seed's pictures would last {at_once:.2f} s. The paper has no "
                  "figure; its single-frame forerunner [11] is what it calls real-time"),
        ),
        tables=(Table(("scan", "measured", "median distance", "over 1 mm off", "pictures", "they last",
                       "computing"), rows, "Median (least to largest) of the views"),),
    )  # fmt: skip


def _medians(of: Floats) -> Floats:
    """(columns,) medians over the views that know a number; NaN where none does."""
    known = [column[np.isfinite(column)] for column in of.T]
    return np.array([np.median(each) if len(each) else np.nan for each in known])


def _short(of: Floats) -> str:
    return f"{of[_COVERED]:.0%} measured, {1e3 * of[_MEDIAN]:.0f} µm off, {of[_FRAMES]:.0f} pictures"


def _cells(of: Floats) -> tuple[str, ...]:
    def span(column: int, form: str, factor: float = 1.0) -> str:
        return whole_range(factor * of[:, column], f"{{:{form}}}".format)

    return (
        span(_COVERED, ".1%"),
        span(_MEDIAN, ".0f", 1e3) + " µm",
        span(_FAR, ".2%"),
        span(_FRAMES, ".0f"),
        span(_SHOWN, ".1f") + " s",
        span(_COMPUTED, ".2f") + " s",
    )
