"""The table of false calls, on clean single views of ordinary parts.

    python -m bench.synthetic clean [--parts NAME ...] [--views N] [--first N] [--noise SHARE]
                                    [--reach PIXELS]

Closed parts drawn at random, each seen once by an orthographic depth camera of 200 pixels from a random
direction, in a random pose, with noise along the rays (a thousandth of the part's size), each pixel's own or
alike over a few pixels. None has a burr: every call is false. Treads, spokes, flutes and handles are no
surfaces of revolution: they are there. Half a second a view.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass

import numpy as np
from rich.console import Console

from bench.synthetic.axis_parts import fluted, handled, oval
from bench.synthetic.depth_view import posed_view
from bench.synthetic.ordinary_parts import PARTS as ORDINARY
from bench.synthetic.ordinary_parts import Mesh
from bench.synthetic.revolution import axis_angle_deg
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.errors import InputError

PARTS = {**ORDINARY, "flutes": fluted, "handles": handled, "ovals": oval}
"""Kinds of parts, each with a number of its own from which its views are drawn."""
_OFF_DEG = 1.0
"""An axis further off than this that is given as certain is a bluff."""


@dataclass(frozen=True)
class CleanView:
    """One view: ``refused`` where there was no answer, else how far the axis is off, and the burrs called.

    ``flagged`` where something of the axis is left open, so that it is not given as certain.
    """

    number: int
    refused: bool
    flagged: bool
    axis_deg: float
    burrs: tuple[str, ...]


def clean_view(part: str, number: int, *, noise: float, reach_px: float = 0.0) -> CleanView:
    """Inspect the ``number``-th view of a kind of part; noise as a share of its size, and its reach."""
    (points, faces), direction = seen(part, number, noise=noise, reach_px=reach_px)
    try:
        found = inspect_mesh(points, faces)
    except InputError:
        return CleanView(number, refused=True, flagged=False, axis_deg=np.nan, burrs=())
    burrs = tuple(
        f"{burr.side} {burr.height_mm.value:.2f} mm high, {burr.length_mm.value:.1f} long"
        for burr in found.burrs
    )
    off_deg = axis_angle_deg(found.axis.direction, direction)
    return CleanView(number, False, bool(found.axis.undetermined), off_deg, burrs)


def seen(part: str, number: int, *, noise: float, reach_px: float = 0.0) -> tuple[Mesh, Floats]:
    """What is seen of a part, and the direction of its axis."""
    mesh, pose, _ = drawn(part, number, noise=noise, reach_px=reach_px)
    return mesh, pose[:3, 2]


def drawn(part: str, number: int, *, noise: float, reach_px: float = 0.0) -> tuple[Mesh, Floats, float]:
    """What is seen of a part, the pose (4, 4) that the part has, and the noise along the rays, mm."""
    rng = np.random.default_rng((list(PARTS).index(part), number))
    vertices, faces = PARTS[part](rng)
    sigma = noise * float(np.ptp(vertices, axis=0).max())
    points, triangles, pose = posed_view(
        vertices, faces, rng, sigma=sigma, reach_px=reach_px, seed=(number, list(PARTS).index(part))
    )
    return (points, triangles), pose, sigma


def add_options(parser: argparse.ArgumentParser) -> None:
    """What the command takes."""
    parser.add_argument("--parts", nargs="+", default=list(PARTS), choices=list(PARTS), metavar="NAME")
    parser.add_argument("--views", type=int, default=50, help="of each kind")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--noise", type=float, default=0.001, help="share of the part's size")
    parser.add_argument("--reach", type=float, default=0.0, help="pixels over which noise is alike; 0: none")


def run(given: argparse.Namespace) -> None:
    """Print a row for each kind, and each view with a call."""
    say = Console(soft_wrap=True, highlight=False).print
    say("parts | views | refused | flagged | given, axis off by > 1° | calls | views with one")
    for part in given.parts:
        views = [
            clean_view(part, given.first + k, noise=given.noise, reach_px=given.reach)
            for k in range(given.views)
        ]
        called = [view for view in views if view.burrs]
        say(
            f"{part} | {len(views)} | {sum(view.refused for view in views)} | "
            f"{sum(view.flagged for view in views)} | "
            f"{sum(view.axis_deg > _OFF_DEG for view in views if not view.flagged)} | "
            f"{sum(len(view.burrs) for view in views)} | {len(called)}"
        )
        for view in called:
            say(f"  view {view.number}, axis off by {view.axis_deg:.2g}°: {'; '.join(view.burrs)}")
