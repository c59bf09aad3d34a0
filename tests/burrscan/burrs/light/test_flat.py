"""Lines of another brightness on a flat surface, through pixels that see the mean column of their light."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np
import pytest
from scipy.optimize import brentq

from burrscan.arrays import Bools, Floats
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs.light.disturbed import disturbed
from burrscan.burrs.light.flat import depth_of_a_pixel_mm, is_an_edge, wanders_flat
from burrscan.burrs.light.side import Looks
from burrscan.burrs.light.unrolled import Unrolled, unrolled
from burrscan.burrs.pose import pose_on_surface
from burrscan.inspection import Axis, Burr, Value
from burrscan.pose import placed
from burrscan.rig import Rig
from burrscan.sideways import across_columns
from tests.burrscan.burrs.light.scene import Scene
from tests.tiers import some_of

ROWS, COLUMNS, FINE = 24, 40, 64
NOISE_MM = 0.01
WIDEST_MM = 3.0
DEPTH_MM = 0.45
"""By which a depth is off whose column is that of the neighbouring pixel."""


def seen(
    *, width: float, factor: float, askew: float, start: float, rows: int = ROWS
) -> tuple[Floats, Floats]:
    """Each pixel's light, and the centroid of it in pixels, where such a line runs.

    ``width`` and ``start`` in pixels; ``askew`` is what the line moves by from row to row.
    """
    x = (np.arange(COLUMNS * FINE) + 0.5) / FINE
    middle = start + askew * np.arange(rows)[:, None]
    light = np.where(np.abs(x - middle) < 0.5 * width, factor, 1.0).reshape(rows, COLUMNS, FINE)
    inside = (np.arange(FINE) + 0.5) / FINE - 0.5
    return light.mean(axis=-1), (light * inside).sum(axis=-1) / light.sum(axis=-1)


def line(
    *, width: float, factor: float, askew: float, start: float, rng: np.random.Generator
) -> tuple[Bools, Floats]:
    """Cells that such a line disturbs, and depths there."""
    _, centroid = seen(width=width, factor=factor, askew=askew, start=start)
    return np.abs(centroid) > 0.05, DEPTH_MM * centroid + NOISE_MM * rng.normal(size=centroid.shape)


@pytest.mark.parametrize("slant", [(0.08, 0.12), (0.12, 0.6)])
@some_of("factor", [0.1, 10.0, 0.4, 4.0], first=2)
@pytest.mark.parametrize("width", [0.3, 0.8, 1.6])
def test_a_scratch_that_runs_askew_is_flat(width: float, factor: float, slant: tuple[float, float]) -> None:
    """Its rows' sums agree to two standard errors by chance in 5 %, in two or three stretches in more."""
    rng = np.random.default_rng([int(10 * width), int(10 * factor), int(10 * slant[1])])
    flat = []
    for _ in range(100):
        askew = float(rng.uniform(*slant) * rng.choice([-1.0, 1.0]))
        cells, depth = line(width=width, factor=factor, askew=askew, start=20.0 + rng.random(), rng=rng)
        flat.append(wanders_flat(cells, depth, pixel_mm=DEPTH_MM))
    assert np.mean(flat) >= 0.85


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_what_stands_up_or_is_cut_in_along_it_is_not(side: float) -> None:
    """A burr of a fifth of a millimetre, two pixels wide, whose flanks are as bright as scratches."""
    rng = np.random.default_rng(3)
    for _ in range(100):
        askew, start = float(rng.uniform(0.1, 0.6)), 20.0 + rng.random()
        cells, depth = line(width=2.0, factor=4.0, askew=askew, start=start, rng=rng)
        pixel = np.arange(COLUMNS) + 0.5
        lifted = np.abs(pixel - (start + askew * np.arange(ROWS)[:, None])) < 1.0
        depth = depth + side * 0.2 * lifted
        assert not wanders_flat(cells | lifted, depth, pixel_mm=DEPTH_MM)


def test_depths_that_no_edge_bends_so_far_are_not_flat() -> None:
    """Light that bounced beside a flake of 1.7 mm showed depths of 2 mm to both sides, which cancelled."""
    rng = np.random.default_rng(11)
    cells, depth = line(width=0.8, factor=6.0, askew=0.37, start=20.2, rng=rng)
    assert wanders_flat(cells, depth, pixel_mm=DEPTH_MM)
    assert not wanders_flat(cells, 50.0 * depth, pixel_mm=DEPTH_MM)


def test_along_the_pixels_nothing_is_told() -> None:
    """There a scratch's depths are off by the same all along, as a narrow burr's are."""
    rng = np.random.default_rng(5)
    for start in np.linspace(20.0, 21.0, 21):
        cells, depth = line(width=0.4, factor=6.0, askew=0.0, start=float(start), rng=rng)
        if cells.any():
            assert not wanders_flat(cells, depth, pixel_mm=DEPTH_MM)


def test_pixels_without_a_depth_have_no_say() -> None:
    rng = np.random.default_rng(7)
    cells, depth = line(width=0.5, factor=5.0, askew=0.3, start=20.2, rng=rng)
    depth[rng.random(depth.shape) < 0.2] = np.nan
    assert wanders_flat(cells, depth, pixel_mm=DEPTH_MM)


def test_what_is_mirrored_up_and_down_is_no_edge() -> None:
    """A burr's flanks show depths above and below the surface, which cancel: no edge bends so far."""
    rng = np.random.default_rng(9)
    for _ in range(50):
        pixel, middle = np.arange(COLUMNS), 20.0 + 0.15 * np.arange(ROWS)[:, None]
        cells = np.abs(pixel - middle) < 2.0
        depth = DEPTH_MM * np.where(pixel < middle, 1.0, -1.0) * cells
        depth = depth + 0.3 * DEPTH_MM * rng.normal(size=depth.shape)
        assert not wanders_flat(cells, depth, pixel_mm=DEPTH_MM)


def test_what_hides_its_surroundings_is_no_scratch() -> None:
    rng = np.random.default_rng(13)
    cells, depth = line(width=0.8, factor=6.0, askew=0.3, start=20.2, rng=rng)
    depth[rng.random(depth.shape) < 0.7] = np.nan
    assert not wanders_flat(cells, depth, pixel_mm=DEPTH_MM)


class Strip:
    """A piece of a cylinder's surface with a line of another brightness along it."""

    def __init__(
        self,
        *,
        width: float,
        factor: float,
        askew: float,
        start: float,
        times: float = 1.0,
        called: float | None = None,
    ) -> None:
        scene = Scene()
        self.axis: Axis = scene.axis
        self.surface, self._looks, _ = disturbed(
            scene.sight(), scene.axis, scene.generatrix, widest_mm=WIDEST_MM
        )
        rows = np.flatnonzero(self.surface.open.any(axis=1))
        self._first, self.column = int(rows[len(rows) // 2 - ROWS // 2]), len(self.surface.angle) // 2
        light, centroid = seen(width=width, factor=factor, askew=askew, start=start)
        self._middle = (start if called is None else called) + askew * 0.5 * (ROWS - 1)
        self._askew = askew
        rng = np.random.default_rng(int(1e6 * start))
        lift = times * pixel_mm(self.surface, self.column) * centroid
        deviation = NOISE_MM * rng.normal(size=self._looks.deviation_mm.shape)
        near = (slice(self._first, self._first + ROWS), slice(self.column, self.column + COLUMNS))
        deviation[near] += lift
        shown = np.zeros_like(deviation)
        shown[near] = np.log(light)
        self.looks = Looks(shown, np.zeros_like(shown), deviation)

    def burr(self, *, width_mm: float) -> Burr:
        """What is called there."""
        surface, row = self.surface, self._first + ROWS // 2
        turn = float(surface.angle[1] - surface.angle[0])
        angle = float(surface.angle[self.column]) + (self._middle - 0.5) * turn
        upwards = np.sign(surface.z_mm[row + 1] - surface.z_mm[row])
        direction = np.array([self._askew, upwards]) / np.hypot(self._askew, 1.0)
        ends = np.sort(surface.z_mm[[self._first, self._first + ROWS - 1]])
        foot = np.array([surface.z_mm[row], surface.r_mm[row]])
        nothing = Value(0.1, 0.1)
        return Burr(
            side="nick", angle_deg=Value(float(np.degrees(angle)), 0.1),
            z_start_mm=Value(float(ends[0]), 0.1),
            z_end_mm=Value(float(ends[1]), 0.1), height_mm=nothing, width_mm=Value(width_mm, 0.1),
            length_mm=nothing, area_mm2=nothing, volume_mm3=nothing, significance=10.0,
            T_mesh_burr=pose_on_surface(foot, np.array([0.0, 1.0]), angle, direction, self.axis),
        )  # fmt: skip

    def stand(self, *, pixels: float, scatter: float) -> None:
        """Lift the line's middle by so much of what a pixel can be off, with a scatter from row to row."""
        rng = np.random.default_rng(17)
        rows = self._first + np.arange(ROWS)
        line = self._middle + self._askew * (np.arange(ROWS) - 0.5 * (ROWS - 1))
        lifted = self.looks.deviation_mm.copy()
        lift = pixels * (1.0 + scatter * rng.normal(size=ROWS)) * pixel_mm(self.surface, self.column)
        lifted[rows, self.column + np.rint(line - 0.5).astype(int)] += lift
        self.looks = Looks(self.looks.light, self.looks.predicted, lifted)

    def is_an_edge(
        self,
        *,
        pixels: float,
        by_depth: bool = True,
        side: Literal["protrusion", "nick"] = "nick",
        rows: int = ROWS,
    ) -> bool:
        """Whether a burr, its base so many pixels wide and so many rows long, is one."""
        burr = replace(self.burr(width_mm=pixels * self.surface.step_mm), side=side)
        z = self.surface.z_mm[[self._first, self._first + rows - 1]]
        start, end = (Value(float(each), 0.1) for each in np.sort(z))
        burr = replace(burr, z_start_mm=start, z_end_mm=end)
        return is_an_edge(burr, self.looks, self.surface, self.axis, by_depth=by_depth)


def pixel_mm(surface: Unrolled, column: int) -> float:
    """Depth by which a camera's ray is off where the next cell's ray of the projector is taken to meet it.

    To first order: the next cell is beside by one step, and both rays close that by their tangents.
    """
    angle = float(surface.angle[column + COLUMNS // 2])
    out, beside = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
    tangents = []
    for centre in (surface.camera_mm, surface.projector_mm):
        towards = centre[:2] - float(surface.r_mm[0]) * out
        tangents.append(float(towards @ beside) / float(towards @ out))
    return surface.step_mm / abs(tangents[0] - tangents[1])


@pytest.mark.parametrize("turned_deg", [0.0, 40.0, 70.0, 90.0])
def test_the_depth_of_a_pixel_is_what_its_neighbours_column_triangulates(turned_deg: float) -> None:
    """By the rig's own projection; the projector goes round until the baseline is along the axis."""
    scene, c, s = Scene(), np.cos(np.radians(turned_deg)), np.sin(np.radians(turned_deg))
    round_the_view = np.array([[c, s, 0, 0], [-s, c, 0, 0], [0, 0, 1.0, 0], [0, 0, 0, 1.0]])
    stood = Rig(scene.rig.camera, scene.rig.projector, scene.rig.T_projector_camera @ round_the_view)
    rig = across_columns(stood)
    surface = unrolled(scene.axis, scene.generatrix, rig)
    T_camera_part = np.linalg.inv(T_part_mesh(scene.axis.point_mm, scene.axis.direction))
    eye = surface.camera_mm[:2]
    found, true = [], []
    for row, column in np.argwhere(surface.open)[::97]:
        r, z = float(surface.r_mm[row]), float(surface.z_mm[row])
        turns = float(surface.angle[column]) + np.array([0.0, -0.5, 0.5]) * surface.step_mm / r
        part = np.stack([r * np.cos(turns), r * np.sin(turns), np.full(3, z)], axis=1)
        cell, *beside = placed(T_camera_part, part)
        away = (part[0, :2] - eye) / np.linalg.norm(part[0, :2] - eye)
        aside = np.linalg.norm(part[0, :2] - eye) / np.linalg.norm(cell)  # of the way, square to the axis
        ends = []
        for place in beside:
            wanted = float(rig.correspond(place)[0])
            ray = cell / np.linalg.norm(cell)
            off = brentq(lambda t, u=wanted, ray=ray: rig.correspond(t * ray)[0] - u, 300.0, 1500.0)
            ends.append(np.linalg.norm(eye + off * aside * away))
        found.append(depth_of_a_pixel_mm(surface, int(row), int(column)))
        true.append(abs(ends[1] - ends[0]))
    assert len(found) > 10
    assert np.allclose(found, true, rtol=1e-3, atol=1e-4)
    assert (np.median(found) < 0.5 * surface.step_mm) == (turned_deg == 90.0)


@some_of("factor", [0.2, 8.0, 3.0], first=2)
@pytest.mark.parametrize("width", [0.4, 0.9])
def test_what_is_called_at_a_scratch_is_an_edge(width: float, factor: float) -> None:
    for askew in (-0.3, 0.2):
        strip = Strip(width=width, factor=factor, askew=askew, start=20.3)
        assert strip.is_an_edge(pixels=0.7)
        assert not strip.is_an_edge(pixels=1.0)
        # several times as deep, or with no light that explains it, it is none
        assert not Strip(width=width, factor=factor, askew=askew, start=20.3, times=5.0).is_an_edge(
            pixels=0.7
        )
        dark = np.zeros_like(strip.looks.light)
        strip.looks = Looks(dark, dark, strip.looks.deviation_mm)
        assert not strip.is_an_edge(pixels=0.7)


def test_what_the_light_tells_of_is_an_edge_only_where_its_depths_cancel() -> None:
    """A wide stain's two edges bend the depth to opposite sides; a line at rest in its pixels to one."""
    strip = Strip(width=3.0, factor=3.0, askew=0.3, start=20.0)
    assert strip.is_an_edge(pixels=3.0, by_depth=False)
    strip.looks = Looks(strip.looks.light, strip.looks.predicted, np.abs(strip.looks.deviation_mm))
    assert not strip.is_an_edge(pixels=3.0, by_depth=False)


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_the_border_of_a_patch_bends_all_rows_alike_and_is_an_edge(factor: float) -> None:
    """A stain from pixel 20.3 on, that ends beyond what is looked at; a line has depths as alike."""
    strip = Strip(width=60.0, factor=factor, askew=0.0, start=50.3, called=20.8)
    sides: tuple[Literal["protrusion", "nick"], ...] = ("protrusion", "nick")
    assert all(strip.is_an_edge(pixels=1.0, side=side, by_depth=False) for side in sides)
    light = strip.looks.light.copy()
    light[:, strip.column + 21 :] = 0.0
    strip.looks = Looks(light, strip.looks.predicted, strip.looks.deviation_mm)
    assert not all(strip.is_an_edge(pixels=1.0, side=side, by_depth=False) for side in sides)


def test_a_line_along_the_generatrix_whose_rows_show_a_burr_is_none() -> None:
    """A curl narrower than a pixel: some rows show its height, others nothing, as metal does."""
    strip = Strip(width=0.4, factor=0.3, askew=0.0, start=20.5)
    strip.stand(pixels=0.12, scatter=0.6)
    assert not strip.is_an_edge(pixels=0.7, side="protrusion")
    assert strip.is_an_edge(pixels=0.7, side="nick")
    # too short to know where it runs, and askew: a scratch may be so
    assert strip.is_an_edge(pixels=0.7, side="protrusion", rows=12)
    askew = Strip(width=0.4, factor=0.3, askew=0.15, start=18.7)
    askew.stand(pixels=0.12, scatter=0.6)
    assert askew.is_an_edge(pixels=0.7, side="protrusion")


def test_a_line_along_the_generatrix_whose_rows_show_nothing_is_an_edge() -> None:
    for seed_shift in range(10):
        strip = Strip(width=0.4, factor=0.3, askew=0.0, start=20.5 + 1e-3 * seed_shift)
        strip.stand(pixels=0.001, scatter=100.0)
        assert strip.is_an_edge(pixels=0.7, side="protrusion")
        assert strip.is_an_edge(pixels=0.7, side="nick")


def test_what_hides_its_surroundings_is_no_edge() -> None:
    strip = Strip(width=3.0, factor=0.2, askew=0.2, start=20.3)
    hidden = strip.looks.deviation_mm.copy()
    hidden[strip.looks.light < -0.1] = np.nan
    assert strip.is_an_edge(pixels=3.0, by_depth=False)
    strip.looks = Looks(strip.looks.light, strip.looks.predicted, hidden)
    assert not strip.is_an_edge(pixels=3.0, by_depth=False)


@pytest.mark.parametrize("direction", [(1.0, 0.0), (0.8, 0.6)])
def test_a_burr_around_the_axis_is_not_judged(direction: tuple[float, float]) -> None:
    strip = Strip(width=0.9, factor=3.0, askew=0.2, start=20.3)
    burr = strip.burr(width_mm=strip.surface.step_mm)
    row = strip.surface.z_mm[len(strip.surface.z_mm) // 2]
    foot, radius = np.array([row, strip.surface.r_mm[0]]), np.array([0.0, 1.0])
    pose = pose_on_surface(foot, radius, 0.0, np.array(direction), strip.axis)
    assert not is_an_edge(
        replace(burr, T_mesh_burr=pose), strip.looks, strip.surface, strip.axis, by_depth=True
    )


def test_a_burr_on_a_face_is_not_judged() -> None:
    strip = Strip(width=0.9, factor=3.0, askew=0.2, start=20.3)
    burr = strip.burr(width_mm=strip.surface.step_mm)
    foot, upwards = np.array([strip.surface.z_mm[0], strip.surface.r_mm[0]]), np.array([1.0, 0.0])
    pose = pose_on_surface(foot, upwards, 0.3, np.array([0.0, 1.0]), strip.axis)
    assert not is_an_edge(
        replace(burr, T_mesh_burr=pose), strip.looks, strip.surface, strip.axis, by_depth=True
    )


@pytest.mark.parametrize("several", [False, True])
def test_one_look_drops_a_scratch_and_one_of_several_tells_it(*, several: bool) -> None:
    """A line two pixels wide, askew: depths to either side of it are off to either side."""
    scene = Scene()
    across = scene.around - 0.3 * scene.along
    on = scene.on & (np.abs(across) < 0.75) & (np.abs(scene.along) < 20.0)
    scene.log_light[on] += np.log(4.0)
    scene.lift_mm[on] += 0.6 * np.sign(across[on])
    _, _, places = disturbed(
        scene.sight(), scene.axis, scene.generatrix, widest_mm=WIDEST_MM, scratches=several
    )
    assert len(places) == several
