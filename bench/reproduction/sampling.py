"""Figure 5: orientations picked evenly in the angles, and evenly over the sphere."""

from __future__ import annotations

import numpy as np

from bench.plotting.pictures import view_from
from bench.reproduction.drawing import Layer, dots, equal_axes
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Claim, Numbers, Picture, Section, number
from burrscan.arrays import Floats
from burrscan.axis.fitting.starts import hemisphere
from burrscan.axis.rivals.seed import orientation_grid

SHOWN = 24
"""Angles a side of the dense grid that is drawn and measured, beside the three of the paper's first look."""
_VIEW = view_from(azimuth_deg=25.0, elevation_deg=28.0)
"""So that the pole, where the paper's rule crowds, is in view."""


def directions_of(grid: Floats) -> Floats:
    """(N, 3) unit vectors of orientations (θ, φ)."""
    theta, phi = grid.T
    return np.column_stack([np.cos(theta) * np.sin(phi), np.sin(theta) * np.sin(phi), np.cos(phi)])


def unevenness(directions: Floats) -> float:
    """Most over fewest directions in eight bands of equal area between the poles; 1 is even."""
    counts = np.histogram(np.minimum(directions[:, 2] + 1e-9, 1.0), bins=8, range=(-1.0, 1.0))[0]
    return float(counts.max() / max(counts.min(), 1))


def distinct(directions: Floats) -> int:
    """How many different lines, senses left aside."""
    near = np.abs(directions @ directions.T) > 1.0 - 1e-9
    return int(sum(not near[k, :k].any() for k in range(len(near))))


def farthest_deg(directions: Floats) -> float:
    """The angle from the worst placed line to the nearest direction."""
    cosine = np.abs(hemisphere(4000) @ directions.T).max(axis=1)
    return float(np.degrees(np.arccos(np.clip(cosine.min(), -1.0, 1.0))))


def measure(lab: Lab) -> Numbers:  # noqa: ARG001 (every section is handed the lab)
    """Both samplings, dense for the picture and with the paper's n = 3, and the default's 50 starts."""
    found: dict[str, Floats] = {}
    for name in ("naive", "uniform"):
        dense, few = (directions_of(orientation_grid(n, name)) for n in (SHOWN, 3))
        found |= {
            f"{name}_points": dense,
            f"{name}_unevenness": np.asarray(unevenness(dense)),
            f"{name}_distinct": np.asarray(float(distinct(few))),
            f"{name}_farthest": np.asarray(farthest_deg(few)),
        }
    even = hemisphere(SHOWN * SHOWN)
    both = np.concatenate([even, -even])
    return found | {
        "default_points": both,
        "default_unevenness": np.asarray(unevenness(both)),
        "default_farthest": np.asarray(farthest_deg(hemisphere(120))),
    }


def draw(n: Numbers) -> Section:
    """The three samplings on the sphere."""
    naive, even, ours = (number(n, f"{k}_unevenness") for k in ("naive", "uniform", "default"))
    return Section(
        title="Figure 5: sampling orientations",
        reports="Angles picked evenly crowd at the poles; φ = cos⁻¹(2j/n − 1) puts the same number of "
        "points in every area. n = 3 gives 9 evaluations.",
        measured=f"In 8 bands of equal area the fullest has {naive:.1f} times the emptiest with even "
        f"angles, {even:.2f} times with the paper's rule (n = {SHOWN}). But at n = 3 the rule visits one "
        f"pole three times and never the other: {number(n, 'uniform_distinct'):.0f} distinct axes of 9, and "
        f"the worst placed axis is {number(n, 'uniform_farthest'):.0f}° from the nearest of them. The "
        "default starts from 120 directions of a spiral, never more than "
        f"{number(n, 'default_farthest'):.0f}° away.",
        claims=(
            Claim("3.1, figure 5", "φ = cos⁻¹(2j/n − 1) samples the sphere evenly", "even",
                  f"fullest over emptiest band {even:.2f} (naive: "
                  f"{naive:.1f})", f"{ours:.2f} (spiral)", "yes"),
            Claim("3.1", "n = 3 is 9 evaluations of different orientations", "9",
                  f"9, of {number(n, 'uniform_distinct'):.0f} distinct axes", "120 starts",
                  "partly", "j runs from 0 to n − 1, so φ = π occurs n times and φ = 0 never"),
        ),
        pictures=(
            _sphere(n, "naive", "Even in the angles: φ = jπ/n"),
            _sphere(n, "uniform", "The paper's: φ = cos⁻¹(2j/n − 1)"),
            _sphere(n, "default", "The default's spiral"),
        ),
    )  # fmt: skip


def _sphere(n: Numbers, name: str, title: str) -> Picture:
    points = n[f"{name}_points"]
    both = np.concatenate([points, -points]) if name != "default" else points
    seen = both @ _VIEW.T
    front = seen[:, 2] > 0.0
    axes = equal_axes(np.array([[-1.0, -1.0], [1.0, 1.0]]), "", "")
    layers = [Layer(seen[~front, :2], "#c4ccd6", 3), Layer(seen[front, :2], "#1463b5", 5)]
    return Picture(title, axes.svg([dots(axes, layers)], title))
