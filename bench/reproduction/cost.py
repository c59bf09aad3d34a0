"""The cost model of section 3.2: operations counted on meshes of growing size, and the time they take."""

from __future__ import annotations

import time

import fast_simplification
import numpy as np
import trimesh

from bench.reproduction.drawing import chart
from bench.reproduction.lab import Lab
from bench.reproduction.orientation import PLANES, Sectioned, angles_of, sectioned
from bench.reproduction.parts import Claim, Numbers, Picture, Section, Table
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats, Ints32
from burrscan.axis import find_axis
from burrscan.axis.fitting.starts import hemisphere

KEPT = (0.02, 0.05, 0.1, 0.25, 0.5, 1.0)
"""Shares of the scan's triangles."""
HALVED = (1, 2)
"""How often every triangle is cut into four."""


def simplified(vertices_mm: Floats, faces: Ints32, share: float) -> tuple[Floats, Ints32]:
    """A mesh with that share of its triangles (quadric decimation, which works in single precision)."""
    if share == 1.0:
        return vertices_mm, faces
    middle = vertices_mm.mean(axis=0)
    small, few = fast_simplification.simplify(
        (vertices_mm - middle).astype(np.float32), faces, target_reduction=1.0 - share
    )
    return small.astype(np.float64) + middle, np.ascontiguousarray(few, np.int32)


def subdivided(vertices_mm: Floats, faces: Ints32, times: int) -> tuple[Floats, Ints32]:
    """A mesh with every triangle cut into four, ``times`` times."""
    for _ in range(times):
        points, triangles = trimesh.remesh.subdivide(vertices_mm, faces)
        vertices_mm, faces = np.asarray(points), np.ascontiguousarray(triangles, np.int32)
    return vertices_mm, faces


def counted(test: Sectioned, vertices: int, triangles: int) -> tuple[float, float]:
    """Flops and tests of one evaluation by the paper's own accounting, with the points really intersected.

    10 V for distances, layers and extrema, 3 T for the triangles' means, per intersected triangle 30 for
    turning it, 8 for the tolerance, 13 for the circle, and 34 per circle; RANSAC's samples are neglected.
    """
    flops = 10.0 * vertices + 3.0 * triangles + 51.0 * len(test.plane) + 34.0 * PLANES
    return flops, 2.0 * (vertices - 1) + triangles


def modelled(vertices: int) -> tuple[float, float]:
    """The paper's closed form for a square single strip: flops and tests, both O(V)."""
    root = np.sqrt(vertices)
    triangles = 2.0 * vertices - 4.0 * root - 2.0
    return 10.0 * vertices + 3.0 * triangles + PLANES * (51.0 * np.sqrt(triangles) + 34.0), 4.0 * (
        vertices - root
    )


def seconds_each(vertices_mm: Floats, faces: Ints32, orientations: Floats) -> float:
    """Processor time of one evaluation of f, seconds."""
    sectioned(vertices_mm, faces, orientations[0])
    start = time.process_time()
    for angles in orientations:
        sectioned(vertices_mm, faces, angles).quality()
    return (time.process_time() - start) / len(orientations)


def measure(lab: Lab) -> Numbers:
    """Counts and times over V on the default's scan."""
    scan = lab.scan("wheel", "adaptive")
    rows = [_row(lab, scan, *simplified(scan.vertices_mm, scan.faces, share)) for share in KEPT]
    rows += [
        _row(lab, scan, *subdivided(scan.vertices_mm, scan.faces, k)) for k in HALVED[: 1 if lab.quick else 2]
    ]
    return {"rows": np.array(rows)}


def _row(lab: Lab, scan: Scanned, vertices: Floats, faces: Ints32) -> list[float]:
    tests = [sectioned(vertices, faces, angles_of(d)) for d in hemisphere(8)]
    counts = np.mean([counted(test, len(vertices), len(faces)) for test in tests], axis=0)
    orientations = np.array([angles_of(d) for d in hemisphere(lab.repeats(20))])
    each = seconds_each(vertices, faces, orientations)
    find_axis(vertices[: 3 * 1000], None)
    start = time.process_time()
    axis = find_axis(vertices, faces)
    whole = time.process_time() - start
    return [len(vertices), len(faces), *counts, each, whole, scan.error_deg(axis.direction)]


def draw(n: Numbers) -> Section:
    """Flops and tests per vertex, and time per vertex, over V."""
    rows = n["rows"]
    V, flops, tests, each, default = rows[:, 0], rows[:, 2], rows[:, 3], rows[:, 4], rows[:, 5]
    model = np.array([modelled(int(v)) for v in V])
    counts = chart(
        {
            "v0": np.column_stack([V, flops / V]),
            "v5": np.column_stack([V, model[:, 0] / V]),
            "v2": np.column_stack([V, tests / V]),
        },
        "vertices V",
        "operations per vertex",
        "operations per vertex over V",
        log=(True, False),
        y=(0.0, 1.08 * float((flops / V).max())),
    )
    times = chart(
        {
            "v0": np.column_stack([V, 1e3 * each]),
            "v1": np.column_stack([V, 1e3 * default]),
        },
        "vertices V",
        "processor time, ms",
        "time over V",
        log=(True, True),
    )
    slope = float(np.polyfit(np.log10(V[-4:]), np.log10(each[-4:]), 1)[0])
    default_slope = float(np.polyfit(np.log10(V[-4:]), np.log10(default[-4:]), 1)[0])
    last = flops[-1] / V[-1], tests[-1] / V[-1]
    per_vertex = 1e9 * each[-1] / V[-1]
    table = tuple(
        (
            f"{int(r[0]):,}",
            f"{int(r[1]):,}",
            f"{r[2] / r[0]:.1f}",
            f"{m[0] / r[0]:.1f}",
            f"{r[3] / r[0]:.2f}",
            f"{1e3 * r[4]:.2f} ms",
            f"{1e9 * r[4] / r[0]:.0f} ns",
            f"{1e3 * r[5]:.0f} ms",
        )
        for r, m in zip(rows, model, strict=True)
    )
    return Section(
        title="The cost of one evaluation",
        reports="About 16 V flops and 4 V tests for big meshes, so O(V); reducing V increases the speed "
        "substantially.",
        measured="Added up by the paper's own counts, on the default's scan, simplified and subdivided: "
        f"{flops[0] / V[0]:.0f} flops per vertex at V = {int(V[0]):,}, {last[0]:.1f} at {int(V[-1]):,}, "
        f"falling towards 16 as the sections' share falls with √V; {last[1]:.2f} tests. Processor time "
        f"grows as V to the power {slope:.2f} and is {per_vertex:.0f} ns per vertex at the largest, of one "
        f"core. The default's whole axis search grows as V to the power {default_slope:.2f}.",
        claims=(
            Claim(
                "3.2",
                "the counts of its steps add up to about 16 V flops for big meshes",
                "16 V",
                f"{last[0]:.1f} V at V = {int(V[-1]):,}",
                "–",
                "yes" if last[0] < 18.5 else "partly",
                "the paper's own counts with our meshes' V, T and sections: arithmetic, not a measurement",
            ),
            Claim(
                "3.2",
                "and about 4 V tests",
                "4 V",
                f"{last[1]:.2f} V",
                "–",
                "yes" if 3.6 < last[1] < 4.4 else "no",
            ),
            Claim(
                "3.2",
                "the cost is O(V)",
                "1",
                f"time grows as V^{slope:.2f}",
                f"V^{default_slope:.2f}",
                "yes" if 0.8 < slope < 1.2 else "partly",
            ),
        ),
        pictures=(
            Picture(
                "Operations per vertex",
                counts,
                "",
                (("v0", "flops counted"), ("v5", "flops, closed form"), ("v2", "tests counted")),
            ),
            Picture(
                "Processor time", times, "", (("v0", "one evaluation of f"), ("v1", "default: whole search"))
            ),
        ),
        tables=(
            Table(
                (
                    "vertices",
                    "triangles",
                    "flops / V",
                    "closed form / V",
                    "tests / V",
                    "one evaluation",
                    "per vertex",
                    "default, whole search",
                ),
                table,
            ),
        ),
    )
