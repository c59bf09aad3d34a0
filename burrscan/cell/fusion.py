"""From looks to one part: poses, axis and generatrix together, then what each look would have found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.belief import SURE, Belief, belief_of, density_of
from burrscan.cell.chart import Chart, chart_of, line_of
from burrscan.cell.evidence import Call, Place, distinct, joined, side_log_odds
from burrscan.cell.flatness import bare
from burrscan.cell.ghosts import passed_through, without
from burrscan.cell.look import Look
from burrscan.cell.outlook import Outlook, aside_deg, facing, outlook
from burrscan.cell.rim import on_its_edge
from burrscan.cell.sizes import Cloud, sided, sides, sized
from burrscan.generatrix import deviation_mm
from burrscan.inspection import Axis, Burr, Generatrix
from burrscan.pipeline import Outcome
from burrscan.pose import placed
from burrscan.registration import PosedSurface
from burrscan.registration.joint import Joint, PosePrior, joint
from burrscan.rig import Rig


@dataclass(frozen=True)
class Fused:
    """What several looks say together.

    Parameters
    ----------
    joint
        Poses, axis and generatrix; the world is the plate's frame.
    chart, belief
        The part as a map, and what may be left on it.
    places
        Where burrs were called, with probabilities.

    """

    joint: Joint
    chart: Chart
    belief: Belief
    places: tuple[Place, ...]

    @property
    def axis(self) -> Axis:
        """In the frame of the plate."""
        return self.joint.axis

    @property
    def generatrix(self) -> Generatrix:
        """In the part's frame."""
        return self.joint.generatrix

    @property
    def T_part_plate(self) -> Floats:  # noqa: N802 (T_target_source)
        """(4, 4) from the plate's frame to the part's."""
        return T_part_mesh(self.axis.point_mm, self.axis.direction)


def fused(looks: Sequence[Look], rig: Rig, *, prior: PosePrior, burrs: float) -> Fused:
    """Join looks that have a result. O(points).

    Parameters
    ----------
    looks
        One at least with an outcome.
    rig
        The scanner's.
    prior
        How good reported poses are.
    burrs
        Expected number of burrs on the part.

    """
    good = [(look, look.outcome) for look in looks if look.outcome is not None]
    found = joint([_posed(look, outcome) for look, outcome in good], prior=prior)
    T_part_plate = T_part_mesh(found.axis.point_mm, found.axis.direction)
    eyes = [T_part_plate @ pose for pose in found.T_world_camera]
    surfaces = [outcome.surface for _, outcome in good]
    px_mm = [float(np.median(surface.vertices_mm[:, 2])) / rig.camera.fx for surface in surfaces]
    measured = [placed(eye, surface.vertices_mm) for eye, surface in zip(eyes, surfaces, strict=True)]
    chart = chart_of(found.generatrix)
    seen = _seen(chart, rig, eyes, measured, px_mm)
    ghosts = passed_through(chart, np.stack(eyes)[:, :3, 3], [density for _, density in seen])
    if ghosts.any():
        found = replace(found, generatrix=without(found.generatrix, chart, ghosts))
        chart = chart_of(found.generatrix)
        seen = _seen(chart, rig, eyes, measured, px_mm)
    clouds = [
        Cloud(
            points,
            deviation_mm(placed(pose, surface.vertices_mm), found.axis, found.generatrix),
            surface.vertex_sigma_mm,
            size,
        )
        for points, pose, surface, size in zip(measured, found.T_world_camera, surfaces, px_mm, strict=True)
    ]
    calls = [
        _call(number, burr, found.T_world_camera[number], T_part_plate, clouds, rig)
        for number, (_, outcome) in enumerate(good)
        for burr in outcome.inspection.burrs
        if np.isfinite(burr.T_mesh_burr).all() and _towards(burr.T_mesh_burr)[2] > 0.0
    ]
    belief, places = believed(calls, seen, axis=found.axis, chart=chart, burrs=burrs)
    places = distinct([_measured(place, found, T_part_plate, clouds) for place in places], T_part_plate)
    return Fused(found, chart, belief, places)


def _seen(
    chart: Chart, rig: Rig, eyes: Sequence[Floats], measured: Sequence[Floats], px_mm: Sequence[float]
) -> list[tuple[Outlook, Floats]]:
    """What each look had in sight, and the share of each cell that it measured."""
    views = [outlook(chart, rig, np.asarray(np.linalg.inv(eye), float), chart.angles) for eye in eyes]
    return [
        (view, density_of(chart, points, view, px_mm=size))
        for view, points, size in zip(views, measured, px_mm, strict=True)
    ]


def believed(
    calls: Sequence[Call],
    looks: Sequence[tuple[Outlook, Floats]],
    *,
    axis: Axis,
    chart: Chart,
    burrs: float,
) -> tuple[Belief, tuple[Place, ...]]:
    """What looks and their calls leave to believe, and the places called.

    ``looks`` are the outlook of each and, (S, AROUND), the share of each cell that it measured; the others
    are those of :func:`burrscan.cell.evidence.joined`. O(looks × cells + calls²).
    """
    belief = belief_of(chart, looks)
    # what was measured was in sight, whatever the outline says: the chart's cells are 3 mm long
    chances = np.stack([SURE * density * view.shows for view, density in looks])
    places = joined(calls, axis=axis, chart=chart, chances=chances, burrs=burrs)
    T_part_plate = T_part_mesh(axis.point_mm, axis.direction)
    for place in places:
        belief.found[line_of(T_part_plate @ place.burr.T_mesh_burr)] += place.probability
        _suspect(belief, chart, place, T_part_plate, [view for view, _ in looks])
    return belief, places


def _call(
    look: int,
    burr: Burr,
    T_plate_camera: Floats,
    T_part_plate: Floats,
    clouds: list[Cloud],
    rig: Rig,
) -> Call:
    if np.isnan(burr.width_mm.value):  # of an outline only: no wider than it is high, or hardly
        burr = replace(burr, width_mm=burr.height_mm)
    _, across, over = _towards(burr.T_mesh_burr)
    baseline = burr.T_mesh_burr[:3, :3].T @ rig.projector_centre_mm
    aside, along = aside_deg(over, across), np.abs(baseline[0]) >= np.abs(baseline[1])
    pose = np.asarray(T_plate_camera @ burr.T_mesh_burr, float)
    against = [
        number
        for number, cloud in enumerate(clouds)
        if number != look and bare(burr, T_part_plate @ pose, cloud.points_mm, cloud.deviation_mm)
    ]
    faced = bool(facing(aside, along))
    return Call(look, burr, pose, float(aside), faced, bool(along), frozenset(against))


def _measured(place: Place, found: Joint, T_part_plate: Floats, clouds: list[Cloud]) -> Place:
    """A place's burr as all looks measure it, where one is called."""
    if not place.certain:
        return place
    T_part_burr = T_part_plate @ place.burr.T_mesh_burr
    if line_of(T_part_burr) and place.burr.sign > 0:
        on_edge = _on_edge(place.burr, found.generatrix, T_part_burr, T_part_plate, clouds)
        return replace(place, burr=on_edge)
    shown = sided(place.burr, side_log_odds(place.calls), sides(place.burr, T_part_burr, clouds))
    return place if shown is None else replace(place, burr=sized(shown, found.axis, T_part_burr))


def _on_edge(
    burr: Burr, generatrix: Generatrix, T_part_burr: Floats, T_part_plate: Floats, clouds: list[Cloud]
) -> Burr:
    """A burr that goes around the axis, on the edge of the part that all looks show it on."""
    pose = on_its_edge(
        generatrix,
        T_part_burr,
        np.concatenate([cloud.points_mm for cloud in clouds]),
        np.concatenate([cloud.deviation_mm for cloud in clouds]),
        high_mm=burr.height_mm.value,
        half_mm=0.5 * burr.length_mm.value,
    )
    return replace(burr, T_mesh_burr=np.asarray(np.linalg.inv(T_part_plate) @ pose, float))


def _towards(T_camera_burr: Floats) -> Floats:
    """(3,) the way to the camera along the burr's axes: what has it behind the surface cannot be seen."""
    return np.asarray(-T_camera_burr[:3, :3].T @ T_camera_burr[:3, 3])


def _posed(look: Look, outcome: Outcome) -> PosedSurface:
    surface = outcome.surface
    return PosedSurface(surface.vertices_mm, surface.faces, surface.vertex_sigma_mm, look.T_plate_camera)


def _suspect(belief: Belief, chart: Chart, place: Place, T_part_plate: Floats, views: list[Outlook]) -> None:
    """Put a place's suspicion on the map, and what facing it is worth: half as much after each that did.

    A first look that faced it is what called it, or what made it suspicious.
    """
    pose = T_part_plate @ place.burr.T_mesh_burr
    along, around = chart.cells_of(pose[None, :3, 3], within_mm=10.0)
    if along[0] >= 0:
        line = line_of(pose)
        cell = int(along[0]), int(around[0])
        tried = sum(bool(view.seen[cell] and view.faces[(line, *cell)]) for view in views)
        belief.suspicion[(line, *cell)] += place.suspicion * 0.5 ** max(tried - 1, 0)
        belief.unfaced[(line, *cell)] += place.unfaced * 0.5**tried
