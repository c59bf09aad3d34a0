"""The table of bluffs: axes that are grossly off and given as certain, on single views of parts.

    python -m bench.synthetic bluff [--families NAME ...] [--parts N] [--seed S] [--method NAME] [--json FILE]

Parts drawn at random (round, short, fluted, treaded, spoked, with handles, oval within tolerance), each seen
once by an orthographic depth camera of 200 pixels from a random direction, in a random pose. Noise along the
rays of 0.05 to 0.2 % of the part's size, each pixel's own or correlated over 1.5, 4 or 10 pixels. Off is more
than 1°; off its place, by what 1° moves at the scan's rms radius and by more than five stated deviations. A
refused axis is one that the method did not give, a flagged one has something left open. A quarter of a second
a part.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import asdict
from pathlib import Path

from rich.console import Console
from rich.progress import track

from bench.score.shape import OFF_DEG
from bench.synthetic.axis_parts import FAMILIES
from bench.synthetic.bluff_table import Tally, Verdict, by, tally, verdict
from burrscan.axis import METHODS
from burrscan.documents import json_text
from burrscan.files import write_text
from burrscan.variants import resolve

HEADS = (
    "parts",
    "views",
    "refused",
    "good refused",
    "flagged",
    "given",
    "off > 1°",
    "> 5 σ",
    "place",
    "95 % hold",
)
_STANDARD_OUTPUT = Path("-")


def add_options(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.add_argument(
        "--families", nargs="+", default=list(FAMILIES), choices=list(FAMILIES), metavar="NAME"
    )
    parser.add_argument("--parts", type=_positive, default=50, metavar="N", help="of each family")
    parser.add_argument("--seed", type=_not_negative, default=0, metavar="S", help="other parts, other noise")
    parser.add_argument("--method", default="profile", metavar="NAME", help="of finding the axis")
    parser.add_argument("--json", type=Path, metavar="FILE", help="every view and the counts; - for stdout")


def run(given: argparse.Namespace) -> None:
    """Print a row for each family and for each reach of the noise, the limit, and every axis that is off."""
    resolve(given.method, METHODS, stage="axis method")  # or every view would count as refused
    to_stdout = given.json == _STANDARD_OUTPUT
    say = Console(soft_wrap=True, highlight=False, stderr=to_stdout).print
    tasks = [(family, number) for family in given.families for number in range(given.parts)]
    shown = track(tasks, "views", console=Console(stderr=True), transient=True)
    verdicts = [verdict(family, number, seed=given.seed, method=given.method) for family, number in shown]
    say(" | ".join(HEADS))
    for family, own in by(verdicts, "family").items():
        say(_row(family, tally(own)))
    say(_row("all", whole := tally(verdicts)))
    for reach_px, own in sorted(by(verdicts, "reach_px").items()):
        say(_row(f"noise over {reach_px:g} px" if reach_px else "noise of each pixel", tally(own)))
    say(
        f"off by more than {OFF_DEG:g}° and given as certain: {whole.gross} of {whole.given}; "
        f"at most {100.0 * whole.most_gross:.2f} % (exact, one-sided 95 %)"
    )
    for one in verdicts:
        if one.gross:
            say(
                f"  {one.family} {one.number}, noise over {one.reach_px:g} px: off by {one.off_deg:.2f}°, "
                f"sigma {one.sigma_deg:.2g}°, probability {one.gross_probability:.2g}"
            )
    for one in verdicts:
        if one.misplaced:
            say(
                f"  {one.family} {one.number}, noise over {one.reach_px:g} px: {one.aside_mm:.2f} mm off its "
                f"place, {one.aside_sigmas:.0f} of its deviations, at a radius of {one.radius_mm:.1f} mm"
            )
    if given.json:
        _write(given.json, _document(given, verdicts))


def _row(name: str, counts: Tally) -> str:
    held = (
        f"{100.0 * counts.held:.1f} ± {100.0 * counts.held_within:.1f} %"
        if math.isfinite(counts.held)
        else "–"
    )
    numbers = (
        counts.views,
        counts.refused,
        f"{counts.good_refused} of {counts.good}",
        counts.flagged,
        counts.given,
        counts.gross,
        counts.beyond,
        counts.misplaced,
    )
    return " | ".join([name, *map(str, numbers), held])


def _document(given: argparse.Namespace, verdicts: list[Verdict]) -> dict[str, object]:
    return {
        "format": "burrscan-bluffs",
        "version": 1,
        "method": given.method,
        "seed": given.seed,
        "parts": given.parts,
        "all": asdict(tally(verdicts)),
        "families": {family: asdict(tally(own)) for family, own in by(verdicts, "family").items()},
        "noise": {
            f"{reach_px:g}": asdict(tally(own)) for reach_px, own in sorted(by(verdicts, "reach_px").items())
        },
        "views": [asdict(one) for one in verdicts],
    }


def _write(path: Path, document: dict[str, object]) -> None:
    if path == _STANDARD_OUTPUT:
        sys.stdout.write(json_text(document))
        return
    write_text(path, json_text(document))


def _positive(text: str) -> int:
    if (value := int(text)) < 1:
        raise argparse.ArgumentTypeError(f"{text}: at least 1")
    return value


def _not_negative(text: str) -> int:
    if (value := int(text)) < 0:
        raise argparse.ArgumentTypeError(f"{text}: 0 or more")
    return value
