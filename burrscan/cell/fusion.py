"""From looks to one part: poses, axis and generatrix together, then what each look would have found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.cell.belief import SURE, Belief, belief_of, density_of
from burrscan.cell.chart import Chart, chart_of
from burrscan.cell.evidence import Call, Place, joined
from burrscan.cell.look import Look
from burrscan.cell.outlook import Outlook, outlook
from burrscan.inspection import Axis, Generatrix
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
    chart = chart_of(found.generatrix)
    seen: list[tuple[Outlook, Floats]] = []
    for eye, (_, outcome) in zip(eyes, good, strict=True):
        view = outlook(chart, rig, np.linalg.inv(eye), chart.angles)
        measured = placed(eye, outcome.surface.vertices_mm)
        px_mm = float(np.median(outcome.surface.vertices_mm[:, 2])) / rig.camera.fx
        seen.append((view, density_of(chart, measured, view, px_mm=px_mm)))
    belief = belief_of(chart, seen)
    chances = np.stack([np.where(view.seen, SURE * density, 0.0) for view, density in seen])
    calls = [
        Call(number, burr, found.T_world_camera[number] @ burr.T_mesh_burr, _slope_deg(burr.T_mesh_burr))
        for number, (_, outcome) in enumerate(good)
        for burr in outcome.inspection.burrs
        if np.isfinite(burr.T_mesh_burr).all()
    ]
    places = joined(calls, axis=found.axis, chart=chart, chances=chances, burrs=burrs)
    for place in places:
        _suspect(belief, chart, place, T_part_plate)
    return Fused(found, chart, belief, places)


def _slope_deg(T_camera_burr: Floats) -> float:
    """Angle between a burr's outward normal and the way to the camera."""
    away = -T_camera_burr[:3, 3] / np.linalg.norm(T_camera_burr[:3, 3])
    return float(np.degrees(np.arccos(np.clip(away @ T_camera_burr[:3, 2], -1.0, 1.0))))


def _posed(look: Look, outcome: Outcome) -> PosedSurface:
    surface = outcome.surface
    return PosedSurface(surface.vertices_mm, surface.faces, surface.vertex_sigma_mm, look.T_plate_camera)


def _suspect(belief: Belief, chart: Chart, place: Place, T_part_plate: Floats) -> None:
    """Put a place's suspicion on the map."""
    at = (T_part_plate @ place.burr.T_mesh_burr)[:3, 3]
    along, around = chart.cells_of(at[None], within_mm=10.0)
    if along[0] >= 0:
        belief.suspicion[along[0], around[0]] += place.suspicion
        belief.unfaced[along[0], around[0]] += place.unfaced
