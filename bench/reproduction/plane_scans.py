"""The plane of figure 2, scanned in full light and in adapted light."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from bench.reproduction.camera_view import OPPOSITE, seen_photo
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Numbers, number
from bench.reproduction.scanned import Scanned
from bench.reproduction.scenery import PLANE
from bench.reproduction.shade import frame_of, shaded
from burrscan.arrays import Bools, Floats, Levels

SCENE = "plane"
FILL = 0.8
"""Share of the camera's range that the plane's median fills without adaptation."""
PERIOD_PX = 16
"""Of the sine whose harmonics the errors along a row are read for, projector px."""
SURFACE_MM = 5.0
"""Of the disc, along its axis."""
PLANES = 20
"""Planes on half the raster, for the spread."""
TILT_DEG, ALPHAS, DIFFUSE = 3.0, (0.04, 0.09), (0.4, 0.7)
"""What they differ by: tilt to either side, roughness, share of diffuse light; the highlight stays seen."""
SCANS: Mapping[str, tuple[str, Mapping[str, Any]]] = {
    "seed_clipped": ("seed", {"adapt": False, "mask_clipped": False}),
    "seed_refused": ("seed", {"adapt": False}),
    "seed_corrected": ("seed", {}),
    "default_refused": ("fixed", {}),
    "default_corrected": ("adaptive", {}),
}
"""Strategy and parameters; all but the corrected ones at the exposure that suits most of the plane."""


def plain_exposure_ms(scan: Scanned) -> float:
    """The exposure at which the plane's median fills :data:`FILL` of the range; its highlight then clips."""
    white = scan.arrays["white"][scan.arrays["measurable"]].astype(float)
    return float(
        np.round(
            number(scan.arrays, "exposure_ms") * FILL * number(scan.arrays, "full_dn") / np.median(white)
        )
    )


def heights_mm(scan: Scanned) -> Floats:
    """(h, w) height over the true plane, NaN where nothing was measured."""
    T = scan.arrays["T_part_camera"]
    return np.asarray(scan.arrays["points_mm"] @ T[2, :3] + T[2, 3] - SURFACE_MM)


def harmonic_of(error_px: Floats, u_px: Floats) -> float:
    """Cycles per period of the sine at which the error along a row is strongest.

    Error and column (N,), both in projector pixels, in order along the row.
    """
    even = np.arange(u_px.min(), u_px.max(), 0.25)
    order = np.argsort(u_px)
    wave = np.interp(even, u_px[order], error_px[order])
    power = np.abs(np.fft.rfft((wave - wave.mean()) * np.hanning(len(wave)))) ** 2
    cycles = np.fft.rfftfreq(len(wave), d=0.25 / PERIOD_PX)
    return float(cycles[1:][np.argmax(power[1:])])


def measure(lab: Lab) -> Numbers:
    """Reconstructions, sections through the highlight, coverage and errors in it and beside; many planes."""
    scans, exposure_ms = _scans(partial(lab.scan, SCENE))
    clipped = scans["seed_clipped"]
    spot = spot_of(clipped)
    row = int(np.median(np.flatnonzero(spot.any(axis=1))))
    found: dict[str, Any] = {
        "exposure_ms": np.asarray(exposure_ms),
        "spot": np.asarray(spot.sum() / clipped.arrays["measurable"].sum()),
        "harmonic": np.asarray(_harmonic(clipped, spot)),
        "white": seen_photo(clipped.arrays["white"], clipped),
        "image": seen_photo(clipped.arrays["image"], clipped),
    }
    frame = frame_of(clipped.vertices_mm, OPPOSITE)
    for key, scan in scans.items():
        found |= _one(key, scan, spot, row)
        view = shaded(scan.vertices_mm, scan.faces, OPPOSITE, frame_mm=frame)
        found[f"{key}_view"] = _with_line(view, clipped.arrays["true_points_mm"][row], frame)
    return found | _many(lab)


def _scans(scan_of: Callable[..., Scanned]) -> tuple[dict[str, Scanned], float]:
    """One plane by every strategy, and the exposure of those that do not adapt to it."""
    exposure_ms = plain_exposure_ms(scan_of("seed", adapt=False))
    plain = {"exposure_ms": exposure_ms}
    scans = {
        key: scan_of(method, **given, **({} if "corrected" in key else plain))
        for key, (method, given) in SCANS.items()
    }
    return scans, exposure_ms


def spot_of(clipped: Scanned) -> Bools:
    """(h, w) where full white light clips on the plane."""
    bright = clipped.arrays["white"] >= number(clipped.arrays, "full_dn")
    return np.asarray(bright & clipped.arrays["measurable"])


def planes(count: int) -> list[dict[str, dict[str, Any]]]:
    """Changes of the scene: planes tilted a little, glossier and duller ones."""
    rng = np.random.default_rng(2)
    return [
        {
            "pose": {
                "elevation_deg": 90.0 + rng.uniform(-TILT_DEG, TILT_DEG),
                "yaw_deg": PLANE["pose"]["yaw_deg"] + rng.uniform(-TILT_DEG, TILT_DEG),
            },
            "finish": {"alpha": rng.uniform(*ALPHAS), "diffuse_share": rng.uniform(*DIFFUSE)},
        }
        for _ in range(count)
    ]


def _many(lab: Lab) -> dict[str, Floats]:
    """Per plane: each scan's coverage and RMS in the highlight and beside it, and the strongest harmonic."""
    figures: dict[str, list[Floats]] = {
        f"{key}_{what}": [] for key in SCANS for what in ("covered", "rms_mm")
    }
    harmonics, spots = [], []
    for changed in planes(lab.repeats(PLANES)):
        scans, _ = _scans(partial(lab.glance, SCENE, changed=changed))
        clipped = scans["seed_clipped"]
        spot, plane = spot_of(clipped), clipped.arrays["measurable"]
        harmonics.append(_harmonic(clipped, spot))
        spots.append(spot.sum() / plane.sum())
        for key, scan in scans.items():
            height = heights_mm(scan)
            where = (spot, plane & ~spot)
            figures[f"{key}_covered"].append(np.array([_share(height, each) for each in where]))
            figures[f"{key}_rms_mm"].append(np.array([_rms(height[each]) for each in where]))
    found = {f"{name}_planes": np.array(values) for name, values in figures.items()}
    return found | {"harmonic_planes": np.array(harmonics), "spot_planes": np.array(spots)}


def _with_line(view: Levels, points_mm: Floats, frame_mm: tuple[Floats, Floats]) -> Levels:
    """A shaded picture with a row's points (w, 3) marked: the line of the cross-section."""
    low, high = frame_mm
    scale = view.shape[1] / (high[0] - low[0])
    seen = points_mm[np.isfinite(points_mm).all(axis=1)] @ OPPOSITE[:2].T
    columns, rows = ((seen[:, 0] - low[0]) * scale).astype(int), ((high[1] - seen[:, 1]) * scale).astype(int)
    inside = (columns >= 0) & (columns < view.shape[1]) & (rows >= 0) & (rows < view.shape[0])
    marked = view.copy()
    marked[rows[inside], columns[inside]] = 0
    return marked


def _one(key: str, scan: Scanned, spot: Bools, row: int) -> dict[str, Any]:
    height, plane = heights_mm(scan), scan.arrays["measurable"]
    T = scan.arrays["T_part_camera"]
    across = scan.arrays["true_points_mm"][row] @ T[:3, :3].T + T[:3, 3]
    return {
        f"{key}_covered": np.array([_share(height, spot), _share(height, plane & ~spot)]),
        f"{key}_rms_mm": np.array([_rms(height[spot]), _rms(height[plane & ~spot])]),
        f"{key}_section": np.column_stack([_along(across), height[row]])[plane[row]],
        f"{key}_exposure_ms": scan.arrays["exposure_ms"],
    }


def _along(points_mm: Floats) -> Floats:
    """Positions (w,) of a row's points, in the part frame, along the line they lie on."""
    flat = points_mm[:, :2]
    ends = flat[np.isfinite(flat).all(axis=1)][[0, -1]]
    unit = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    return np.asarray(flat @ unit)


def _share(height: Floats, where: Bools) -> float:
    return float(np.isfinite(height[where]).mean()) if where.any() else np.nan


def _rms(height: Floats) -> float:
    known = height[np.isfinite(height)]
    return float(np.sqrt(np.mean(known**2))) if len(known) else np.nan


def _harmonic(scan: Scanned, spot: Bools) -> float:
    """Median over the rows through the highlight: of one row a slow drift may be the strongest."""
    found = []
    for row in np.flatnonzero(spot.any(axis=1)):
        error, u_px = (scan.arrays[key][row].astype(float) for key in ("u_error_px", "u_response_px"))
        known = spot[row] & np.isfinite(error) & np.isfinite(u_px)
        if known.sum() > 2 * PERIOD_PX:
            found.append(harmonic_of(error[known], u_px[known]))
    return float(np.median(found)) if found else float("nan")
