"""A made-up run directory in the layout of :mod:`bench.run`, for tests of what reads one."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.budget.budget import METRICS as METRICS_OF_BUDGET
from bench.budget.budget import SUBSTITUTIONS
from bench.run import Failure, Record, RunDirectory
from bench.run.directory import describe_run, write_manifest
from bench.run.provenance import session
from bench.run.records import append
from bench.score import METRICS, failed_metrics
from bench.suites.case import Case
from bench.suites.suite import Suite, suite_from

SHAPE = (256, 320)
ANGLES_DEG = (120.0, 250.0)
WIDTH_MM = 60.0
COVERAGE = {
    ("polished", "fixed"): 0.41,
    ("polished", "adaptive"): 0.93,
    ("turned", "fixed"): 0.55,
    ("turned", "adaptive"): 0.91,
    ("matte", "fixed"): 0.97,
    ("matte", "adaptive"): 0.975,
    ("polished", "again"): 0.40,
    ("turned", "again"): 0.54,
    ("matte", "again"): 0.96,
}
GOALS = [
    {"metric": "coverage", "at_least": 0.9, "variant": "adaptive"},
    {"metric": "coverage", "at_least": 0.9, "where": {"finish": "polished"}, "variant": "fixed"},
    {"metric": "axis_deg", "at_least": 0.001, "at_most": 0.5, "variant": "again"},
]


def made_up_suite(*, many: bool = False, seeds: int = 2) -> Suite:
    """Three finishes, two seeds, two variants; with ``many`` a third one, and goals."""
    document: dict[str, Any] = {
        "name": "made-up",
        "title": "A made-up run, for <tests> & looks",
        "description": "Nothing here was measured.",
        "scene": {"finish": "matte", "burr": [{"kind": "axial_ridge", "height_mm": 1.0}]},
        "sweep": {"finish": ["polished", "turned", "matte"]},
        "seeds": list(range(seeds)),
        "variant": [{"name": "fixed", "scan": "fixed"}, {"name": "adaptive", "scan": "adaptive"}],
    }
    if many:
        document["variant"].append({"name": "again", "scan": "fixed"})
        document["goal"] = GOALS
    return suite_from(document, source="test")


def made_up_run(
    folder: Path,
    *,
    fail: bool = False,
    pictures: bool = True,
    stop_after: int = 99,
    budget: bool = False,
    many: bool = False,
    seeds: int = 2,
) -> Path:
    """Write a run; with ``fail`` the first result is missing, with ``stop_after`` the run is unfinished."""
    suite, directory = made_up_suite(many=many, seeds=seeds), RunDirectory(folder)
    cases = made_up_cases(suite)
    metrics = {
        name: {"title": m.title, "unit": m.unit, "better": m.better, "version": m.version, "source": m.source}
        for name, m in METRICS.items()
    }
    manifest = describe_run(suite, cases, seed=0, metrics=metrics)
    write_manifest(
        directory, {**manifest, "sessions": [session(workers=2, threads=1, renderer="llvm_ad_mono")]}
    )
    for number, case in enumerate(cases[:stop_after]):
        records = [made_up_record(case, variant.name) for variant in suite.variant]
        if budget:
            records = [replace(record, budget=made_up_budget(record)) for record in records]
        if fail and number == 0:
            records[0] = failed(records[0])
        append(directory.records, records)
        if pictures:
            seen = {variant.name for variant in suite.variant} - (
                {"fixed"} if fail and number == 0 else set()
            )
            save_pictures(directory.case(case.id), case, sorted(seen))
    return folder


def made_up_budget(record: Record) -> dict[str, dict[str, float]]:
    """Errors that fall from stage to stage, and once rise."""
    left = {name: 1.0 - 0.15 * number for number, name in enumerate(SUBSTITUTIONS)}
    left["coverage"] = 0.9
    return {
        name: {m: share * record.metrics.get(m, 0.0) for m in METRICS_OF_BUDGET}
        for name, share in left.items()
    }


def made_up_cases(suite: Suite) -> list[Case]:
    """The suite's cases, without the scenes that would have to be true to be simulated."""
    return [
        Case(f"finish={finish},seed={seed}", {"finish": finish, "seed": seed}, seed, {}, "0" * 64, "1" * 64)
        for finish, seed in itertools.product(suite.sweep["finish"], suite.seeds)
    ]


def made_up_record(case: Case, variant: str) -> Record:
    """Plausible numbers, all of them formulas of the case."""
    coverage = COVERAGE[str(case.parameters["finish"]), variant] - 0.01 * case.seed
    found = coverage > 0.5
    burr = {
        "kind": "axial_ridge",
        "side": "protrusion",
        "height_mm": 1.0 + case.seed,
        "width_mm": 1.5,
        "visible_mm": 30.0,
        "covered_mm": 30.0 * coverage,
        "found": found,
    }
    errors = {"angle_error_deg": 0.21, "height_error_mm": -0.043, "start_error_mm": 0.4, "end_error_mm": -0.2}
    metrics = {
        "coverage": coverage,
        "wrong_rate": 0.02 * (1 - coverage),
        "depth_rms_mm": 0.05 / coverage,
        "axis_deg": 0.01 / coverage,
        "axis_offset_mm": 0.02 / coverage,
        "generatrix_rms_mm": 0.02 / coverage,
        "band_mm": 0.2,
        "burr_found": float(found),
        "burr_coverage": coverage,
        "burr_angle_deg": 0.21 if found else float("nan"),
        "burr_height_mm": 0.043 if found else float("nan"),
        "burr_extent_mm": 0.3 if found else float("nan"),
        "false_calls": float(coverage < 0.45),
        "frames": 42.0 if variant == "fixed" else 54.0,
        "saturated_share": 0.9 - 0.9 * coverage,
    }
    return Record(
        case.id,
        variant,
        case.parameters,
        case.scene_hash,
        case.identity,
        metrics,
        ({**burr, **errors} if found else burr,),
        timings_s={"transport": 1.2, "scan": 0.8 if variant == "fixed" else 1.3, "axis": 0.4},
    )


def failed(record: Record) -> Record:
    """The same case without a result; the message holds what HTML must escape."""
    why = Failure("pipeline", "ValueError: <no light> reached the camera", "Traceback:\n  <frame>")
    return Record(
        record.case,
        record.variant,
        record.parameters,
        record.scene_hash,
        record.identity,
        failed_metrics(),
        (),
        why,
    )


def save_pictures(folder: Path, case: Case, variants: Sequence[str]) -> None:
    """Pictures of a shiny drum with one ridge along its axis."""
    folder.mkdir(parents=True)
    random = np.random.default_rng(case.seed)
    np.savez_compressed(folder / "truth.npz", **_truth())
    for name in variants:
        coverage = COVERAGE[str(case.parameters["finish"]), name]
        np.savez_compressed(folder / f"{name}.npz", **_seen(name, coverage, random))


def _truth() -> dict[str, Any]:
    z = np.array([-30.0, -30.0, -10.0, -8.0, 8.0, 10.0, 30.0, 30.0])
    r = np.array([0.0, 100.0, 100.0, 97.0, 97.0, 100.0, 100.0, 0.0])
    return {
        "measurable": np.ones(SHAPE, bool),
        "generatrix": np.column_stack([z, r]).astype(np.float32),
        "unrolled_mm": _ridge(np.zeros((325, 120))).astype(np.float16),
        "unrolled_deg": np.array(ANGLES_DEG, np.float32),
        "unrolled_z_mm": np.array([-WIDTH_MM / 2, WIDTH_MM / 2], np.float32),
        "burr_angle_deg": np.array([-170.0], np.float32),  # 190 in the map's own count
        "burr_z_mm": np.array([[-20.0, 10.0]], np.float32),
        "burr_arc_deg": np.array([0.6], np.float32),
        "burr_height_mm": np.array([1.0], np.float32),
    }


def drum() -> dict[str, Any]:
    """A piece of a drum as a mesh, with a ridge along it."""
    angle, z = np.meshgrid(
        np.radians(np.linspace(*ANGLES_DEG, 40)), np.linspace(-30.0, 30.0, 12), indexing="ij"
    )
    number = np.arange(angle.size).reshape(angle.shape)
    a, b, c, d = (
        part.ravel() for part in (number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:])
    )
    values = np.where(np.abs(np.degrees(angle) - 190.0) < 2.0, 1.0, 0.0).ravel()
    return {
        "mesh_mm": np.stack([100 * np.cos(angle), 100 * np.sin(angle), z], axis=-1)
        .reshape(-1, 3)
        .astype(np.float32),
        "mesh_faces": np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint16),
        "mesh_values_mm": values.astype(np.float16),
        "camera_mm": np.array([-700.0, 100.0, 300.0], np.float32),
    }


def _ridge(deviation: NDArray[Any]) -> NDArray[Any]:
    deviation[173:177, 20:80] += 1.0
    return deviation


def _seen(name: str, coverage: float, random: np.random.Generator) -> dict[str, Any]:
    columns = np.broadcast_to(np.arange(SHAPE[1]), SHAPE)
    across = (columns - SHAPE[1] / 2) / (SHAPE[1] / 2)
    shine = 40 + 300 * np.exp(-((across + 0.1) ** 2) / 0.01) * (0.6 if name == "adaptive" else 1.0)
    white = np.clip(shine + random.normal(0, 3, SHAPE), 0, 255).astype(np.uint8)
    stripes = (columns // 16 % 2).astype(float)
    lost = np.abs(across + 0.1) < (1 - coverage) / 2
    pixels = np.where(lost, np.where(random.random(SHAPE) < 0.7, 4, 1), 2).astype(np.uint8)
    pixels[:20] = 0
    pixels[random.random(SHAPE) < 0.004] = 3
    depth = np.where(pixels == 2, random.normal(0, 0.05, SHAPE), np.nan)
    z = np.linspace(-29.0, 29.0, 300)
    truth = _truth()["generatrix"]
    r = np.interp(z, truth[1:7, 0], truth[1:7, 1]) + random.normal(0, 0.01, 300)
    curve = np.column_stack([z, r])
    curve[140:150] = np.nan
    unrolled = _ridge(random.normal(0, 0.05, (325, 120)))
    unrolled[:: max(int(10 * coverage), 1)] = np.nan
    hit = coverage > 0.5
    arrays = {
        "white": white,
        "pattern": np.where(np.arange(1024)[None] // 32 % 2, 255, 0).repeat(768, 0).astype(np.uint8),
        "image": (white * (0.1 + 0.9 * stripes)).astype(np.uint8),
        "pixels": pixels,
        "depth_error_mm": depth.astype(np.float16),
        "unrolled_mm": unrolled.astype(np.float16),
        "generatrix": curve.astype(np.float32),
        "burr_angle_deg": np.array([-169.8 if hit else 140.0], np.float32),
        "burr_z_mm": np.array([[-19.0, 9.5]], np.float32),
        "burr_height_mm": np.array([0.95], np.float32),
        "burr_match": np.array([0 if hit else -1], np.int16),
        **drum(),
    }
    if name == "adaptive":
        u = np.linspace(-1, 1, 1024)[None].repeat(768, 0)
        arrays["intensity"] = (255 * (1 - 0.85 * np.exp(-((u + 0.1) ** 2) / 0.02))).astype(np.uint8)
    return arrays
