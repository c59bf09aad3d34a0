"""Wheels with windows: their edges are no burrs, and a burr beside them is one."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.synthetic.depth_view import posed_view, single_view
from bench.synthetic.ordinary_parts import Mesh, box, closed, joined, turned
from burrscan.api import inspect_mesh
from burrscan.arrays import Floats
from burrscan.burrs import residual
from burrscan.burrs.detect import Region
from burrscan.burrs.field import field_of
from burrscan.burrs.openings import MOST_OPEN, Openings
from burrscan.inspection import Axis, Generatrix
from burrscan.meshio import read_mesh
from burrscan.pipeline import Stage
from tests.data import HERE, UNIT


def wheel(spokes: int, *, ridge_mm: float = 0.0) -> Mesh:
    """A rim of 80 mm, a hub and flat spokes; with a ridge along the rim's outside."""

    def lift(z: Floats, r: Floats, angle: Floats) -> Floats:
        tent = np.clip(1.0 - np.abs(angle - 0.2) * 76.0 / 1.2, 0.0, None)
        return np.asarray(1.0 + ridge_mm / 80.0 * tent * (r > 79.0) * (np.abs(z) < 12.0))

    rim = turned(closed([(-15.0, 70.0), (-15.0, 80.0), (15.0, 80.0), (15.0, 70.0)]), around=1440, lift=lift)
    hub = turned(closed([(-12.0, 4.0), (-12.0, 22.0), (12.0, 22.0), (12.0, 4.0)]))
    bar = box((18.0, 72.0), (-6.0, 6.0), (-4.0, 4.0))
    turns = Rotation.from_euler("z", np.arange(spokes)[:, None] * 360.0 / spokes, degrees=True)
    return joined([rim, hub, *((bar[0] @ turn.as_matrix().T, bar[1]) for turn in turns)])


def seen(part: Mesh, tilt_deg: float) -> Mesh:
    """One view from in front of the wheel and aside."""
    tilt = np.radians(tilt_deg)
    view = -np.array([np.sin(tilt), 0.0, np.cos(tilt)])
    return single_view(*part, view, pixels=200, sigma=0.08, seed=7)


@pytest.mark.study
@pytest.mark.parametrize("spokes", [4, 5, 7])
def test_the_edges_of_windows_are_no_burrs(spokes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Nor are they where burrs may be twice as high as usual, and the walls are not those of other bodies."""
    views = [seen(wheel(spokes), tilt_deg) for tilt_deg in (20.0, 35.0, 50.0)]
    assert [inspect_mesh(*view).burrs for view in views] == [(), (), ()]
    tall = Stage("residual", {"tallest_mm": 10.0})
    assert [inspect_mesh(*view, burrs=tall).burrs for view in views] == [(), (), ()]
    monkeypatch.setattr(residual, "MOST_OPEN", 1.0)
    assert sum(len(inspect_mesh(*view, burrs=tall).burrs) for view in views) >= 5


@pytest.mark.parametrize("tilt_deg", [50.0, 65.0])
def test_a_burr_on_such_a_wheel_is_found(tilt_deg: float) -> None:
    (burr,) = inspect_mesh(*seen(wheel(5, ridge_mm=1.5), tilt_deg)).burrs
    assert burr.side == "protrusion"
    assert burr.height_mm.value == pytest.approx(1.5, abs=0.3)


@pytest.mark.study
def test_bolt_holes_and_windows_of_real_wheels_are_no_burrs() -> None:
    """Single views of public meshes; of these six there were 29 calls."""
    calls = 0
    for name, views in (("tb3_left_tire.stl", (0, 1, 5, 8)), ("jackal_wheel.stl", (4, 10))):
        mesh = read_mesh(HERE / "meshes" / name, unit=UNIT.get(name, "mm"))
        noise = 0.001 * float(np.ptp(mesh.vertices_mm, axis=0).max())
        for view in views:
            rng = np.random.default_rng((5, view))
            vertices, faces, _ = posed_view(mesh.vertices_mm, mesh.faces, rng, sigma=noise, seed=(view, 9))
            calls += len(inspect_mesh(vertices, faces).burrs)
    assert calls <= 2


@pytest.mark.parametrize("turned_deg", [0.0, 90.0, 180.0])
def test_what_is_open_is_counted_wherever_the_angle_begins(turned_deg: float) -> None:
    """A drum of 40 mm with a window of 20 by 20 mm; places at its edge and far from it."""
    angle = np.radians(np.arange(0.0, 360.0, 0.5) + turned_deg)
    z = np.arange(0.0, 60.0, 0.35)
    grid = np.stack(
        [
            40.0 * np.cos(angle)[:, None] + 0.0 * z,
            40.0 * np.sin(angle)[:, None] + 0.0 * z,
            0.0 * angle[:, None] + z,
        ],
        axis=2,
    )
    lift = 0.01 * np.random.default_rng(1).normal(size=grid.shape[:2])
    arc = np.radians(np.arange(0.0, 360.0, 0.5)) * 40.0
    window = (arc > 20.0)[:, None] & (arc < 40.0)[:, None] & (np.abs(z - 30.0) < 10.0)
    lift[~window & (np.abs(arc - 18.5) < 1.0)[:, None] & (np.abs(z - 30.0) < 8.0)] = -1.0  # along the window
    lift[(np.abs(arc - 120.0) < 1.0)[:, None] & (np.abs(z - 30.0) < 8.0)] = -1.0  # far from it
    grid[..., :2] *= (1.0 + lift / 40.0)[..., None]
    along = np.linspace(0.0, 60.0, 61)
    curve = Generatrix(along, np.full(61, 40.0), np.full(61, 0.01), np.full(61, 0.01))
    axis = Axis(np.zeros(3), np.array([0.0, 0.0, 1.0]), np.eye(4) * 1e-8, "known", 0, (), 0.0)
    field = field_of(grid[~window], np.zeros((0, 3), np.int32), axis, curve, sigma_mm=None)
    openings, told = Openings(field), {}
    for name, where in (("beside", 18.5), ("far", 120.0)):
        turn = np.angle(np.exp(1j * (field.angle - np.radians(turned_deg) - where / 40.0)))
        low = (np.abs(turn) < 0.04) & (field.deviation_mm < -0.5)
        cells = np.zeros(field.count.shape, np.bool_)
        cells[field.cell[low, 0], field.cell[low, 1]] = True
        told[name] = openings.beside(Region(cells, -1, 10.0, 1.0, (3, 3)))
    assert told["far"] == 0.0
    assert MOST_OPEN < told["beside"] < 0.5  # within 4 mm on each side, of which 2.5 are open
