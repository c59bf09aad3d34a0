"""Section 7: how many outliers the axis search bears."""

from __future__ import annotations

from functools import partial

import numpy as np

from bench.reproduction.axis_found import METHODS
from bench.reproduction.frames import Mesh, Method, searches
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Claim, Numbers, Section, Table, middle_half, verdict
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats

SHARES = (0.0, 0.01, 0.03, 0.1)
"""Of the vertices; a triangle has three, so nearly three times as many intersection points are wrong."""
REACHES_MM = (3.0, 30.0)
"""Standard deviation along the camera's ray: as of a burr, and as of a wrong column."""
FRAMES = 20
"""Random frames of each condition: the least from which the page tells a spread."""
BORNE_DEG = 5.0
"""Within it the descent still ended in the right basin."""
SEARCHES = {
    "seed": "seed",
    "seed_distance": "seed, whole distances",
    "seed_literal": "seed-literal",
    "default": "default",
}
"""Of figure 6, and what the table calls them."""


def with_outliers(vertices_mm: Floats, share: float, reach_mm: float, *, seed: int) -> Floats:
    """Vertices (V, 3) in the camera frame, a share of them moved along their rays by Gaussian steps."""
    rng = np.random.default_rng(seed)
    wrong = rng.random(len(vertices_mm)) < share
    moved = vertices_mm.copy()
    ray = moved[wrong] / np.linalg.norm(moved[wrong], axis=1)[:, None]
    moved[wrong] += reach_mm * rng.normal(size=(len(ray), 1)) * ray
    return moved


def errors_deg(scan: Scanned, method: Method, share: float, reach_mm: float, frames: int) -> Floats:
    """(frames,) a method's errors, each with outliers and a frame of its own."""

    def spoilt(k: int) -> Mesh:
        return with_outliers(scan.vertices_mm, share, reach_mm, seed=k), scan.faces

    found = searches(method, spoilt, frames, stream=7)
    return np.array([one.error_deg(scan.direction) for one in found])


def measure(lab: Lab) -> Numbers:
    """Errors of every method over shares and reaches, on the seed's own scan."""
    scan, frames = lab.scan("wheel", "seed"), lab.repeats(FRAMES)
    found = [
        [errors_deg(scan, method, share, reach, frames) for reach in REACHES_MM for share in SHARES]
        for method in (METHODS[key] for key in SEARCHES)
    ]
    return {"errors": np.array(found)}


def draw(n: Numbers) -> Section:
    """The table of medians and quartiles, and what is borne."""
    errors = n["errors"]
    conditions = [(reach, share) for reach in REACHES_MM for share in SHARES]
    near, far = (conditions.index((reach, SHARES[2])) for reach in REACHES_MM)
    rows = tuple(
        (name, *(_words(of) for of in row)) for name, row in zip(SEARCHES.values(), errors, strict=True)
    )
    heads = ("method", *(f"{share:.0%} off by {reach:g} mm" for reach, share in conditions))
    borne = [float(np.median(errors[0][k])) < BORNE_DEG for k in (near, far)]
    _, whole, _, own = errors
    return Section(
        title="Robustness to outliers",
        reports="Extended use of RANSAC estimation renders the algorithm robust against outliers (section "
        "7).",
        measured=f"A share of the vertices of the seed's scan is moved along the camera's rays, in "
        f"{errors.shape[2]} random frames. RANSAC guards the circles; two steps it does not guard: the "
        "planes "
        "are spread between the two extreme vertices, whatever these are, and f averages over the points "
        "that "
        f"RANSAC rejected. With {SHARES[2]:.0%} of the vertices {REACHES_MM[1]:g} mm off the seed is "
        f"{_words(errors[0][far])} off; with whole distances in f {_words(whole[far])}.",
        claims=(
            Claim(
                "7",
                "RANSAC renders the algorithm robust against outliers",
                "robust",
                f"{SHARES[2]:.0%} of the vertices off by {REACHES_MM[0]:g} mm: {_words(errors[0][near])}; by "
                f"{REACHES_MM[1]:g} mm: {_words(errors[0][far])}",
                f"{_words(own[near])}; {_words(own[far])}",
                verdict(borne),
                f"a median below {BORNE_DEG:g}° counts as borne. What breaks it: the planes' extent and f "
                "know "
                "no RANSAC; where f counts whole distances "
                f"it is {np.median(whole[near]):.1f}° and {np.median(whole[far]):.0f}°",
            ),
        ),
        tables=(Table(heads, rows, "Error of the axis: median (middle half), degrees"),),
    )


_words = partial(middle_half, say="{:.2g}°".format)
