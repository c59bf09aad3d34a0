"""Section 3.2's table: tolerance, share of points rejected, and the number of RANSAC samples N."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri

from bench.reproduction.drawing import chart
from bench.reproduction.lab import PIPELINES, Lab
from bench.reproduction.noise import PAPER_MM, along_rays
from bench.reproduction.orientation import angles_of, sectioned
from bench.reproduction.parts import Claim, Numbers, Picture, Section, Table
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats
from burrscan.axis.sections import ransac_rounds

TOLERANCES_MM = (2.5, 1.7, 0.83, 0.42, 0.21)
"""First column of the paper's table."""
REJECTED = (0.06, 0.08, 0.16, 0.46, 0.61)
"""Second column, printed in whole per cent."""
ROUNDS = (3, 4, 6, 28, 73)
"""Third column: N for p = 0.99 and s = 3."""


def implied_sigma_mm() -> Floats:
    """The Gaussian noise that would put as many points outside each tolerance as the paper rejects."""
    return np.array([t / ndtri(1.0 - r / 2.0) for t, r in zip(TOLERANCES_MM, REJECTED, strict=True)])


def rounds_within(share: float) -> tuple[int, int]:
    """Fewest and most samples that a share printed in whole per cent can stand for."""
    low, high = (int(np.ceil(ransac_rounds(share + side))) for side in (-0.005, 0.005))
    return low, high


def rejected_shares(scan: Scanned, *, noise_mm: float = 0.0) -> Floats:
    """Share of all section points that lie outside their circle's tolerance, at the true orientation."""
    vertices = along_rays(scan.vertices_mm, noise_mm)
    shares = []
    for tolerance in TOLERANCES_MM:
        test = sectioned(vertices, scan.faces, angles_of(scan.direction), tolerance_mm=tolerance)
        points, rejected = test.good[:, 6], test.good[:, 7]
        shares.append(float((points * rejected).sum() / points.sum()))
    return np.array(shares)


def measure(lab: Lab) -> Numbers:
    """Rejected shares on both scans, as they are and with the paper's noise."""
    found: dict[str, Floats] = {}
    for name, scan in lab.pair("wheel").items():
        found[f"{name}_plain"] = rejected_shares(scan)
        found[f"{name}_noisy"] = rejected_shares(scan, noise_mm=PAPER_MM)
    return found


def draw(n: Numbers) -> Section:
    """The paper's table with our rows under it, and the shares as curves."""
    formula = [int(np.ceil(ransac_rounds(share))) for share in REJECTED]
    ranges = [rounds_within(share) for share in REJECTED]
    fits = all(low <= count <= high for (low, high), count in zip(ranges, ROUNDS, strict=True))
    spans = ", ".join(f"{low}" if low == high else f"{low}-{high}" for low, high in ranges)
    implied = implied_sigma_mm()
    rows = [_row("paper: rejected (N)", REJECTED, ROUNDS)]
    rows.append(("our formula on the paper's shares: N", *(str(count) for count in formula)))
    for name in PIPELINES:
        rows.append(_row(f"{name} scan", n[f"{name}_plain"]))
        rows.append(_row(f"{name} scan with {PAPER_MM:g} mm noise added", n[f"{name}_noisy"]))
    curves = {
        "v5": np.column_stack([TOLERANCES_MM, np.array(REJECTED) * 100.0]),
        "v0": np.column_stack([TOLERANCES_MM, n["seed_plain"] * 100.0]),
        "v1": np.column_stack([TOLERANCES_MM, n["default_plain"] * 100.0]),
        "v3": np.column_stack([TOLERANCES_MM, n["default_noisy"] * 100.0]),
    }
    legend = (("var(--v5)", "paper"), ("var(--v0)", "seed scan"), ("var(--v1)", "default scan"),
              ("var(--v3)", f"default scan + {PAPER_MM:g} mm"))  # fmt: skip
    body = chart(curves, "tolerance, mm", "points rejected, %", "share rejected over tolerance")
    gap = {v: 100.0 * float(np.abs(n[f"{v}_noisy"] - REJECTED).max()) for v in PIPELINES}
    return Section(
        title="The RANSAC table",
        reports="Tolerances of 2.5 to 0.21 mm reject 6 to 61 % of the intersection points, so N = 3 to 73 "
        "samples are needed for 99 % confidence; the noise is about 1 mm, so 5 samples will do at 1 mm.",
        measured=f"The formula gives N = {', '.join(map(str, formula))} for the printed shares, and the "
        f"paper's N within their rounding. Our scans are cleaner: at 0.21 mm {n['seed_plain'][-1]:.0%} "
        f"(seed) and {n['default_plain'][-1]:.1%} (default) are rejected. The paper's shares stand for "
        f"Gaussian noise of {implied[-1]:.2f} to {implied[2]:.2f} mm at the points, and some 6 % of "
        "outliers. Each point is the mean of three corners, so the noise of a vertex is up to √3 times as "
        f"large: about the 1 mm that the paper names. With {PAPER_MM:g} mm of noise added to each vertex "
        f"the shares come within {gap['seed']:.0f} (seed scan) and {gap['default']:.0f} points of the "
        "paper's.",
        claims=(
            Claim("3.2, table", "rejected 6, 8, 16, 46, 61 % need N = 3, 4, 6, 28, 73", "3, 4, 6, 28, 73",
                  f"{spans} (shares are printed in whole per cent)", "–", "yes" if fits else "no"),
            Claim("3.2, table", "rejected at 2.5, 1.7, 0.83, 0.42, 0.21 mm", _percent(np.array(REJECTED)),
                  _percent(n["seed_plain"]), _percent(n["default_plain"]),
                  "no" if min(gap.values()) > 15.0 else "partly",
                  f"our scans have less noise; with the paper's {PAPER_MM:g} mm added: "
                  f"{_percent(n['seed_noisy'])} (seed scan)"),
        ),
        pictures=(Picture("Share rejected", body, "", legend),),
        tables=(Table(("tolerance, mm", *(f"{t:g}" for t in TOLERANCES_MM)), tuple(rows)),),
    )  # fmt: skip


def _percent(shares: Floats) -> str:
    return ", ".join(f"{share * 100:.3g}" for share in np.round(shares, 3)) + " %"


def _row(title: str, shares: object, rounds: tuple[int, ...] = ()) -> tuple[str, ...]:
    values = np.asarray(shares, float)
    needed = rounds or tuple(int(np.ceil(ransac_rounds(float(share)))) for share in values)
    return (title, *(f"{share:.1%} ({count})" for share, count in zip(values, needed, strict=True)))
