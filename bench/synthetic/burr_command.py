"""The table of burr detection, on synthetic partial scans.

    python -m bench.synthetic burrs [--seeds N] [--wheels N]

First: burrs of 2.0 and 1.5 mm, 0.6 degrees wide, on a stepped wheel of radius 80 to 100 mm, 140 degrees,
123,000 triangles, noise 0.05 mm along the normal; the grid of the vertices along the burr or at an angle to
it. Errors are median, worst and root mean square in units of the stated sigma. Second: all else that is said
of protrusions and nicks. Third: false calls on wheels without a burr. Three minutes.
"""

from __future__ import annotations

import argparse

import numpy as np
from rich.console import Console

from bench.synthetic.burr_measures import measure_rows
from bench.synthetic.burr_table import clean_rows, found_rows


def add_options(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.add_argument("--seeds", type=int, default=30)
    parser.add_argument("--wheels", type=int, default=504)


def run(given: argparse.Namespace) -> None:
    """Print both tables, row by row."""
    say = Console(soft_wrap=True, highlight=False).print
    say("grid | height mm | found | false | height mm: median, worst, pull | angle deg | area mm² | bound")
    for row in found_rows(given.seeds):
        each = [row.quantities[name].text(digits) for name, digits in DIGITS.items()] if row.found else []
        bound = np.median(row.bounds, axis=0) if row.bounds else (np.inf, np.inf)
        say(
            f"{row.grid} | {row.height_mm:g} | {row.found} of {row.runs} | {row.false} | "
            f"{' | '.join(each)} | {bound[0]:.4f} {bound[1]:.5f}"
        )
    say("", "side | found | quantity: median, worst, pull", sep="\n")
    for measured in measure_rows(given.seeds) if given.seeds else ():
        say(f"{measured.side} | {measured.found} of {measured.runs}")
        for name, tally in measured.quantities.items():
            say(f"  {name} | {tally.text(4)}")
        say(f"  normal deg | {np.median(measured.normal_deg):.3f} {max(measured.normal_deg):.3f}")
        say(f"  off the surface mm | {np.median(measured.off_mm):.4f} {max(measured.off_mm):.4f}")
    say("", "noise | arc deg | sigma mm | wheels | false calls | no answer", sep="\n")
    for clean in clean_rows(given.wheels):
        say(
            f"{clean.noise} | {clean.arc_deg:g} | {clean.sigma_mm:g} | {clean.wheels} | {clean.calls} | "
            f"{clean.unanswered}"
        )


DIGITS = {"height_mm": 3, "angle_deg": 4, "area_mm2": 3}
"""Decimals of each quantity measured, finer than its error."""
