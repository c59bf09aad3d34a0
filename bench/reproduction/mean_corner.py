"""Section 3.2, step 4: a triangle's mean corner in place of its intersection with the plane."""

from __future__ import annotations

from functools import partial

import numpy as np

from bench.reproduction.cost import simplified
from bench.reproduction.lab import Lab
from bench.reproduction.noise import PAPER_MM, along_rays
from bench.reproduction.orientation import PLANES, TOLERANCE_MM, angles_of
from bench.reproduction.parts import Claim, Numbers, Section, Table, middle_half, verdict
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.rivals.seed import nearest_to_others, quality_of
from burrscan.axis.sections import fit_circles, sections, turned_to_z

DRAWS = 20
"""Orientations about the true one, each with RANSAC samples and noise of its own."""
ASKEW_DEG = 1.0
"""What the axis search leaves: sections are never cut quite squarely."""
KEPT = (1.0, 0.1, 0.02)
"""Shares of the triangles: the mean corner stands for triangles that are small."""
NOISES_MM = (0.0, PAPER_MM)
"""As our scans are, and as the paper's were."""


def crossed(vertices_mm: Floats, faces: Ints32, turn: Floats, planes: int) -> tuple[Floats, Ints]:
    """Where planes really meet triangles: middles (M, 3) of the segments, turned, and the planes (M,)."""
    turned = vertices_mm @ turn.T
    low, high = turned[:, 2].min(), turned[:, 2].max()
    corners = turned[faces]
    points, index = [], []
    for plane in range(1, planes):
        above = corners[:, :, 2] - (low + plane * (high - low) / planes)
        cut = (above.min(axis=1) < 0.0) & (above.max(axis=1) > 0.0)
        total, count = np.zeros((int(cut.sum()), 3)), np.zeros((int(cut.sum()), 1))
        for a, b in ((0, 1), (1, 2), (2, 0)):
            p, q, h, k = corners[cut, a], corners[cut, b], above[cut, a], above[cut, b]
            meets = (h < 0.0) != (k < 0.0)
            at = np.where(meets, h / np.where(meets, h - k, 1.0), 0.0)[:, None]
            total += meets[:, None] * (p + at * (q - p))
            count += meets[:, None]
        points.append(total / count)
        index.append(np.full(len(count), plane, np.int64))
    return np.concatenate(points), np.concatenate(index)


def compared(scan: Scanned, faces: Ints32, vertices: Floats, angles: Floats, seed: int) -> list[float]:
    """Of mean corners and of real intersections: f, mm, and the location's distance to the true axis, mm."""
    turn = turned_to_z(float(angles[0]), float(angles[1]))
    found = []
    for points, index in (
        sections(vertices, faces, turn, planes=PLANES),
        crossed(vertices, faces, turn, PLANES),
    ):
        state: Ints = np.array([1 + seed], dtype=np.int64)
        circles = fit_circles(points, index, PLANES, TOLERANCE_MM, 5, False, False, state)
        centre = nearest_to_others(circles[np.isfinite(circles[:, 3]), :2], TOLERANCE_MM)
        found += [
            quality_of(circles, "circle_distance"),
            float(np.linalg.norm(centre - (turn @ scan.point_mm)[:2])),
        ]
    return found


def measure(lab: Lab) -> Numbers:
    """Both kinds of points on the seed's scan and on coarser meshes of it, with and without noise."""
    scan, truth = lab.scan("wheel", "seed"), angles_of(lab.scan("wheel", "seed").direction)
    count = lab.repeats(DRAWS)
    askew = np.radians(ASKEW_DEG) * np.random.default_rng(3).normal(size=(count, 2))
    meshes = [simplified(scan.vertices_mm, scan.faces, share) for share in KEPT]
    rows = [
        [
            compared(scan, faces, along_rays(vertices, noise, seed=k), truth + askew[k], k)
            for k in range(count)
        ]
        for vertices, faces in meshes
        for noise in NOISES_MM
    ]
    return {"rows": np.array(rows)}


def draw(n: Numbers) -> Section:
    """The error f and the location with either kind of points."""
    kinds = [(share, noise) for share in KEPT for noise in NOISES_MM]
    whole = n["rows"][kinds.index((1.0, 0.0))]
    coarse = n["rows"][kinds.index((KEPT[-1], 0.0))]
    rows = tuple(
        (f"{share:.0%} of the triangles, {noise:g} mm of noise", *(_words(of[:, k]) for k in (0, 2, 1, 3)))
        for (share, noise), of in zip(kinds, n["rows"], strict=True)
    )
    heads = ("mesh", "f, mean corner", "f, intersection", "location, mean corner", "location, intersection")
    costs = [float(np.median(of[:, 1] - of[:, 3])) for of in (whole, coarse)]
    return Section(
        title="The mean corner for the intersection",
        reports="Triangles are considered small, so their intersection with the plane is not computed: the "
        "mean of the corners stands for it (section 3.2).",
        measured=f"Both, at {whole.shape[0]} orientations about {ASKEW_DEG:g}° from the true one. On the "
        "whole "
        f"mesh f is {_words(whole[:, 0])} with mean corners and {_words(whole[:, 2])} with real "
        "intersections, "
        f"the location {_words(whole[:, 1])} and {_words(whole[:, 3])} off. With {KEPT[-1]:.0%} of the "
        f"triangles f is {_words(coarse[:, 0])} and {_words(coarse[:, 2])}: there they are not small.",
        claims=(
            Claim(
                "3.2",
                "the mean of a small triangle's corners may stand for its intersection",
                "approximation",
                f"location {costs[0]:+.2g} mm farther off than with intersections (median); with "
                f"{KEPT[-1]:.0%} of the triangles {costs[1]:+.2g} mm",
                "–",
                verdict([costs[0] < 0.1 * PAPER_MM, costs[0] < PAPER_MM]),
                f"a tenth of the paper's noise of {PAPER_MM:g} mm is allowed",
            ),
        ),
        tables=(Table(heads, rows, "Median (middle half) over orientations, mm"),),
    )


_words = partial(middle_half, say="{:.2g}".format)
