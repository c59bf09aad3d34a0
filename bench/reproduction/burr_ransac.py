"""Section 4's RANSAC over the circles' angles: success against the share of circles that are wrong."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bench.reproduction.drawing import chart
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Claim, Numbers, Picture, Section, Table
from bench.synthetic.revolution import RidgeBurr, revolution_scan
from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs import burrs_residual
from burrscan.burrs.rivals.seed import agreeing, burrs_seed
from burrscan.generatrix import fit_generatrix
from burrscan.inspection import Axis, Burr
from burrscan.turns import turn_deg

CIRCLES, SAMPLES, T_DEG = 9, 4, 5.0
"""Nine circles leave room for each share of wrong ones; N = 4 and t = 5π / 180 the paper's (section 4)."""
SPREAD_DEG = 0.5
"""Standard deviation of the angles of circles that do see the burr."""
SHARES = tuple(range(CIRCLES + 1))
"""Numbers of wrong circles, all there are."""
LENGTHS = (1.0, 0.75, 0.5, 0.25, 0.1)
"""Of the burr over the part's width: the paper's burr is whole, ours get shorter until few circles meet
them."""
BURR_DEG = 10.0
"""Away from 0, where a wrong sign or an unset angle would pass."""


def chance_of_a_right_sample(wrong: float) -> float:
    """1 - w^N: one of N samples is of a right circle (the paper's reasoning, drawn with replacement)."""
    return 1.0 - wrong**SAMPLES


def success(wrong: int, *, trials: int) -> float:
    """Share of trials whose agreed angle is within t of the burr, ``wrong`` of the nine circles at random."""
    rng = np.random.default_rng([0, wrong])
    hits = 0
    for _ in range(trials):
        angles = np.radians(SPREAD_DEG) * rng.normal(size=CIRCLES)
        angles[:wrong] = rng.uniform(-np.radians(70.0), np.radians(70.0), wrong)
        agree = agreeing(angles, np.radians(T_DEG), SAMPLES, rng)
        found = np.angle(np.exp(1j * angles[agree]).sum())
        hits += bool(abs(found) < np.radians(T_DEG))
    return hits / trials


def on_meshes(length: float, *, runs: int) -> tuple[float, float]:
    """Share of synthetic scans on which seed and default find a burr over that share of the width."""
    half = 30.0 * length
    burr = RidgeBurr(angle_deg=BURR_DEG, height_mm=1.5, width_deg=1.5, z_start_mm=-half, z_end_mm=half)
    methods: tuple[Callable[..., tuple[Burr, ...]], ...] = (burrs_seed, burrs_residual)
    hits = np.zeros(2)
    for run in range(runs):
        scan = revolution_scan(shape=(420, 110), sigma_mm=0.2, seed=(6, run), burrs=(burr,))
        point = scan.point_mm + scan.direction * (
            scan.direction @ (scan.vertices_mm.mean(axis=0) - scan.point_mm)
        )
        axis = Axis(point, scan.direction, np.zeros((4, 4)), "true")
        curve = fit_generatrix(scan.vertices_mm, scan.faces, axis, sigma_mm=0.2)
        for k, method in enumerate(methods):
            found = method(scan.vertices_mm, scan.faces, axis, curve, sigma_mm=0.2)
            hits[k] += any(_off_deg(b, axis, scan.T_mesh_part) < T_DEG for b in found)
    return float(hits[0] / runs), float(hits[1] / runs)


def _off_deg(burr: Burr, axis: Axis, T_mesh_part: Floats) -> float:
    """Angle between a burr found and the true one, in the true part frame."""
    angle = np.radians(burr.angle_deg.value)
    to_mesh = np.linalg.inv(T_part_mesh(axis.point_mm, axis.direction))[:3, :3]
    part = T_mesh_part[:3, :3].T @ to_mesh @ np.array([np.cos(angle), np.sin(angle), 0.0])
    return abs(turn_deg(float(np.degrees(np.arctan2(part[1], part[0]))) - BURR_DEG))


def measure(lab: Lab) -> Numbers:
    """Simulated angles for every count of wrong circles; meshes with burrs of several lengths."""
    trials, runs = lab.repeats(4000), lab.repeats(20)
    rates = np.array([success(wrong, trials=trials) for wrong in SHARES])
    meshes = np.array([on_meshes(length, runs=runs) for length in LENGTHS])
    return {
        "rates": rates,
        "meshes": meshes,
        "trials": np.asarray(float(trials)),
        "runs": np.asarray(float(runs)),
    }


def draw(n: Numbers) -> Section:
    """Success over the share of wrong circles; burr length on meshes."""
    shares = 100.0 * np.array(SHARES) / CIRCLES
    rates = n["rates"]
    theory = np.array([100.0 * chance_of_a_right_sample(w / CIRCLES) for w in SHARES])
    curves = {"v5": np.column_stack([shares, theory]), "v0": np.column_stack([shares, 100.0 * rates])}
    quarter = float(np.interp(25.0, shares, rates))
    half = float(np.interp(50.0, shares, rates))
    meshes = n["meshes"]
    pairs = zip(LENGTHS, meshes, strict=True)
    rows = tuple((f"{length:.0%}", f"{a:.0%}", f"{b:.0%}") for length, (a, b) in pairs)
    success_chart = chart(
        curves, "wrong circles, %", "right angle, %", "success over wrong circles", y=(-4.0, 104.0)
    )
    return Section(
        title="Section 4's RANSAC: how many circles may be wrong",
        reports="No more than a quarter of the angles being wrong, N = 4 samples of one circle make it 99 "
        "% certain that one is suitable; t = 5°.",
        measured=f"With a quarter of the nine circles wrong the angle is right in {quarter:.1%} of "
        f"{number_of(n, 'trials')} trials, with half of them in {half:.0%}. The formula 1 − wᴺ gives "
        f"{chance_of_a_right_sample(0.25):.1%}, and is an upper bound: wrong circles may agree among "
        "themselves. On meshes the burr is on fewer circles when it is shorter: a quarter of the width is "
        f"two circles of nine. The seed finds it there in {meshes[3][0]:.0%} of the runs and on a tenth of "
        f"the width in {meshes[4][0]:.0%}, the default, which needs no circles, in {meshes[3][1]:.0%} and "
        f"{meshes[4][1]:.0%}.",
        claims=(
            Claim("4", "a quarter wrong, N = 4: 99 % success", "99 %", f"{quarter:.1%}",
                  "does not depend on circles", "yes" if quarter > 0.985 else "no"),
            Claim("4", "the burr is found where it is too faint on some places", "RANSAC makes it robust",
                  f"burr on half the width: {meshes[2][0]:.0%}, on a quarter: {meshes[3][0]:.0%}",
                  f"{meshes[2][1]:.0%}, {meshes[3][1]:.0%}", "yes" if meshes[2][0] > 0.95 else "partly",
                  "" if meshes[2][0] > 0.95 else "with half the circles wrong the farthest points are noise"),
        ),
        pictures=(
            Picture("Success over the share of wrong circles", success_chart, "",
                    (("v5", "1 − wᴺ"), ("v0", "N = 4, t = 5°, simulated"))),
        ),
        tables=(Table(("burr on this share of the width", "seed finds it", "default finds it"), rows,
                      f"Synthetic scans, {number_of(n, 'runs')} each, σ = 0.2 mm, burr 1.5 mm, the true axis "
                      f"given"),),
    )  # fmt: skip


def number_of(n: Numbers, key: str) -> str:
    """A count in words of the page."""
    return f"{int(n[key]):,}"
