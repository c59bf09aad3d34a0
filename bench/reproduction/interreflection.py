"""Section 2: what interreflected light does to the code."""

from __future__ import annotations

import numpy as np

from bench.reproduction.lab import Lab
from bench.reproduction.parts import MOST, SIDES, Claim, Numbers, Section, Table, both, verdict
from bench.reproduction.photometry import figures
from burrscan.arrays import Floats

PAIRS = {"wheel": ("wheel", "direct"), "stepped hub": ("hub", "hub-direct")}
"""Scenes as they are, and traced without light of a second surface."""
METHODS = {"seed": "seed", "default": "adaptive"}
WORSE = 1.5
"""Times the share of wrong pixels, or their RMS, without interreflection."""


def measure(lab: Lab) -> Numbers:
    """Coverage, wrong pixels and RMS of both variants with interreflection and without, by scene and view."""
    turns = lab.turns_deg()
    found = {f"{variant}_{name}": np.empty((2, len(turns), 3)) for variant in METHODS for name in PAIRS}
    for name, pair in PAIRS.items():
        for light, scene in enumerate(pair):
            for view, turn in enumerate(turns):
                for variant, method in METHODS.items():
                    scan = lab.glance(scene, method, spin_deg=turn)
                    found[f"{variant}_{name}"][light, view] = figures(scan)
    return found


def draw(n: Numbers) -> Section:
    """A table, and whether interreflection is what the paper fears."""
    medians = {v: {name: np.median(n[f"{v}_{name}"], axis=1) for name in PAIRS} for v in SIDES}
    rows = tuple(
        (f"{v}, {name}{', direct light only' if k else ''}", f"{of[k, 0]:.1%}", f"{of[k, 1]:.2%}",
         f"{of[k, 2]:.3f} px")
        for v in SIDES for name, of in medians[v].items() for k in (0, 1)
    )  # fmt: skip
    worse = [_worse(n[f"seed_{name}"]) for name in PAIRS]
    views = n[f"seed_{next(iter(PAIRS))}"].shape[1]
    return Section(
        title="Interreflection",
        reports="Interreflections and scattering affect not only the pixels that are lit: even binary "
        "patterns are washed out in a complete area, and artefacts occur sooner where they are combined "
        "with interferometry (section 2).",
        measured="The same scenes traced with light of up to three surfaces and of one only. Wrong pixels of "
        f"the seed's scan (median of {views} views all around): "
        + "; ".join(f"{name} {_wrong(medians['seed'][name])}" for name in PAIRS)
        + ".",
        claims=(
            Claim("2", "interreflection makes artefacts in codes with sines", "washed out in an area",
                  *both(lambda v: _both(medians[v])),
                  verdict(worse),
                  f"wrong pixels or RMS {WORSE:g} times as many with it as without counts, in {MOST:.0%} "
                  "of the views"),
        ),
        tables=(Table(("scan", "measured", "wrong by over a pixel", "RMS of the others"), rows),),
    )  # fmt: skip


def _worse(of: Floats) -> bool:
    """Whether (light, view, figure) are worse with interreflection, by either figure, in most views."""
    more = of[0, :, 1:] > WORSE * of[1, :, 1:]
    return bool(more.mean(axis=0).max() >= MOST)


def _wrong(of: Floats) -> str:
    return f"{of[0, 1]:.2%} with it, {of[1, 1]:.2%} without"


def _both(of: dict[str, Floats]) -> str:
    return "; ".join(
        f"{name}: {_wrong(one)}, RMS {one[0, 2]:.3f} and {one[1, 2]:.3f} px" for name, one in of.items()
    )
