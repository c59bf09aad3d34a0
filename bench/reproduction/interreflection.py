"""Section 2: what interreflected light does to the code."""

from __future__ import annotations

import numpy as np

from bench.reproduction.lab import Lab
from bench.reproduction.parts import SIDES, Claim, Numbers, Section, Table, both
from bench.reproduction.photometry import VIEWS_DEG, figures
from burrscan.arrays import Floats

PAIRS = {"wheel": ("wheel", "direct"), "stepped hub": ("hub", "hub-direct")}
"""Scenes as they are, and traced without light of a second surface."""
METHODS = {"seed": "seed", "default": "adaptive"}
WORSE = 1.5
"""Times the share of wrong pixels, or their RMS, without interreflection."""


def measure(lab: Lab) -> Numbers:
    """Coverage, wrong pixels and RMS of both variants with interreflection and without."""
    return {
        f"{variant}_{name}": np.array([
            [figures(lab.scan(scene, method, spin_deg=view)) for view in VIEWS_DEG] for scene in scenes
        ])
        for variant, method in METHODS.items()
        for name, scenes in PAIRS.items()
    }  # fmt: skip


def draw(n: Numbers) -> Section:
    """A table, and whether interreflection is what the paper fears."""
    medians = {v: {name: np.median(n[f"{v}_{name}"], axis=1) for name in PAIRS} for v in SIDES}
    rows = tuple(
        (f"{v}, {name}{', direct light only' if k else ''}", f"{of[k, 0]:.1%}", f"{of[k, 1]:.2%}",
         f"{of[k, 2]:.3f} px")
        for v in SIDES for name, of in medians[v].items() for k in (0, 1)
    )  # fmt: skip
    worse = [_worse(medians["seed"][name]) for name in PAIRS]
    return Section(
        title="Interreflection",
        reports="Interreflections and scattering affect not only the pixels that are lit: even binary "
        "patterns are washed out in a complete area, and artefacts occur sooner where they are combined "
        "with interferometry (section 2).",
        measured="The same scenes traced with light of up to three surfaces and of one only. Wrong pixels of "
        f"the seed's scan (median of {len(VIEWS_DEG)} views): "
        + "; ".join(f"{name} {_wrong(medians['seed'][name])}" for name in PAIRS)
        + ".",
        claims=(
            Claim("2", "interreflection makes artefacts in codes with sines", "washed out in an area",
                  *both(lambda v: _both(medians[v])),
                  "yes" if all(worse) else "partly" if any(worse) else "no",
                  f"wrong pixels or RMS {WORSE:g} times as many with it as without counts"),
        ),
        tables=(Table(("scan", "measured", "wrong by over a pixel", "RMS of the others"), rows),),
    )  # fmt: skip


def _worse(of: Floats) -> bool:
    return bool(of[0, 1] > WORSE * of[1, 1] or of[0, 2] > WORSE * of[1, 2])


def _wrong(of: Floats) -> str:
    return f"{of[0, 1]:.2%} with it, {of[1, 1]:.2%} without"


def _both(of: dict[str, Floats]) -> str:
    return "; ".join(
        f"{name}: {_wrong(one)}, RMS {one[0, 2]:.3f} and {one[1, 2]:.3f} px" for name, one in of.items()
    )
