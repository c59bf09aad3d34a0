"""The section across a burr against geometry by brute force: points along rays, and point-in-triangle."""

from __future__ import annotations

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import perpendicular_basis
from burrscan.burrs.light.section import BOUNCE_TILTS_DEG, TILTS_DEG, seen, shaped
from tests.tiers import some_of

RADIUS = 50.0
CAMERA, PROJECTOR = np.array([300.0, 40.0]), np.array([290.0, -160.0])
RIGS = {  # how far camera and projector are along the axis, and which way the projector's columns run
    "across": (0.0, 0.0, (0.0, 0.0, 1.0)),
    "askew": (120.0, 60.0, (0.0, -0.4, 1.0)),
    "along": (130.0, -90.0, (-0.1, 1.0, 0.1)),
}
ANGLES = np.radians(np.linspace(-8.0, 8.0, 81))
EVEN = np.ones((2, TILTS_DEG.size))
NO_BOUNCE = np.zeros((2, BOUNCE_TILTS_DEG.size))
HEIGHTS = (4.0, 0.4, -3.0)
WIDTH = 3.0


def solid(points: Floats, burr: Floats) -> Bools:
    """Which points (n, 2) lie in the metal: beside the mouth in the circle, else below the flanks."""
    corners = burr[3:9].reshape(3, 2)
    beside = np.abs(np.arctan2(points[:, 1], points[:, 0])) > 0.5 * WIDTH / RADIUS
    inside = beside & (np.hypot(points[:, 0], points[:, 1]) < RADIUS)
    for a, b in ((corners[0], corners[1]), (corners[1], corners[2])):
        shares = np.linalg.inv(np.stack([a, b], axis=1)) @ points.T  # the wedge's sides from the middle
        inside |= (shares >= 0.0).all(axis=0) & (shares.sum(axis=0) <= 1.0)
    return np.asarray(inside)


def first_met(start: Floats, direction: Floats, burr: Floats, *, far: float) -> Floats | None:
    """Where a ray enters the metal, by steps of 2 µm at the last; none within ``far``."""
    low, high = 0.01, far
    for _ in range(3):
        t = np.linspace(low, high, 20_001)
        hits = np.flatnonzero(solid(start + t[:, None] * direction, burr))
        if not len(hits):
            return None
        low, high = t[max(hits[0] - 1, 0)], t[hits[0]]
    return np.asarray(start + high * direction)


def looked(angle: float) -> tuple[Floats, Floats]:
    """Start near the part, and direction, of the camera ray to a cell."""
    cell = RADIUS * np.array([np.cos(angle), np.sin(angle)])
    direction = (cell - CAMERA) / np.linalg.norm(cell - CAMERA)
    return cell - 12.0 * direction, direction


class Rig:
    """Camera, projector and the basis square to its columns; and what they make of a column."""

    def __init__(self, name: str) -> None:
        camera_z, projector_z, columns = RIGS[name]
        self.camera, self.projector = np.append(CAMERA, camera_z), np.append(PROJECTOR, projector_z)
        self.square = perpendicular_basis(np.array(columns) / np.linalg.norm(columns))
        self._columns = np.array(columns)

    def column(self, place: Floats) -> float:
        """The angle of the column through a place (3,)."""
        along, across = self.square.T @ (place - self.projector)
        return float(np.arctan2(across, along))

    def height(self, cell: Floats, column: float) -> float:
        """Deviation at which the camera's ray to a cell (2,) meets a column, by a plane through two lines."""
        ray = np.append(cell, 0.0) - self.camera
        inside = self.square @ (np.cos(column), np.sin(column))
        sides = np.stack([ray, -inside, -self._columns], axis=1)
        t = np.linalg.solve(sides, self.projector - self.camera)[0]
        return float(np.linalg.norm((self.camera + t * ray)[:2]) - RADIUS)


@pytest.fixture(params=RIGS)
def rig(request: pytest.FixtureRequest) -> Rig:
    return Rig(request.param)


@some_of("height", HEIGHTS)
def test_what_is_lit_directly_shows_its_own_depth_and_shadows_are_dark(rig: Rig, height: float) -> None:
    burr = shaped(RADIUS, 0.0, WIDTH, height)
    dark = 0
    for angle in ANGLES:
        light, depth, spread = seen(angle, burr, EVEN, NO_BOUNCE, rig.camera, rig.projector, rig.square)
        met = first_met(*looked(angle), burr, far=40.0)
        assert met is not None
        to = (PROJECTOR - met) / np.linalg.norm(PROJECTOR - met)
        back = (CAMERA - met) / np.linalg.norm(CAMERA - met)
        reached = first_met(met + 0.005 * (to + back), to, burr, far=20.0) is None
        assert light == float(reached), np.degrees(angle)
        dark += not reached
        if reached:
            assert depth == pytest.approx(np.linalg.norm(met) - RADIUS, abs=2e-3)
            assert spread == pytest.approx(0.0, abs=1e-9)
    assert (dark > 0) == (abs(height) > 1.0)


@some_of("height", [2.6, -1.8])
def test_a_mirroring_flank_adds_the_light_and_the_column_of_what_it_mirrors(rig: Rig, height: float) -> None:
    burr = shaped(RADIUS, 0.0, WIDTH, height)
    mirror = np.where(BOUNCE_TILTS_DEG == 0.0, 1.0, 0.0) * np.ones((2, 1))
    corners = burr[3:9].reshape(3, 2)
    compared = 0
    for angle in ANGLES:
        start, direction = looked(angle)
        met = first_met(start, direction, burr, far=40.0)
        assert met is not None
        turn = float(np.arctan2(met[1], met[0]))
        if not 0.1 < abs(turn) * RADIUS < 0.45 * WIDTH:  # a flank, away from its ends
            continue
        along = corners[1] - corners[0] if turn < 0.0 else corners[2] - corners[1]
        along /= np.linalg.norm(along)
        mirrored = 2.0 * (direction @ along) * along - direction
        other = first_met(met + 0.003 * np.array([along[1], -along[0]]), mirrored, burr, far=60.0)
        once, depth, _ = seen(angle, burr, EVEN, NO_BOUNCE, rig.camera, rig.projector, rig.square)
        light, both, _ = seen(angle, burr, EVEN, mirror, rig.camera, rig.projector, rig.square)
        if other is None:
            assert (light, both) == (once, depth)
            continue
        if light == once:  # what is mirrored lies in the shade
            continue
        compared += 1
        assert 0.6 < light - once < 0.95  # a metal's reflectance
        cell = RADIUS * np.array([np.cos(angle), np.sin(angle)])
        rise = -rig.camera[2] / np.linalg.norm(cell - CAMERA)  # along the axis, per mm square to it
        gone = np.linalg.norm(met - CAMERA) + np.array([0.0, np.linalg.norm(other - met)])
        places = np.column_stack([np.stack([met, other]), rig.camera[2] + gone * rise])
        direct, bounced = (rig.column(place) for place in places)
        column = (once * direct + (light - once) * bounced) / light
        assert both == pytest.approx(rig.height(cell, column), abs=0.03)
    assert compared >= 3


def test_a_burr_of_no_height_is_the_circle(rig: Rig) -> None:
    burr = shaped(RADIUS, 0.0, WIDTH, 0.0)
    for angle in ANGLES:
        light, depth, _ = seen(angle, burr, EVEN, NO_BOUNCE, rig.camera, rig.projector, rig.square)
        assert light == 1.0
        assert depth == pytest.approx(0.0, abs=0.03)  # flanks are chords
