"""Section 3.1: whether f is as steep in θ as in φ."""

from __future__ import annotations

from functools import partial

import numpy as np
from scipy.spatial.transform import Rotation

from bench.reproduction.lab import Lab
from bench.reproduction.orientation import angles_of, sectioned
from bench.reproduction.parts import Claim, Numbers, Section, Table, middle_half, verdict
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats

FRAMES = 40
"""Random frames: the paper's own is not known."""
STEPS_DEG = (30.0, 10.0)
"""The two discretisation steps of the paper's descent: slopes are taken over these."""
ALIKE = 2.0
"""Ratio of the rises: an ellipse of that condition steepest descent still follows in few steps."""

_HEADS = ("step", "10 % below", "25 %", "median", "75 %", "90 %", f"within a factor {ALIKE:g}")


def rises(scan: Scanned, turn: Floats, step_deg: float) -> tuple[float, float]:
    """Mean rise of f, mm, a step to both sides of the true axis along θ and along φ, in a turned frame."""
    vertices = np.ascontiguousarray((scan.vertices_mm - scan.vertices_mm.mean(axis=0)) @ turn.T)
    truth = angles_of(turn @ scan.direction)
    lowest = sectioned(vertices, scan.faces, truth).quality()

    def rise(side: Floats) -> float:
        ends = [sectioned(vertices, scan.faces, truth + sign * side).quality() for sign in (1.0, -1.0)]
        return float(np.mean(ends)) - lowest

    step = np.radians(step_deg)
    return rise(np.array([step, 0.0])), rise(np.array([0.0, step]))


def measure(lab: Lab) -> Numbers:
    """Rises along both angles in random frames, and the sine of φ at the true axis there."""
    scan = lab.scan("wheel", "seed")
    turns = Rotation.random(lab.repeats(FRAMES), random_state=17).as_matrix()
    found = {f"rises_{step:g}": np.array([rises(scan, turn, step) for turn in turns]) for step in STEPS_DEG}
    sines = [np.sin(angles_of(turn @ scan.direction)[1]) for turn in turns]
    return found | {"sine": np.array(sines)}


def draw(n: Numbers) -> Section:
    """Ratios of the rises for both steps."""
    ratios = {step: n[f"rises_{step:g}"][:, 0] / n[f"rises_{step:g}"][:, 1] for step in STEPS_DEG}
    alike = {step: float(np.mean((ratio > 1.0 / ALIKE) & (ratio < ALIKE))) for step, ratio in ratios.items()}
    side = n["sine"] > np.sin(np.radians(60.0))
    beside = {step: float(np.median(ratio[side])) if side.any() else np.nan for step, ratio in ratios.items()}
    words = "; ".join(f"{step:g}°: {_words(ratios[step])}" for step in STEPS_DEG)
    aside = ", ".join(f"{value:.2g}" for value in beside.values() if np.isfinite(value))
    rows = tuple(
        (f"{step:g}°", *(f"{q:.2g}" for q in np.percentile(ratios[step], [10, 25, 50, 75, 90])),
         f"{alike[step]:.0%}")
        for step in STEPS_DEG
    )  # fmt: skip
    share = float(np.mean(list(alike.values())))
    return Section(
        title="Symmetry in θ and φ",
        reports="The problem is more or less symmetrical for θ and φ, so gradient descent converges fast "
        "(section 3.1).",
        measured=f"The rise of f a step to both sides of the true axis, along θ over along φ, in "
        f"{len(n['sine'])} random frames: {words} (median, middle half). A step in θ moves the axis by its "
        "share sin φ only, so near the poles θ does little: where φ lies within 30° of 90° the ratios are "
        f"{aside or 'not known, no such frame'}.",
        claims=(
            Claim(
                "3.1, figure 10",
                "the problem is more or less symmetrical for θ and φ",
                "more or less",
                f"θ over φ, {words}",
                "–",
                verdict([share > 0.75, share > 0.25]),
                f"within a factor of {ALIKE:g} in {share:.0%} of frames and steps; it depends on how the "
                "wheel "
                "stands. Experiment: with the axis away from the poles the median ratios are "
                f"{aside or 'not known'}",
            ),
        ),
        tables=(Table(_HEADS, rows),),
    )  # fmt: skip


_words = partial(middle_half, say="{:.2g}".format)
