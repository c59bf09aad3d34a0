"""Future work: scans from several viewpoints, aligned from the robot's rough poses, inspected as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from bench.reproduction.drawing import chart
from bench.reproduction.lab import PIPELINES, Lab
from bench.reproduction.parts import Claim, Numbers, Picture, Section, Table
from bench.reproduction.scanned import Scanned
from bench.reproduction.scenery import paper_scene
from bench.score.metrics import failed_metrics, measure_some, metric_named
from bench.score.part import MeshEvidence, MeshTruth
from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.pipeline import Pipeline, inspect_surface
from burrscan.registration import Alignment, Merged, PosedSurface, align, merge
from scenes.scene import scene_from
from scenes.wheel import build_wheel

SCENE = "catalogue"
SPINS_DEG: dict[int, tuple[float, ...]] = {
    1: (0.0,),
    2: (0.0, 90.0),
    3: (0.0, 90.0, 180.0),
    4: (0.0, 90.0, 180.0, 270.0),
    6: (0.0, 60.0, 120.0, 180.0, 240.0, 300.0),
}
"""How many views, and by how much the part is turned before each, as if a camera went round it."""
ROBOT_MM, ROBOT_DEG = 0.5, 0.2
"""Standard deviation of a rough pose along and about each axis, at the camera."""
METRICS = ("axis_deg", "axis_offset_mm", "generatrix_rms_mm", "burr_found", "false_calls")
DRAWS = 5
"""Of the robot's errors for each number of views."""
_FACET_MM = 0.01
"""Of the mesh that is the truth, well below the depth noise."""


def measure(lab: Lab) -> Numbers:
    """Numbers of views, draws of the robot's errors, both variants; and the rough poses alone."""
    truth = _truth(lab)
    rows: list[list[float]] = []
    for count, spins in SPINS_DEG.items():
        views = [lab.scan(SCENE, "adaptive", spin_deg=spin) for spin in spins]
        for draw in range(lab.repeats(DRAWS)):
            rows += _rows(views, count, draw, truth)
    return {"rows": np.array(rows), "true_burrs": np.asarray(len(truth.burrs))}


def draw(n: Numbers) -> Section:
    """Axis error and burrs found against the number of views."""
    counts = list(SPINS_DEG)
    default, rough, seed = (
        np.array([_middle(n, count, kind) for count in counts]) for kind in (_DEFAULT, _ROUGH, _SEED)
    )
    first, last, whole = default[0], default[-1], int(n["true_burrs"])
    lines = {
        "v0": _curve(counts, seed[:, 0]),
        "v1": _curve(counts, default[:, 0]),
        "v5": _curve(counts[1:], rough[1:, 0]),
    }
    axes = ("views", "axis angle error, degrees", "axis error against views")
    return Section(
        title="Future work: several viewpoints, one inspection",
        reports="Scans from several viewpoints are to be aligned by ICP, from rough poses that the robot "
        "arm knows, and merged; one scan shows only a part of the wheel.",
        measured=f"Views {ROBOT_MM} mm and {ROBOT_DEG}° off per axis, aligned all at once and merged. One "
        f"view finds the axis within {first[0]:.4f}° and {whole * first[3]:.2g} of {whole} burrs (the "
        f"others are out of sight), six views within {last[0]:.4f}° and {whole * last[3]:.2g}. With the "
        f"rough poses alone six views give {rough[-1][0]:.3f}°. The turn of a round part about its axis is "
        "what the surfaces do not show: there the robot's word stands.",
        claims=(_claim(first, last, seed[-1], whole),),
        pictures=(
            Picture(
                "Axis error against the number of views",
                chart(lines, *axes, log=(False, True)),
                legend=(
                    ("v0", "seed, aligned"),
                    ("v1", "default, aligned"),
                    ("v5", "default, rough poses only"),
                ),
            ),
        ),
        tables=(_table(counts, default, rough, seed, whole),),
    )


def _claim(first: Floats, last: Floats, seed: Floats, whole: int) -> Claim:
    better = bool(last[0] < first[0] and last[3] > first[3])
    return Claim(
        "6",
        "several views, aligned by ICP, serve one inspection",
        "future work",
        f"axis by the seed's search on the merged mesh: {seed[0]:.0f}°",
        f"axis {first[0]:.4f}° → {last[0]:.4f}°, burrs {whole * first[3]:.2g} → {whole * last[3]:.2g} of "
        f"{whole}",
        "yes" if better else "partly",
        "" if better else "more of the wheel is seen, but errors of the poses come in",
    )


def _table(counts: Sequence[int], default: Floats, rough: Floats, seed: Floats, whole: int) -> Table:
    heads = (
        "views", "axis angle, deg", "with rough poses", "by the seed's axis", "axis offset, mm",
        "curve RMS, mm", f"burrs found of {whole}", "false calls",
    )  # fmt: skip
    rows = tuple(
        (
            str(count), f"{d[0]:.4f}", "–" if count == 1 else f"{r[0]:.4f}", f"{s[0]:.1f}", f"{d[1]:.4f}",
            f"{d[2]:.4f}", f"{whole * d[3]:.1f}", f"{d[4]:.1f}",
        )
        for count, d, r, s in zip(counts, default, rough, seed, strict=True)
    )  # fmt: skip
    return Table(heads, rows, "Medians over the draws of the robot's errors; burrs and false calls are means")


_DEFAULT, _ROUGH, _SEED = 0, 1, 2
"""Kinds of rows: aligned by default, left at the rough poses, and the seed's pipeline."""


def _curve(counts: Sequence[int], values: Floats) -> Floats:
    return np.column_stack([np.asarray(counts, float), np.maximum(values, 1e-6)])


def _middle(n: Numbers, count: int, kind: int) -> Floats:
    """Per metric the median over draws, for shares and counts the mean."""
    rows = n["rows"]
    mine = rows[(rows[:, 0] == count) & (rows[:, 1] == kind)][:, 2:]
    errors = len([name for name in METRICS if metric_named(name).unit in {"deg", "mm"}])
    return np.concatenate([np.median(mine[:, :errors], axis=0), mine[:, errors:].mean(axis=0)])


def _truth(lab: Lab) -> MeshTruth:
    """The part, for a world frame that is the part's."""
    scene = scene_from(paper_scene(SCENE, scale=lab.scale), source="paper")
    wheel = build_wheel(scene.wheel, scene.burrs, facet_error_mm=_FACET_MM)
    return MeshTruth(np.eye(4), wheel.generatrix_zr_mm, wheel.burrs, None)


def _rows(views: Sequence[Scanned], count: int, draw_: int, truth: MeshTruth) -> list[list[float]]:
    """One row per kind: number of views, kind, then the metrics."""
    rng = np.random.default_rng([count, draw_])
    world = _turned(rng)
    posed = _posed(views, world, rng)
    truth = replace(truth, T_part_mesh=world.T)
    rough = Alignment(
        np.stack([v.T_world_camera for v in posed]), np.zeros(0), np.zeros(0), np.zeros(0), 0.0, 0
    )
    aligned = rough if count == 1 else align(posed, sigma_mm=ROBOT_MM, sigma_deg=ROBOT_DEG)
    both, loose = merge(posed, aligned), merge(posed, rough)
    kinds = ((_DEFAULT, both, "default"), (_ROUGH, loose, "default"), (_SEED, both, "seed"))
    return [[count, kind, *_scores(mesh, PIPELINES[name], truth)] for kind, mesh, name in kinds]


def _turned(rng: np.random.Generator) -> Floats:
    """(4, 4) part to world: any orientation, for the seed's grid holds the world's own z axis."""
    world = np.eye(4)
    world[:3, :3] = Rotation.random(random_state=rng).as_matrix()
    return world


def _posed(views: Sequence[Scanned], world: Floats, rng: np.random.Generator) -> list[PosedSurface]:
    """Views at their true poses, all but the first off by what the robot is."""
    posed = []
    for number, view in enumerate(views):
        pose = world @ np.array(view.arrays["T_part_camera"], float)
        if number:
            turn = Rotation.from_rotvec(ROBOT_DEG * rng.normal(size=3), degrees=True).as_matrix()
            pose[:3, :3] = turn @ pose[:3, :3]
            pose[:3, 3] += ROBOT_MM * rng.normal(size=3)
        posed.append(PosedSurface(view.vertices_mm, view.faces, view.sigma_mm, pose))
    return posed


def _scores(mesh: Merged, pipeline: Pipeline, truth: MeshTruth) -> list[float]:
    try:
        found = inspect_surface(mesh.vertices_mm, mesh.faces, pipeline, sigma_mm=mesh.sigma_mm)
    except InputError:
        failed = failed_metrics()
        return [failed[name] for name in METRICS]
    return [*measure_some(MeshEvidence(truth, found), METRICS).values()]
