"""One case of a cell from the first look to the last, and what is kept of it."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.cell.spec import CellCase
from bench.score.cell import CellEvidence, LookScore, RemovalScore
from bench.score.part import MeshEvidence, MeshTruth
from bench.score.shape import axis_deg
from burrscan.arrays import Floats, Ints32
from burrscan.cell.choices import POSTURES_DEG
from burrscan.cell.feed import along_its_edge, mill
from burrscan.cell.loop import Progress, inspection_of, look_around
from burrscan.cell.positioner import OutOfReachError
from burrscan.cell.removal import path_of, verify
from burrscan.cell.servo import Servoed, servo
from burrscan.cell.station import Station
from burrscan.cell.toolpath import ToolPath, tool_path
from burrscan.documents import finite
from burrscan.errors import InputError
from burrscan.files import write_text, written_whole
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Burr, Inspection
from burrscan.pipeline import Outcome, Pipeline
from burrscan.pose import placed
from scenes.cell.truth import left_of, tool_over
from scenes.cell.workcell import SimulatedCell
from scenes.stores import Store

_CROP_PX = 60
"""Half the side of the pictures of a burr before and after."""


@dataclass(frozen=True)
class Story:
    """What happened.

    Parameters
    ----------
    evidence
        For the metrics.
    vertices_mm, faces
        Every look's mesh in the frame of the plate.
    path
        One table per look, and one per removal: what ``cell.json`` holds.
    pictures
        Name to grey picture: each burr before and after.
    paths
        For every protrusion that was called the path that takes it off, in the robot's base frame, the table
        not turned; as the arm knows it, before any servoing.

    """

    evidence: CellEvidence
    vertices_mm: Floats
    faces: Ints32
    path: dict[str, Any]
    pictures: dict[str, NDArray[np.uint8]]
    paths: tuple[ToolPath, ...] = ()


def told(
    case: CellCase,
    pipeline: Pipeline,
    *,
    identity: tuple[int, ...] = (0,),
    cache_dir: Path | Store | None = None,
    said: Callable[[str], None] = lambda _: None,
) -> Story:
    """Run a case.

    Parameters
    ----------
    case
        The scene, its cell and the task.
    pipeline
        Which variant does what in every look.
    identity, cache_dir
        As :func:`scenes.simulate.simulate` takes them.
    said
        Told of every step, for a person who waits.

    Raises
    ------
    InputError
        When no look shows a surface of revolution, or the arm takes no pose.

    """
    cell = SimulatedCell(case.scene, case.cell, identity=identity, cache_dir=cache_dir)
    station = cell.station()
    scores: list[LookScore] = []
    T_looks_part: list[Floats] = []
    progress: Progress | None = None
    for progress in look_around(
        station,
        pipeline=pipeline,
        planner=case.task.planner,
        most=case.task.looks,
        enough=case.task.enough,
        burrs=case.task.expected_burrs,
        seed=identity[0] if identity else 0,
    ):
        T_looks_part.append(np.array(cell.T_camera_part))
        scores.append(_scored(progress, cell, T_looks_part))
        said(_sentence(progress, scores[-1]))
    if progress is None:
        raise InputError("the cell made no look")
    vertices, faces, inspection = _merged(progress)
    looks = tuple(
        replace(score, joined_deg=angle)
        for score, angle in zip(scores, _joined_deg(progress, T_looks_part), strict=True)
    )
    before = CellEvidence(
        _truth(progress, cell, T_looks_part[0]), inspection, looks=looks, most=case.task.looks
    )
    removals, pictures = _removed(case, cell, station, before, pipeline, said)
    evidence = replace(before, removals=tuple(removals))
    document = _document(case, evidence, progress)
    return Story(evidence, vertices, faces, document, pictures, _paths(case, station, inspection))


def keep(story: Story, folder: Path, variant: str = "") -> None:
    """Write ``cell.json`` and the pictures of burrs before and after, their names behind the variant's."""
    head = f"{variant}." if variant else ""
    write_text(folder / f"{head}cell.json", json.dumps(story.path, indent=1))
    for name, picture in story.pictures.items():
        ok, data = cv2.imencode(".png", picture)
        if ok:
            with written_whole(folder / f"{head}{name}.png") as beside:
                beside.write_bytes(data.tobytes())


def _paths(case: CellCase, station: Station, inspection: Inspection) -> tuple[ToolPath, ...]:
    """A path for each burr that a mill can reach."""
    paths = []
    for burr in inspection.burrs:
        with suppress(InputError):  # a nick, or a burr between walls
            path = tool_path(
                burr,
                axis=inspection.axis,
                generatrix=inspection.generatrix,
                radius_mm=case.cell.mill.radius_mm,
                scatter_mm=station.plunge_mm,
            )
            paths.append(path.placed(station.T_base_plate))
    return tuple(paths)


def _scored(progress: Progress, cell: SimulatedCell, T_looks_part: list[Floats]) -> LookScore:
    evidence = MeshEvidence(_truth(progress, cell, T_looks_part[0]), inspection_of(progress))
    look = progress.looks[-1]
    choice = progress.choices[look.choice]
    elevation, roll = POSTURES_DEG[choice.arm]
    matching = evidence.matching
    alone = None if look.outcome is None else look.outcome.inspection.axis.direction
    return LookScore(
        turn_deg=choice.turn_deg,
        elevation_deg=elevation,
        roll_deg=roll,
        coverage=progress.coverage,
        left=progress.left,
        found=sum(piece >= 0 for piece in matching.best) / max(len(matching.best), 1),
        false_calls=float(sum(owner < 0 for owner in matching.match)),
        axis_deg=axis_deg(evidence),
        single_deg=90.0 if alone is None else _off_deg(T_looks_part[-1], alone),
    )


def _joined_deg(progress: Progress, T_looks_part: list[Floats]) -> list[float]:
    """Error of the axis of all looks in the frame of each look that was scored; NaN for one with no result.

    The looks before the first one with a result are not scored.
    """
    joint = progress.fused.joint
    poses = iter(joint.T_world_camera)
    scored = progress.looks[-len(T_looks_part) :]
    return [
        _off_deg(T_camera_part, next(poses)[:3, :3].T @ joint.axis.direction)
        if look.outcome is not None
        else float("nan")
        for look, T_camera_part in zip(scored, T_looks_part, strict=True)
    ]


def _off_deg(T_camera_part: Floats, direction: Floats) -> float:
    """Angle between a direction of the camera's frame and the part's true axis; its sense is void.

    The cross product, not the cosine, keeps the digits of a small one.
    """
    true = T_camera_part[:3, 2]
    return float(np.degrees(np.arctan2(np.linalg.norm(np.cross(true, direction)), abs(true @ direction))))


def _truth(progress: Progress, cell: SimulatedCell, T_first_part: Floats) -> MeshTruth:
    """The part in the frame that the looks settled on, by the true pose of the first look that counted."""
    settled = progress.fused.joint.T_world_camera[0]
    T_part_mesh = np.asarray(np.linalg.inv(settled @ T_first_part), float)
    return MeshTruth(T_part_mesh, cell.wheel.generatrix_zr_mm, cell.wheel.burrs, None)


def _merged(progress: Progress) -> tuple[Floats, Ints32, Inspection]:
    """All looks' meshes in one, and the inspection with their deviations."""
    inspection = inspection_of(progress)
    vertices, faces, count = [], [], 0
    good = [look.outcome.surface for look in progress.looks if look.outcome is not None]
    for surface, pose in zip(good, progress.fused.joint.T_world_camera, strict=True):
        vertices.append(placed(pose, surface.vertices_mm))
        faces.append(surface.faces + count)
        count += len(surface.vertices_mm)
    merged = np.concatenate(vertices)
    deviation = deviation_mm(merged, inspection.axis, inspection.generatrix)
    return merged, np.concatenate(faces).astype(np.int32), replace(inspection, deviation_mm=deviation)


def _removed(
    case: CellCase,
    cell: SimulatedCell,
    station: Station,
    evidence: CellEvidence,
    pipeline: Pipeline,
    said: Callable[[str], None],
) -> tuple[list[RemovalScore], dict[str, NDArray[np.uint8]]]:
    """Somebody bumps into the part; then the burrs are taken off, one by one."""
    wanted = [
        (number, burr) for number, burr in enumerate(evidence.inspection.burrs) if burr.side == "protrusion"
    ][: case.task.remove]
    if not wanted:
        return [], {}
    cell.disturb()
    pictures: dict[str, NDArray[np.uint8]] = {}
    removals = []
    for number, burr in wanted:
        owner = evidence.matching.match[number]
        try:
            score, shots = _remove(case, cell, station, burr, owner, pipeline)
        except (InputError, OutOfReachError) as error:
            score, shots = RemovalScore(owner, 0, converged=False, why=str(error), off_mm=np.nan), {}
        removals.append(score)
        pictures |= {f"burr-{number + 1}-{name}": picture for name, picture in shots.items()}
        said(_removal_sentence(number, score))
    return removals, pictures


def _remove(
    case: CellCase, cell: SimulatedCell, station: Station, burr: Burr, owner: int, pipeline: Pipeline
) -> tuple[RemovalScore, dict[str, NDArray[np.uint8]]]:
    reached = servo(station, burr, burr.T_mesh_burr, pipeline=pipeline)
    score = RemovalScore(
        owner, len(reached.glances), reached.converged, reached.why, _off_mm(cell, reached, owner)
    )
    last = reached.glances[-1].outcome
    if not reached.converged or reached.burr is None or last is None:
        return score, {}
    shots = {"before": _crop(station, last, reached.burr.T_mesh_burr)}
    path = path_of(station, reached, radius_mm=case.cell.mill.radius_mm)
    path = along_its_edge(station, path, reached, pipeline=pipeline)
    mill(station, path, reached)
    after = verify(station, reached, pipeline=pipeline)
    if after.outcome is not None:
        shots["after"] = _crop(station, after.outcome, after.site.T_camera_burr)
    score = replace(
        score,
        covered=path.covered,
        said_residual_mm=after.residual_mm.value,
        said_gouge_mm=after.gouge_mm.value,
    )
    if owner >= 0:
        left = left_of(cell.seen().truth.wheel, cell.wheel, cell.wheel.burrs[owner])
        score = replace(score, residual_mm=left.residual_mm, gouge_mm=left.gouge_mm)
    return score, shots


def _off_mm(cell: SimulatedCell, reached: Servoed, owner: int) -> float:
    """True distance of the mill from its place over the burr; NaN where there is none."""
    if owner < 0 or not reached.glances:
        return float("nan")
    across, normal = tool_over(cell.T_part_tool, cell.wheel, owner)
    return float(max(abs(across), abs(normal - reached.glances[-1].height_mm)))


def _crop(station: Station, outcome: Outcome, T_camera_burr: Floats) -> NDArray[np.uint8]:
    """The burr's surroundings under full light, brightened; clipped pixels are white."""
    u, v = (round(float(x)) for x in station.scanner.rig.camera.project(T_camera_burr[:3, 3]))
    rows = slice(max(v - _CROP_PX, 0), max(v + _CROP_PX, 1))
    columns = slice(max(u - _CROP_PX, 0), max(u + _CROP_PX, 1))
    part = outcome.scan.white[rows, columns].astype(float)
    known = part[np.isfinite(part)]
    top = max(float(np.percentile(known, 99.0)), 1e-9) if known.size else 1.0
    share = np.where(np.isfinite(part), np.clip(part / top, 0.0, 1.0), 1.0)
    return np.asarray(255.0 * share ** (1.0 / 2.2), np.uint8)


def _document(case: CellCase, evidence: CellEvidence, progress: Progress) -> dict[str, Any]:
    """What a report shows; NaN as null."""
    chart, belief = progress.fused.chart, progress.fused.belief
    document: dict[str, Any] = finite(
        {
            "planner": case.task.planner,
            "most": case.task.looks,
            "looks": [asdict(look) for look in evidence.looks],
            "removals": [asdict(removal) for removal in evidence.removals],
            "why": [look.why for look in progress.looks],
            "chart": {
                "zr_mm": np.round(chart.zr_mm, 2).tolist(),
                "left": np.round(belief.left, 3).tolist(),
            },
        }
    )
    return document


def _sentence(progress: Progress, score: LookScore) -> str:
    return (
        f"look {len(progress.looks)}: table at {score.turn_deg:.0f} deg, camera {score.elevation_deg:.0f} "
        f"deg up{', on its side' if score.roll_deg else ''}: {100 * score.coverage:.0f} % measured, "
        f"{len(inspection_of(progress).burrs)} burrs called, {100 * score.left:.1f} % that one is left"
    )


def _removal_sentence(number: int, score: RemovalScore) -> str:
    if not score.converged:
        return f"burr {number + 1}: not removed: {score.why}"
    seen = np.isfinite(score.said_residual_mm)
    left = f"{score.said_residual_mm:.3f} mm are left by" if seen else "its place is not measured in"
    return (
        f"burr {number + 1}: reached in {score.looks} looks, milled over {100 * score.covered:.0f} % of its "
        f"length; {left} the look afterwards"
    )
