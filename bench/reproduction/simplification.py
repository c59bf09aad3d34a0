"""Mesh simplification: what it does to the time and the accuracy of the axis."""

from __future__ import annotations

import time

import numpy as np

from bench.reproduction.axis_found import METHODS
from bench.reproduction.cost import simplified
from bench.reproduction.drawing import chart
from bench.reproduction.frames import searches
from bench.reproduction.lab import Lab
from bench.reproduction.parts import SIDES, Claim, Numbers, Picture, Section, Table
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats

KEPT = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02)
"""Shares of the triangles, down to where methods fail."""
FRAMES = 20
"""Random frames for each share."""


def measure(lab: Lab) -> Numbers:
    """Error and processor time of seed, mended seed and default over the share of triangles kept."""
    scan = lab.scan("wheel", "adaptive")
    rows = [_row(scan, share, lab.repeats(FRAMES)) for share in KEPT]
    return {"rows": np.array(rows)}


def _row(scan: Scanned, share: float, frames: int) -> list[float]:
    start = time.process_time()
    mesh = simplified(*scan.mesh, share)
    row = [share, float(len(mesh[1])), time.process_time() - start]
    for name in SIDES:
        found = list(searches(METHODS[name], mesh, frames, stream=2))
        row.append(float(np.median([one.error_deg(scan.direction) for one in found])))
        row.append(float(np.median([one.seconds for one in found])))
    return row


def draw(n: Numbers) -> Section:
    """Error and time over triangles."""
    rows = n["rows"]
    size = rows[:, 1]
    errors = {
        "v0": np.column_stack([size, rows[:, 3]]),
        "v1": np.column_stack([size, rows[:, 5]]),
    }
    times = {"v0": _ms(size, rows[:, 4]), "v1": _ms(size, rows[:, 6]), "v5": _ms(size[1:], rows[1:, 2])}
    tenth = rows[KEPT.index(0.1)]
    faster = [rows[0, k] / tenth[k] for k in (4, 6)]
    table = tuple(
        (
            f"{r[0]:.0%}",
            f"{int(r[1]):,}",
            f"{1e3 * r[2]:.0f} ms",
            f"{1e3 * r[4]:.1f} ms",
            f"{r[3]:.1f}°",
            f"{1e3 * r[6]:.1f} ms",
            f"{r[5]:.4f}°",
        )
        for r in rows
    )
    kept = tenth[3] < 1.5 * rows[0, 3] + 1.0
    legend = (("v0", "seed"), ("v1", "default"))
    return Section(
        title="Mesh simplification",
        reports="Several seconds with all 123,000 triangles are too many for an online version; "
        "simplification reduces the time substantially, and reduces noise too.",
        measured=f"A tenth of the triangles makes the seed's search {faster[0]:.1f} times as fast and the "
        f"default's {faster[1]:.1f} times; simplifying itself takes {1e3 * tenth[2]:.0f} ms of processor "
        f"time. The seed's error is {rows[0, 3]:.0f}° with all and {tenth[3]:.0f}° with a tenth: it is the "
        "search that errs, not the mesh. The default, which reads normals and averages noise, goes from "
        f"{rows[0, 5]:.4f}° to {tenth[5]:.4f}°: decimated triangles are unequal, and it weighs vertices.",
        claims=(
            Claim(
                "3.2, 5",
                "simplification reduces the time substantially",
                "substantially",
                f"a tenth: {faster[0]:.1f} times as fast",
                f"{faster[1]:.1f} times as fast",
                "yes" if faster[0] > 3.0 else "partly",
            ),
            Claim(
                "3.2",
                "it keeps the shape and reduces noise",
                "keeps it",
                f"{rows[0, 3]:.0f}° → {tenth[3]:.0f}°",
                f"{rows[0, 5]:.4f}° → {tenth[5]:.4f}°",
                "yes" if kept and tenth[5] < rows[0, 5] else "partly",
                "noise that is averaged before the fit is no longer there to average",
            ),
        ),
        pictures=(
            Picture(
                "Axis error",
                chart(errors, "triangles", "error, degrees", "error over triangles", log=(True, True)),
                "",
                legend,
            ),
            Picture(
                "Processor time",
                chart(times, "triangles", "processor time, ms", "time over triangles", log=(True, True)),
                "",
                (*legend, ("v5", "simplifying")),
            ),
        ),
        tables=(
            Table(
                (
                    "kept",
                    "triangles",
                    "simplifying",
                    "seed: time",
                    "seed: error",
                    "default: time",
                    "default: error",
                ),
                table,
            ),
        ),
    )


def _ms(size: Floats, seconds: Floats) -> Floats:
    return np.column_stack([size, np.maximum(1e3 * seconds, 1e-2)])
