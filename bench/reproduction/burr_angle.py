"""Figures 7 and 8: where each circle is left the farthest, the burr's angle, and the plane through it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from bench.plotting.pictures import view_from
from bench.reproduction.axis_found import METHODS, found_in_frames
from bench.reproduction.drawing import GREEN, INK, Layer, bulk, dots, equal_axes, ring, spot
from bench.reproduction.frames import DRAW
from bench.reproduction.lab import PIPELINES, Lab
from bench.reproduction.orientation import angles_of, sectioned
from bench.reproduction.parts import (
    SIDES,
    Claim,
    Numbers,
    Picture,
    Section,
    Side,
    Table,
    both,
    number,
    verdict,
)
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats
from burrscan.burrs.rivals.seed import agreeing as agreeing_of
from burrscan.pipeline import inspect_surface
from burrscan.turns import turn_deg

TRUE_DEG = 10.0
"""Of the burr that faces the scanner (scene ``seam``)."""
WITHIN_DEG = 5.0
"""The paper's t = 5π / 180 (section 4)."""
FRAMES = 20
"""Random frames: the paper's own is not known."""
_SHOWN = 12_000
"""Points drawn: a picture's worth."""
_OWN, _TRUE = "own", "true"


@dataclass(frozen=True)
class Farthest:
    """Per circle the point left the farthest and the centre, (C, 3) in the true part frame; and the gap."""

    points: Floats
    centres: Floats
    gaps: Floats

    @property
    def angles(self) -> Floats:
        """(C,) of the rays from centre to point, degrees."""
        x, y, _ = (self.points - self.centres).T
        return np.asarray(np.degrees(np.arctan2(y, x)))


def farthest(scan: Scanned, direction: Floats, *, seed: int = 0) -> Farthest:
    """What each circle of the sections across a direction leaves the farthest."""
    test = sectioned(scan.vertices_mm, scan.faces, angles_of(direction), seed=seed)
    T = scan.arrays["T_part_camera"]
    to_part = T[:3, :3] @ test.turn.T
    points, centres, gaps = [], [], []
    for plane in np.unique(test.plane):
        circle = test.circles[plane]
        if not np.isfinite(circle[3]):
            continue
        bag = test.points_mm[test.plane == plane]
        distance = np.hypot(*(bag[:, :2] - circle[:2]).T) - circle[3]
        far = int(np.argmax(np.abs(distance)))
        points.append(bag[far])
        centres.append(circle[:3])
        gaps.append(distance[far])
    at, middles = (np.array(places) @ to_part.T + T[:3, 3] for places in (points, centres))
    return Farthest(at, middles, np.array(gaps))


def mean_angle(angles_deg: Floats) -> float:
    """Mean of directions."""
    return float(np.degrees(np.angle(np.exp(1j * np.radians(angles_deg)).sum())))


def agreeing(angles_deg: Floats) -> Floats:
    """The largest company of angles within t of one of them (RANSAC with every circle tried)."""
    companies = [np.abs(turn_deg(angles_deg - float(angle))) < WITHIN_DEG for angle in angles_deg]
    return np.asarray(max(companies, key=lambda company: int(company.sum())))


def over_frames(scan: Scanned, directions: Sequence[Floats]) -> Floats:
    """(F, 2) per axis found: share of the rays at the burr, error of the angle N = 4 samples agree on."""
    rows = []
    for k, direction in enumerate(directions):
        angles = farthest(scan, direction, seed=DRAW * k).angles
        agree = agreeing_of(np.radians(angles), np.radians(WITHIN_DEG), 4, np.random.default_rng(k))
        share = np.mean(np.abs(turn_deg(angles - TRUE_DEG)) < WITHIN_DEG)
        rows.append([share, abs(turn_deg(mean_angle(angles[agree]) - TRUE_DEG))])
    return np.array(rows)


def measure(lab: Lab) -> Numbers:
    """Rays and burr angles about the axis each variant found, and about the true one."""
    found: dict[str, Floats] = {}
    for name, scan in lab.pair("wheel").items():
        seen = inspect_surface(scan.vertices_mm, scan.faces, PIPELINES[name], sigma_mm=scan.sigma_mm)
        for axis, direction in ((_OWN, seen.axis.direction), (_TRUE, scan.direction)):
            far = farthest(scan, direction)
            key = f"{name}_{axis}"
            found |= {f"{key}_points": far.points, f"{key}_centres": far.centres, f"{key}_gaps": far.gaps,
                      f"{key}_angles": far.angles, f"{key}_agree": agreeing(far.angles)}  # fmt: skip
        directions = found_in_frames(scan, METHODS[name], lab.repeats(FRAMES))
        found[f"{name}_frames"] = over_frames(scan, directions)
        T = scan.arrays["T_part_camera"]
        places = np.array([(T @ burr.T_mesh_burr)[:3, 3] for burr in seen.burrs if burr.significance > 3.0])
        found |= {
            f"{name}_mesh": scan.part_mm[:: max(len(scan.part_mm) // _SHOWN, 1)].astype(np.float32),
            f"{name}_burrs": places.reshape(-1, 3),
            f"{name}_off": np.asarray(scan.error_deg(seen.axis.direction)),
            f"{name}_on_burr": np.asarray(scan.coverage(on_burr=True)),
        }
    return found


def draw(n: Numbers) -> Section:
    """Rays seen along the axis and obliquely, the burr plane, for the own and the true axis."""
    share = float(np.median(n["seed_frames"][:, 0]))
    right = float(np.mean(n["seed_frames"][:, 1] < WITHIN_DEG))
    return Section(
        title="Figures 7 and 8: rays to the largest distances, and the burr",
        reports="On each circle the point farthest from it is taken; the rays to these points all indicate "
        "the burr, and the mean of their angles, less the outliers, is its angle. A plane through axis and "
        "burr cuts the mesh there.",
        measured=_words(n),
        claims=(
            Claim("4, figure 7", "the rays all indicate the burr", "all",
                  *both(lambda v: _shares(n, v)), verdict([share > 0.95, share >= 0.5]),
                  "the scan holds the burr in part only, and an axis some degrees off leaves larger "
                  f"distances elsewhere; about the true axis {_right(n, f'seed_{_TRUE}')} do"),
            Claim("4, figure 8", "the mean of the agreeing angles is the burr's", "right to the eye",
                  *both(lambda v: _angles(n, v)), verdict([right > 0.9, right >= 0.5]),
                  f"about the true axis it is off by {_error(n, f'seed_{_TRUE}'):.2f}° (seed)"),
        ),
        pictures=tuple(p for v in SIDES for p in _pictures(n, v)),
        tables=(_table(n),),
    )  # fmt: skip


def _angles(n: Numbers, variant: Side) -> str:
    errors = n[f"{variant}_frames"][:, 1]
    low, middle, high = np.percentile(errors, [25, 50, 75])
    return (
        f"off by {middle:.2f}° (median of {len(errors)} frames; middle half {low:.2g}° to {high:.2g}°), "
        f"{np.mean(errors < WITHIN_DEG):.0%} within {WITHIN_DEG:g}°"
    )


def _words(n: Numbers) -> str:
    own = [_right(n, f"{v}_{_OWN}") for v in SIDES]
    true = [_right(n, f"{v}_{_TRUE}") for v in SIDES]
    return (
        f"In {len(n['seed_frames'])} random frames, each with random samples of its own, "
        f"{_shares(n, 'seed')} of the seed's rays point within {WITHIN_DEG:.0f}° of the burr, and the angle "
        "that "
        f"four samples agree on is {_angles(n, 'seed')}. The pictures show the scanner's own frame: the axis "
        f"{number(n, 'seed_off'):.2g}° off, {own[0]} rays at the burr, about the true axis {true[0]}; "
        "default "
        f"{own[1]} and {true[1]}. The seed's scan holds {number(n, 'seed_on_burr'):.0%} of the burr's pixels."
    )


def _right(n: Numbers, key: str) -> str:
    angles = n[f"{key}_angles"]
    return f"{int((np.abs(turn_deg(angles - TRUE_DEG)) < WITHIN_DEG).sum())} of {len(angles)}"


def _shares(n: Numbers, variant: str) -> str:
    shares = n[f"{variant}_frames"][:, 0]
    low, middle, high = np.percentile(shares, [25, 50, 75])
    return f"{middle:.0%} (median of {len(shares)} frames; middle half {low:.0%} to {high:.0%})"


def _error(n: Numbers, key: str) -> float:
    agree = n[f"{key}_agree"].astype(bool)
    return abs(turn_deg(mean_angle(n[f"{key}_angles"][agree]) - TRUE_DEG))


def _pictures(n: Numbers, variant: Side) -> list[Picture]:
    own, true = f"{variant}_{_OWN}", f"{variant}_{_TRUE}"
    off = f"{number(n, f'{variant}_off'):.3g}°"
    legend = (
        (INK, "mesh"),
        ("var(--v0)", "rays to the farthest points"),
        (GREEN, "true burr"),
        ("#1463b5", "centres"),
    )
    return [
        Picture(f"Along the axis: rays about the axis found ({off} "
        f"off)", _along(n, variant, own), variant, legend),
        Picture("The same about the true axis", _along(n, variant, true), variant, legend),
        Picture("Axis and burr plane (about the true axis)", _plane(n, variant, true), variant,
                ((INK, "mesh"), ("#1463b5", "axis and burr plane"), ("var(--v0)", "farthest points"))),
    ]  # fmt: skip


def _along(n: Numbers, variant: str, key: str) -> Markup:
    mesh = n[f"{variant}_mesh"].astype(float)[:, :2]
    points, centres = n[f"{key}_points"][:, :2], n[f"{key}_centres"][:, :2]
    true = np.radians(TRUE_DEG)
    frame = np.concatenate([bulk(mesh), np.zeros((1, 2)), 110.0 * ring(np.zeros(2), 1.0)[:1]])
    axes = equal_axes(frame, "x of the part, mm", "y of the part, mm")
    burr = np.array([[0.0, 0.0], [112.0 * np.cos(true), 112.0 * np.sin(true)]])
    rays = [axes.line(np.stack([c, p]), "ray") for c, p in zip(centres, points, strict=True)]
    parts = [dots(axes, [Layer(mesh, INK)]), axes.line(burr, "true-ray"), *rays]
    return axes.svg([*parts, *(spot(axes, c, "centre", 3.2) for c in centres)], "rays to the farthest points")


def _plane(n: Numbers, variant: str, key: str) -> Markup:
    angles, agree = n[f"{key}_angles"], n[f"{key}_agree"].astype(bool)
    angle = np.radians(mean_angle(angles[agree]))
    view = view_from(azimuth_deg=float(np.degrees(angle)) - 50.0, elevation_deg=24.0)
    mesh = n[f"{variant}_mesh"].astype(float)
    low, high = float(mesh[:, 2].min()) - 8.0, float(mesh[:, 2].max()) + 8.0
    out = 118.0 * np.array([np.cos(angle), np.sin(angle)])
    sheet = np.array([[0, 0, low], [*out, low], [*out, high], [0, 0, high], [0, 0, low]])
    flat, cover = mesh @ view[:2].T, sheet @ view[:2].T
    axes = equal_axes(np.concatenate([bulk(flat), cover]), "across, mm", "up, mm")
    line = np.array([[0, 0, low - 6.0], [0, 0, high + 6.0]]) @ view[:2].T
    far = n[f"{key}_points"] @ view[:2].T
    parts = [dots(axes, [Layer(flat, INK)]), axes.line(cover, "plane"), axes.line(line, "axis-line")]
    return axes.svg([*parts, *(spot(axes, p, "far", 3.4) for p in far)], "axis and burr plane")


def _table(n: Numbers) -> Table:
    rows = []
    for variant in PIPELINES:
        for axis, title in ((_OWN, "axis found"), (_TRUE, "true axis")):
            key = f"{variant}_{axis}"
            gaps = np.abs(n[f"{key}_gaps"])
            rows.append(
                (
                    f"{variant} scan, {title}",
                    _right(n, key),
                    f"{_error(n, key):.2f}°",
                    f"{np.median(gaps):.2f} mm",
                )
            )
    heads = ("scan, about", f"rays within {WITHIN_DEG:.0f}°", "angle off by", "median largest distance")
    return Table(heads, tuple(rows))
