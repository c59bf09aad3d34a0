"""Burrs along an edge: as long as a sixth of the wheel, several on one edge, from aside and from above."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bench.synthetic.clean_command import seen as seen_clean
from bench.synthetic.depth_view import single_view
from burrscan.api import inspect_mesh
from burrscan.arrays import Bools, Floats, Ints, Ints32
from burrscan.axis.basis import T_part_mesh
from burrscan.burrs import describe, detect, field, local_cfar, past_end, reach, residual
from burrscan.burrs.edges import View
from burrscan.burrs.noise import correlated_noise
from burrscan.burrs.noise.border import inner
from burrscan.burrs.openings import MOST_OPEN, Openings
from burrscan.generatrix import curve
from burrscan.generatrix.polyline import polyline_of
from burrscan.inspection import Burr, Inspection, Value
from burrscan.pose import placed
from scenes.wheel import RimBurr, build_wheel, load_wheel
from tests.tiers import some_of

_HEIGHT_MM, _RADIUS_MM = 1.2, 70.0


def called(
    *angles_deg: float, arc_deg: float, direction: str, from_deg: float, seed: int = 0
) -> tuple[Burr, ...]:
    """What is called of burrs on the largest edge of the stepped hub, seen from so far above its plane."""
    burrs = [
        RimBurr(
            angle_deg=at,
            arc_deg=arc_deg,
            height_mm=_HEIGHT_MM,
            width_mm=1.0,
            edge=(20.0, _RADIUS_MM),
            direction=direction,  # type: ignore[arg-type]
        )
        for at in angles_deg
    ]
    wheel = build_wheel(load_wheel("stepped_hub"), burrs, facet_error_mm=0.01)
    up = np.radians(from_deg)
    view = -np.array([np.cos(up), 0.0, np.sin(up)])
    return inspect_mesh(*single_view(*wheel.welded(), view, pixels=300, sigma=0.02, seed=seed)).burrs


@some_of(
    ("angles_deg", "arc_deg", "direction", "from_deg"),
    [
        ((0.0,), 60.0, "radial", 17.0),
        ((-40.0, -5.0, 30.0), 20.0, "radial", 17.0),
        ((-40.0, -5.0, 30.0), 20.0, "axial", 63.0),
        pytest.param((-35.0, 20.0), 30.0, "radial", 17.0, marks=pytest.mark.study),
        pytest.param((-50.0, 0.0, 45.0), 30.0, "axial", 63.0, marks=pytest.mark.study),
        pytest.param((-35.0, 25.0), 45.0, "axial", 63.0, marks=pytest.mark.study),
    ],
)
def test_every_burr_of_an_edge_is_measured(
    angles_deg: tuple[float, ...], arc_deg: float, direction: str, from_deg: float
) -> None:
    found = called(*angles_deg, arc_deg=arc_deg, direction=direction, from_deg=from_deg)
    assert [burr.side for burr in found] == ["protrusion"] * len(angles_deg)
    assert [burr.height_mm.value for burr in found] == pytest.approx([_HEIGHT_MM] * len(found), abs=0.05)
    long_mm = np.radians(arc_deg) * _RADIUS_MM
    assert [burr.length_mm.value for burr in found] == pytest.approx([long_mm] * len(found), rel=0.05)


@pytest.mark.study
def test_the_level_of_an_edge_is_that_of_its_arc_and_not_of_its_vertices(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A burr's flanks have most vertices of an edge: told by these, the burr is the edge."""
    assert len(called(0.0, arc_deg=60.0, direction="radial", from_deg=40.0)) == 1

    def each(place: Ints) -> Ints:
        return np.ones_like(place)

    monkeypatch.setattr(field, "_mates", each)
    assert not called(0.0, arc_deg=60.0, direction="radial", from_deg=40.0)


@pytest.mark.study
def test_a_gap_is_no_burr(monkeypatch: pytest.MonkeyPatch) -> None:
    """Long boxes over the gap between two burrs stand out as well, and made one burr of both."""
    burrs = {"arc_deg": 20.0, "direction": "radial", "from_deg": 17.0}
    assert len(called(-40.0, -5.0, **burrs)) == 2  # type: ignore[arg-type]

    def nowhere(plain: Bools, *_: object) -> Bools:
        return np.zeros_like(plain)

    monkeypatch.setattr(detect, "_between", nowhere)
    assert len(called(-40.0, -5.0, **burrs)) == 1  # type: ignore[arg-type]


def test_a_short_gap_is_within_one_burr() -> None:
    """Two degrees are 2.4 mm: a torn burr's gap."""
    found = called(-10.5, 10.5, arc_deg=19.0, direction="radial", from_deg=17.0)
    assert [round(burr.length_mm.value / 10.0) for burr in found] == [5]


Seen = tuple[Floats, Ints32]


def from_above(*burrs: RimBurr, up_rad: float, seed: int = 0, sigma: float = 0.03) -> Seen:
    """One view of the stepped hub with these burrs on its largest edge."""
    wheel = build_wheel(load_wheel("stepped_hub"), burrs, facet_error_mm=0.01)
    view = -np.array([np.cos(up_rad), 0.0, np.sin(up_rad)])
    return single_view(*wheel.welded(), view, pixels=300, sigma=sigma, seed=seed)


def rim(
    angle_deg: float, arc_deg: float, height_mm: float, width_mm: float, direction: str = "radial"
) -> RimBurr:
    return RimBurr(
        angle_deg=angle_deg,
        arc_deg=arc_deg,
        height_mm=height_mm,
        width_mm=width_mm,
        edge=(20.0, _RADIUS_MM),
        direction=direction,  # type: ignore[arg-type]
    )


def no(*_: object, **__: object) -> bool:
    return False


@some_of(
    ("direction", "up_rad"),
    [("radial", 0.3), ("radial", 0.6), ("radial", 0.95), ("axial", 0.6), ("axial", 1.1)],
    first=2,
)
def test_a_burr_is_as_high_as_its_one_visible_flank_reaches(direction: str, up_rad: float) -> None:
    (burr,) = inspect_mesh(*from_above(rim(0.0, 20.0, 1.5, 0.9, direction), up_rad=up_rad)).burrs
    height = burr.height_mm
    assert height.value == pytest.approx(1.5, abs=0.15)
    assert abs(height.value - 1.5) < 3.0 * height.sigma
    assert height.sigma < 0.15


@pytest.mark.study
def test_a_wall_without_width_is_no_ridge(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of a flank beyond an edge has the edge as its foot, and a ridge's width is anything."""
    burrs = rim(-36.3, 29.7, 1.39, 0.8, "axial"), rim(30.0, 21.1, 1.53, 1.0, "axial")
    seen = from_above(*burrs, up_rad=0.61)

    def right() -> Burr:
        (burr,) = (burr for burr in inspect_mesh(*seen).burrs if burr.T_mesh_burr[1, 3] > 0.0)
        return burr

    assert abs(right().height_mm.value - 1.53) < min(3.0 * right().height_mm.sigma, 0.2)
    monkeypatch.setattr(describe, "on_edge", no)
    assert abs(right().height_mm.value - 1.53) > 0.5


@pytest.mark.study
def test_a_corner_with_burrs_on_it_is_a_corner(monkeypatch: pytest.MonkeyPatch) -> None:
    """The burrs' sides run on in the end face: a walk that follows them leaves no corner."""
    burrs = rim(-39.0, 16.0, 1.4, 1.2), rim(-11.0, 14.0, 0.7, 0.9), rim(24.0, 30.0, 1.6, 1.1)
    seen = from_above(*burrs, up_rad=0.8, sigma=0.025)
    assert len(inspect_mesh(*seen).burrs) >= 2

    def apart(pieces: list[Floats], **_: float) -> list[Floats]:
        return pieces

    monkeypatch.setattr(curve, "met", apart)
    assert not inspect_mesh(*seen).burrs


@pytest.mark.study
def test_what_a_burr_on_an_edge_hides_is_no_opening(monkeypatch: pytest.MonkeyPatch) -> None:
    """From 15 degrees above the end face it hides three times as much as it is high."""
    seen = from_above(rim(-15.0, 27.0, 1.4, 0.7, "axial"), up_rad=0.27)
    (burr,) = inspect_mesh(*seen).burrs
    assert burr.height_mm.value == pytest.approx(1.4, abs=0.2)
    monkeypatch.setattr(residual, "on_edge", no)
    assert not inspect_mesh(*seen).burrs
    monkeypatch.setattr(residual, "MOST_OPEN", 1.0)
    assert len(inspect_mesh(*seen).burrs) == 1
    assert MOST_OPEN < 0.3


@pytest.mark.study
def test_the_noise_of_the_face_past_the_edge_hides_no_burr(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, faces = from_above(rim(0.0, 20.0, 0.8, 1.0), up_rad=0.5)
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    across = (radius < _RADIUS_MM - 2.0) & (abs(vertices[:, 2] - 20.0) < 1.0)
    angle = np.arctan2(vertices[:, 1], vertices[:, 0])
    # of 5 degrees and 2 mm: long boxes see them
    patches = np.random.default_rng(1).normal(0.0, 0.4, (72, 40))
    place = (np.degrees(angle[across]) + 180.0) // 5.0, radius[across] // 2.0
    vertices[across, 2] += patches[place[0].astype(int), place[1].astype(int)]
    on_rim = [burr for burr in inspect_mesh(vertices, faces).burrs if burr.T_mesh_burr[0, 3] > 69.0]
    assert [burr.side for burr in on_rim] == ["protrusion"]
    monkeypatch.setattr(local_cfar, "_ONE_FACE", -1.0)
    assert not inspect_mesh(vertices, faces).burrs


def test_a_scan_s_errors_are_not_shared_all_along_an_edge() -> None:
    """A dark flank has a large sigma; but no surface faces a convex edge, so no light makes it one error."""
    vertices, faces = from_above(rim(0.0, 20.0, 0.8, 1.0), up_rad=0.5)
    on = np.hypot(vertices[:, 0], vertices[:, 1]) > _RADIUS_MM + 0.1
    found = inspect_mesh(vertices, faces)
    seen = field.field_of(vertices, faces, found.axis, found.generatrix, sigma_mm=np.where(on, 0.2, 0.03))
    regions = local_cfar.convincing(seen, detect.regions(seen, false_calls_per_wheel=1e-6))

    def certain(openings: Openings | None) -> int:
        called, _ = residual._certain(
            seen, regions, found.axis, 1e-6, openings, view=None, eye=None, widest_mm=3.0
        )
        return len(called)

    assert certain(None) == 1
    assert certain(Openings(seen)) == 0


def from_aside(*burrs: RimBurr, seed: int = 0) -> Seen:
    """One view of the stepped hub's largest cylinder from straight aside: its end face is not seen."""
    return from_above(*burrs, up_rad=0.0, seed=seed)


def test_a_burr_is_seen_where_the_surface_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """Along the axis it stands off from nothing: it is more of the cylinder."""
    seen = from_aside(rim(-20.0, 16.0, 2.0, 1.0, "axial"), rim(25.0, 10.0, 2.0, 1.0, "axial"))
    found = sorted(inspect_mesh(*seen).burrs, key=lambda burr: burr.T_mesh_burr[1, 3])
    assert [burr.side for burr in found] == ["protrusion"] * 2
    for burr, (angle_deg, arc_deg) in zip(found, [(-20.0, 16.0), (25.0, 10.0)], strict=True):
        x, y, z = burr.T_mesh_burr[:3, 3]
        assert np.degrees(np.arctan2(y, x)) == pytest.approx(angle_deg, abs=0.7)
        assert burr.length_mm.value == pytest.approx(np.radians(arc_deg) * _RADIUS_MM, abs=1.5)
        assert z == pytest.approx(20.0, abs=0.5)
        assert abs(burr.height_mm.value - 2.0) < 3.0 * burr.height_mm.sigma
        assert burr.height_mm.sigma < 0.35
        assert np.isnan(burr.width_mm.value)
    monkeypatch.setattr(residual, "past_end", lambda *_, **__: past_end.Outlined([], set()))
    assert not inspect_mesh(*seen).burrs


@pytest.mark.study
def test_a_surface_that_ends_straight_has_none() -> None:
    assert [inspect_mesh(*from_aside(seed=seed)).burrs for seed in range(3)] == [()] * 3


def stepped(angle: Floats, z: Floats, keep: Bools, radii_mm: tuple[float, float]) -> Seen:
    """A grid (angles, places along the axis) of two cylinders, noise 0.02 mm, as far as it is kept."""
    number = np.full(z.shape, -1)
    number[keep] = np.arange(np.count_nonzero(keep))
    radius = np.where(z < 12.0, *radii_mm) + np.random.default_rng(3).normal(0.0, 0.02, z.shape)
    vertices = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1)[keep]
    if np.ptp(angle) > 6.0:  # all the way round
        number = np.concatenate([number, number[:1]])
    a, b, c, d = number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]
    faces = np.stack([np.stack([a, b, c], -1), np.stack([a, c, d], -1)], axis=2).reshape(-1, 3)
    return vertices, faces[(faces >= 0).all(axis=1)].astype(np.int32)


@pytest.mark.parametrize("waves", [3, 40])
def test_a_surface_that_ends_in_waves_has_none(waves: int) -> None:
    """A scalloped edge, and one with teeth: no straight line that a burr goes beyond."""
    angle, z = np.meshgrid(np.radians(np.arange(-70.0, 70.0, 0.4)), np.arange(0.0, 34.0, 0.5), indexing="ij")
    keep = z < 30.0 + 2.0 * np.sin(waves * angle)
    assert not inspect_mesh(*stepped(angle, z, keep, (70.0, 60.0))).burrs


@pytest.mark.parametrize("at_deg", [60.0, 175.0, 180.0])
def test_a_burr_past_the_end_of_a_whole_tube_may_lie_where_its_angles_begin(at_deg: float) -> None:
    """A tube of two diameters, open at both ends, with a tab of 12 degrees and 3 mm on one of them."""
    around = 720
    angle, z = np.meshgrid(
        np.radians(np.arange(around) * 360.0 / around), np.arange(0.0, 33.2, 0.5), indexing="ij"
    )
    tab = np.abs(np.angle(np.exp(1j * (angle - np.radians(at_deg))))) < np.radians(6.0)
    (burr,) = inspect_mesh(*stepped(angle, z, (z <= 30.0) | tab, (60.0, 50.0))).burrs
    x, y, _ = burr.T_mesh_burr[:3, 3]
    assert abs(np.degrees(np.angle(np.exp(1j * (np.arctan2(y, x) - np.radians(at_deg)))))) < 1.0
    assert burr.length_mm.value == pytest.approx(np.radians(12.0) * 50.0, abs=1.5)
    assert burr.height_mm.value == pytest.approx(3.0, abs=0.5)


@pytest.mark.study
def test_what_is_as_high_as_its_edge_is_round_is_no_burr(monkeypatch: pytest.MonkeyPatch) -> None:
    """The far wall of a bore: of the near one the view shows the edge."""
    seen, _ = seen_clean("spokes", 371038, noise=0.001)
    assert not inspect_mesh(*seen).burrs
    monkeypatch.setattr(past_end, "_ROUND", np.inf)
    (burr,) = inspect_mesh(*seen).burrs
    assert np.isnan(burr.width_mm.value)


@pytest.mark.parametrize(
    ("part", "number", "reach_px", "without"),
    [("wheels", 540033, 0.0, 2), ("cylinders", 530069, 1.5, 1)],
)
def test_a_burr_past_an_end_is_a_surface(
    part: str, number: int, reach_px: float, without: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not the first row of another surface, a gap beyond, nor the teeth into which noise tears a slope."""
    seen, _ = seen_clean(part, number, noise=0.001, reach_px=reach_px)
    assert not inspect_mesh(*seen).burrs
    monkeypatch.setattr(past_end, "_SOLID", 0.0)
    assert len(inspect_mesh(*seen).burrs) == without


def depth_calls(seen: Seen, *, from_mm: Floats | None = None) -> list[tuple[str, Value]]:
    """Side and height of what the depth of a scan shows, with nothing judged by its light.

    ``from_mm`` is where camera and projector stood, (3,) in the frame of the mesh, where that is told.
    """
    found = inspect_mesh(*seen)
    shown = field.field_of(*seen, found.axis, found.generatrix, sigma_mm=0.03)
    regions = local_cfar.convincing(shown, detect.regions(shown, false_calls_per_wheel=1e-6), cores=True)
    T = T_part_mesh(found.axis.point_mm, found.axis.direction)
    view = None
    if from_mm is not None:
        view = View(polyline_of(found.generatrix), placed(T, np.stack([from_mm, from_mm])))
    certain, _ = residual._certain(shown, regions, found.axis, 1e-6, None, view=view, eye=None, widest_mm=3.0)
    return [(one.burr.side, one.burr.height_mm) for one in certain]


def of_a_scan(seen: Seen, up_rad: float) -> int:
    """How many burrs the depth of a scan from up there shows: what is open beside them is no reason."""
    return len(depth_calls(seen, from_mm=1000.0 * np.array([np.cos(up_rad), 0.0, np.sin(up_rad)])))


def never(_: object, along_mm: Floats) -> Bools:
    return np.zeros(len(along_mm), np.bool_)


@pytest.mark.study
def test_a_burr_on_the_edge_of_a_face_that_is_grazed_stands_in_the_light(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Its feet are on the end face, which the view meets at 83 degrees; the burr itself it meets squarely."""
    up_rad = 0.12
    seen = from_above(rim(0.0, 27.0, 1.4, 0.7, "axial"), up_rad=up_rad)
    from_mm = 1000.0 * np.array([np.cos(up_rad), 0.0, np.sin(up_rad)])
    ((side, height),) = depth_calls(seen, from_mm=from_mm)
    assert side == "protrusion"
    assert height.value == pytest.approx(1.4, abs=0.2)
    monkeypatch.setattr(residual, "on_edge", no)
    assert len(depth_calls(seen)) == 1
    assert not depth_calls(seen, from_mm=from_mm)


@pytest.mark.study
def test_of_a_crest_that_is_looked_down_on_pixels_hide_the_tip() -> None:
    """Points of a mesh do not, nor does a camera that sees the burr from aside."""
    seen = from_above(rim(0.0, 20.0, 1.5, 0.9), up_rad=0.3)
    ((_, of_points),) = depth_calls(seen)
    ((_, from_front),) = depth_calls(seen, from_mm=np.array([1000.0, 0.0, 300.0]))
    ((_, from_aside),) = depth_calls(seen, from_mm=np.array([60.0, 0.0, 1000.0]))
    assert from_front.sigma > 1.5 * of_points.sigma
    assert abs(from_front.value - 1.5) < 2.0 * from_front.sigma
    assert from_aside.value == pytest.approx(of_points.value, rel=0.03)
    assert from_aside.sigma == pytest.approx(of_points.sigma, rel=0.3)


@pytest.mark.study
@pytest.mark.parametrize(("up_rad", "height_mm"), [(-0.1, 0.6), (-0.2, 1.0), (-0.3, 0.6)])
def test_a_burr_on_an_edge_may_be_the_border_of_what_is_seen(
    monkeypatch: pytest.MonkeyPatch, up_rad: float, height_mm: float
) -> None:
    """From below a burr stands between the wheel and nothing: hardly a vertex of it is off the border."""
    seen = from_above(rim(0.0, 30.0, height_mm, 0.8), up_rad=up_rad)
    assert of_a_scan(seen, up_rad) == 1
    with monkeypatch.context() as planted:
        planted.setattr(residual, "_THROUGH", 2.0)
        assert of_a_scan(seen, up_rad) == 0
    with monkeypatch.context() as planted:
        planted.setattr("burrscan.burrs.edges.at_end", never)
        assert of_a_scan(seen, up_rad) == 0


def test_the_border_of_an_edge_is_compared_with_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    vertices, faces = from_above(rim(0.0, 30.0, 0.6, 0.8), up_rad=-0.2)
    limb = ~inner(faces, len(vertices)) & (vertices[:, 2] < 10.0)
    vertices[limb] += np.random.default_rng(0).normal(0.0, 0.2, (np.count_nonzero(limb), 3))
    found = inspect_mesh(vertices, faces)
    shown = field.field_of(vertices, faces, found.axis, found.generatrix, sigma_mm=0.03)
    x, y, z = vertices[shown.vertex].T
    near = (np.abs(z - 20.0) < 1.5) & (np.hypot(x, y) > 69.0)
    (on,) = np.nonzero(near & (np.abs(np.arctan2(y, x)) < np.radians(16.0)))
    doubt = correlated_noise.doubt_of(shown)

    def shared_mm() -> float:
        return correlated_noise.noise_around(shown, doubt, on, on, ragged=True).shared_mm

    assert shared_mm() < 0.08
    monkeypatch.setattr(correlated_noise, "_FEWEST_BORDERS", len(vertices))
    assert shared_mm() > 0.16


def test_what_stands_two_vertices_off_the_border_is_none_of_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """The end face begins where most vertices are its border: those of a burr there are not."""
    seen = from_above(rim(0.0, 8.0, 1.5, 1.2, "axial"), up_rad=0.1)
    found = inspect_mesh(*seen)

    def bordering() -> float:
        shown = field.field_of(*seen, found.axis, found.generatrix, sigma_mm=0.03)
        x, y, z = seen[0][shown.vertex].T
        on = (np.abs(np.arctan2(y, x)) < np.radians(3.5)) & (z > 20.3) & (np.hypot(x, y) > 68.0)
        return float(shown.border[on].mean())

    assert bordering() < 0.75
    monkeypatch.setattr(field, "deep", lambda _, inside: np.zeros_like(inside))
    assert bordering() == 1.0


def test_the_core_of_a_burr_that_waves_have_joined_to_much_else_is_called() -> None:
    vertices, faces = from_above(rim(0.0, 10.0, 0.8, 1.0), up_rad=0.5)
    found = inspect_mesh(vertices, faces)
    shown = field.field_of(vertices, faces, found.axis, found.generatrix, sigma_mm=0.03)
    burr = max(detect.regions(shown, false_calls_per_wheel=1e-6), key=lambda one: one.significance)
    joined = detect.Region(
        detect.widened(burr.cells, 20, 25, closed=False), 1, burr.significance, burr.inflation, burr.box
    )
    assert not local_cfar.convincing(shown, [joined])
    (core,) = local_cfar.convincing(shown, [joined], cores=True)
    assert (core.cells & burr.cells).sum() > 0.8 * core.cells.sum()


def test_of_a_burr_that_a_wave_has_joined_to_a_wide_region_only_the_burr_is_high() -> None:
    """A twentieth of its cells, of which no quantile tells: the wave would be measured, and found too low."""
    vertices, faces = from_above(rim(0.0, 10.0, 0.8, 1.0), up_rad=0.5)
    found = inspect_mesh(vertices, faces)
    shown = field.field_of(vertices, faces, found.axis, found.generatrix, sigma_mm=0.03)
    burr = max(detect.regions(shown, false_calls_per_wheel=1e-6), key=lambda one: one.significance)
    wide = detect.widened(burr.cells, 24, 40, closed=False)
    wide &= burr.cells | (shown.score > 0.0)
    assert burr.cells.sum() < 0.05 * wide.sum()
    joined = detect.Region(wide, 1, burr.significance, burr.inflation, burr.box)
    alone, among = (residual._site(shown, one, one.cells) for one in (burr, joined))
    of_burr, high = (set(site.chosen[site.on].tolist()) for site in (alone, among))
    assert len(high & of_burr) > 0.8 * len(of_burr)
    assert len(high - of_burr) < 0.2 * len(high)


def outlines(seen: Seen, *, up_rad: float) -> tuple[tuple[Burr, ...], Inspection]:
    """What the outline shows, seen from far away, and what was found without it."""
    found = inspect_mesh(*seen)
    shown = field.field_of(*seen, found.axis, found.generatrix, sigma_mm=None)
    eye = 1e5 * np.array([np.cos(up_rad), 0.0, np.sin(up_rad)])
    line = polyline_of(found.generatrix)
    burrs = past_end.past_end(seen[0], found.axis, line, shown, tallest_mm=5.0, eye_mm=eye)
    return tuple(burrs.burrs), found


@some_of(("up_rad", "height_mm"), [(0.0, 0.5), (-0.15, 0.8), (0.0, 0.8)])
def test_an_outline_that_steps_out_by_a_pixel_is_a_burr(
    monkeypatch: pytest.MonkeyPatch, up_rad: float, height_mm: float
) -> None:
    """A pixel is half a millimetre: no column alone is sure, and beside the edge nothing stands off."""
    seen = from_above(rim(0.0, 30.0, height_mm, 1.0, "axial"), up_rad=up_rad)
    (burr,), found = outlines(seen, up_rad=up_rad)
    assert not found.burrs
    assert burr.angle_deg.value == pytest.approx(0.0, abs=1.0)
    assert burr.length_mm.value == pytest.approx(np.radians(30.0) * _RADIUS_MM, abs=1.5)
    assert abs(burr.height_mm.value - height_mm) < 3.0 * burr.height_mm.sigma
    monkeypatch.setattr(past_end, "WINDOWS_SEEN", reach.WINDOWS)
    assert outlines(seen, up_rad=up_rad)[0] == ()


@some_of("arc_deg", [65.0, 55.0])
def test_a_burr_may_take_half_of_an_outline(monkeypatch: pytest.MonkeyPatch, arc_deg: float) -> None:
    """What is usual hangs on most columns, a step on those beside it."""
    seen = from_above(rim(0.0, arc_deg, 1.2, 1.0, "axial"), up_rad=-0.15)
    (burr,), _ = outlines(seen, up_rad=-0.15)
    assert burr.angle_deg.value == pytest.approx(0.0, abs=1.0)
    assert burr.length_mm.value == pytest.approx(np.radians(arc_deg) * _RADIUS_MM, abs=2.5)
    assert abs(burr.height_mm.value - 1.2) < 3.0 * burr.height_mm.sigma
    assert burr.height_mm.sigma < 0.35  # scatter of what is usual
    monkeypatch.setattr(past_end, "between_steps", lambda reach, _: np.zeros(len(reach), np.bool_))
    assert outlines(seen, up_rad=-0.15)[0] == ()


def test_columns_between_a_step_out_and_a_step_in() -> None:
    """Of any number; not those of a slope, of one step alone, of a step in, of noise, nor unknown ones."""
    rng = np.random.default_rng(2)
    noise = 0.5 * rng.normal(size=200)
    at = np.arange(200)
    known = np.ones(200, np.bool_)
    for start, stop in ((60, 90), (30, 150)):
        burr = (at >= start) & (at < stop)
        found = reach.between_steps(noise + 2.5 * burr + 0.02 * at, known)
        assert np.abs(np.flatnonzero(found)[[0, -1]] - [start, stop - 1]).max() <= 4
        assert found.sum() == pytest.approx(stop - start, abs=6)
        some = rng.random(200) > 0.1
        assert not (reach.between_steps(np.where(some, noise + 2.5 * burr, -np.inf), some) & ~some).any()
    bumps = {
        "slope": 0.05 * at,
        "step": 3.0 * (at > 100),
        "in and out": -3.0 * (np.abs(at - 100) < 30),
        "hill": 3.0 * np.exp(-0.5 * ((at - 100) / 30.0) ** 2),
        "noise": np.zeros(200),
        "more noise": 4.0 * noise,
    }
    for name, bump in bumps.items():
        assert not reach.between_steps(noise + bump, known).any(), name
    assert not reach.between_steps(0.01 * noise + 0.6 * burr, known).any()  # less than a vertex
    assert not reach.between_steps(noise[:20], known[:20]).any()


@some_of("up_rad", [0.03, -0.15, 0.2])
@pytest.mark.parametrize("name", ["paper", "cone"])
def test_an_outline_without_steps_has_none(name: str, up_rad: float) -> None:
    wheel = build_wheel(load_wheel(name), [], facet_error_mm=0.01)
    view = -np.array([np.cos(up_rad), 0.0, np.sin(up_rad)])
    assert outlines(single_view(*wheel.welded(), view, sigma=0.03), up_rad=up_rad)[0] == ()


@pytest.mark.parametrize("slope", [0.0, 0.03])
def test_an_end_that_is_hidden_more_to_one_side_is_no_step(
    monkeypatch: pytest.MonkeyPatch, slope: float
) -> None:
    """What hides the end of a cylinder may end at a slope, or at a bend: a burr begins and ends.

    So it is for a mesh, too, of which nobody knows from where it was seen.
    """
    angle, z = np.meshgrid(np.radians(np.arange(-70.0, 70.0, 0.4)), np.arange(0.0, 34.0, 0.5), indexing="ij")
    keep = z < 30.0 + slope * np.degrees(np.maximum(angle - np.radians(25.0), 0.0))
    seen = stepped(angle, z, keep, (70.0, 60.0))
    shown, found = outlines(seen, up_rad=0.0)
    assert not shown
    assert not found.burrs
    monkeypatch.setattr(past_end, "steps_out", lambda *_, **__: True)
    shown, found = outlines(seen, up_rad=0.0)
    assert len(shown) == len(found.burrs) == (slope > 0.0)


def test_past_the_ends_of_an_arc_nothing_is_known() -> None:
    """What lies beside its last columns is not its first ones."""
    off = np.zeros(60)
    off[50:] = 1.0
    assert not reach.steps_out(off, np.arange(50, 60), closed=False)
    assert reach.steps_out(off, np.arange(50, 60), closed=True)
    assert reach.steps_out(off[::-1].repeat(2)[:60], np.arange(0, 20), closed=True)


def test_a_slope_that_pixels_make_a_comb_does_not_step_out() -> None:
    """The end of a clean ground wheel, as seen: its outline crosses rows of pixels at a small angle."""
    before, on = [0.4, -0.6, 0.3, 0.2, -0.8, 0.1, 0.0, -0.1, 0.9], [0.8, 0.7, -1.2]
    run, after = [0.7, 1.6, 1.5, 0.5, 1.5, 1.4, 0.4, 1.3, 1.3], [0.2, 1.2]
    beside = [1.1, 0.1, 1.1, 0.1, 1.0, 0.0, 1.0, 0.9, -0.1]
    off = np.array([*before, *on, *run, *after, *beside])
    where = np.arange(12, 21)
    assert not reach.steps_out(off, where, closed=False)
    assert reach.steps_out(np.array([*before, *on, *run, *after, *before]), where, closed=False)


def test_a_low_burr_steps_out_though_the_median_beside_it_errs() -> None:
    """A rim of 0.35 mm on turned metal, as seen: 0.63 spacings, beside it 0.30 in the mean, 0.33 mostly.

    Of a run no longer than what lies beside it the median errs as much: a comb on matt paint, on a bare edge.
    """
    before = [0.3, -0.2, -0.1, 0.2, -0.4, -0.1, 0.0, 0.2, -0.3]
    after = np.array([0.43, -0.07, 0.03, 0.23, 0.43, 0.53, 0.23, 0.33, 0.53])
    assert np.median(after) > 0.5 * 0.63

    def out(columns: int, more: float = 0.0) -> bool:
        off = np.array([*before, 0.2, 0.4, *[0.63] * columns, 0.6, 0.3, *(after + more)])
        return reach.steps_out(off, np.arange(11, 11 + columns), closed=False)

    assert out(45)
    assert not out(45, more=0.1)
    assert not out(9)


def test_a_burr_that_stands_up_along_the_axis_reaches_as_far_as_it_stands_up() -> None:
    """Under it is the edge alone, at z = 20."""
    vertices, faces = from_above(rim(0.0, 20.0, 1.5, 1.0, "axial"), up_rad=0.6)
    found = inspect_mesh(vertices, faces)
    (burr,) = found.burrs
    ends = [[0.0, 0.0, end.value] for end in (burr.z_start_mm, burr.z_end_mm)]
    back = np.linalg.inv(T_part_mesh(found.axis.point_mm, found.axis.direction))
    low, high = sorted(placed(back, np.array(ends))[:, 2])
    assert 19.0 < low < 20.2
    assert high == pytest.approx(21.5, abs=0.3)


def test_a_column_reaches_as_far_as_it_goes_without_a_gap() -> None:
    """What comes into view beyond the edge is another surface, whatever order the vertices are in."""
    ahead = np.array([0.1, 0.6, 1.2, 9.0, -0.4, 0.2, 10.0, 8.0, 0.0])
    column = np.array([0, 0, 0, 0, 1, 1, 1, 2, 4])
    for order in (np.arange(9), np.arange(9)[::-1]):
        found = reach.reach_of(ahead[order], column[order], 5, spacing_mm=0.5)
        np.testing.assert_array_equal(found, [1.2, 0.2, -np.inf, -np.inf, 0.0])
    assert not np.isfinite(reach.reach_of(ahead[:0], column[:0], 5, spacing_mm=0.5)).any()


def flank(lift_mm: Callable[[Floats, Floats], Floats], keep: Callable[[Floats, Floats], Bools]) -> Seen:
    """A grid of two cylinders, as of :func:`stepped`, with a lift (angle, z) of the larger one."""
    angle, z = np.meshgrid(np.radians(np.arange(-60.0, 60.0, 0.4)), np.arange(0.0, 34.0, 0.5), indexing="ij")
    vertices, faces = stepped(angle, z, keep(angle, z), (70.0, 60.0))
    turn, height = np.arctan2(vertices[:, 1], vertices[:, 0]), vertices[:, 2]
    radius = np.hypot(vertices[:, 0], vertices[:, 1])
    vertices[:, :2] *= (1.0 + lift_mm(turn, height) / radius)[:, None]
    return vertices, faces


def _within(angle: Floats) -> Bools:
    return np.asarray(np.abs(angle) < np.radians(12.0))


@pytest.mark.study
def test_a_nick_that_is_not_low_at_the_edge_is_the_image_of_a_burr(monkeypatch: pytest.MonkeyPatch) -> None:
    """Light that bounced in the corner beside a burr lies as deep as that is high; a nick is open there."""
    image = flank(
        lambda a, z: np.where(_within(a) & (z > 27.8) & (z < 29.3), -0.6, 0.0), lambda _, z: z <= 30.0
    )
    nick = flank(lambda a, z: np.where(_within(a) & (z > 27.8), -0.6, 0.0), lambda _, z: z <= 30.0)
    groove = flank(
        lambda a, z: np.where(_within(a) & (np.abs(z - 22.0) < 1.0), -0.6, 0.0), lambda _, z: z <= 30.0
    )
    ((side, high),) = depth_calls(image)
    assert side == "protrusion"
    assert 0.6 < high.value < 2.1
    for seen in (nick, groove):
        ((side, high),) = depth_calls(seen)
        assert side == "nick"
        assert high.value == pytest.approx(0.6, abs=0.1)
    monkeypatch.setattr(residual, "is_an_image", lambda *_: False)
    assert [side for side, _ in depth_calls(image)] == ["nick"]


def test_an_outline_of_what_is_hardly_known_is_no_burr() -> None:
    """A few columns have just enough light for a rounding that the others do not show."""
    seen = from_above(rim(0.0, 30.0, 0.8, 1.0, "axial"), up_rad=0.0)
    found = inspect_mesh(*seen)
    shown = field.field_of(*seen, found.axis, found.generatrix, sigma_mm=None)
    line, eye = polyline_of(found.generatrix), np.array([1e5, 0.0, 0.0])
    given = (seen[0], found.axis, line, shown)
    radius = np.hypot(seen[0][:, 0], seen[0][:, 1])
    burr = (seen[0][:, 2] > 20.1) & (radius > 60.0)  # the edge is at z = 20, of radius 70
    for doubt, burrs in ((0.01, 1), (0.3, 1), (0.6, 0)):
        sigma = np.where(burr, doubt * shown.spacing_mm, 0.01)
        told = past_end.past_end(*given, tallest_mm=5.0, sigma_mm=sigma, eye_mm=eye)
        assert len(told.burrs) == burrs


def test_what_lies_low_where_the_outline_is_longer_is_a_burrs_flank() -> None:
    """A burr on the edge that leans inwards; of a nick the outline is shorter, or as long as elsewhere."""

    def lean(angle: Floats, z: Floats) -> Floats:
        return np.where(_within(angle), -np.maximum(z - 29.3, 0.0), 0.0)

    columns = np.radians(0.4)  # five of eight are longer by a vertex: too little without what lies low
    longer = flank(lean, lambda a, z: z <= np.where(_within(a) & (np.round(a / columns) % 8 > 2), 30.5, 30.0))
    as_long = flank(lean, lambda _, z: z <= 30.0)
    found = inspect_mesh(*longer)
    line, eye = polyline_of(found.generatrix), np.array([1e5, 0.0, 0.0])
    for seen, burrs in ((longer, 1), (as_long, 0)):
        shown = field.field_of(*seen, found.axis, found.generatrix, sigma_mm=0.03)
        turn = np.angle(np.exp(1j * (shown.angle - np.median(shown.angle))))
        low = np.flatnonzero((np.abs(turn) < np.radians(12.0)) & (shown.deviation_mm < -0.1))
        given = (seen[0], found.axis, line, shown)
        told = past_end.past_end(*given, tallest_mm=5.0, eye_mm=eye, suspects={1: low})
        assert len(told.burrs) == burrs
        assert told.explained == ({1} if burrs else set())
        assert not past_end.past_end(*given, tallest_mm=5.0, eye_mm=eye).burrs


def test_an_end_that_something_hides_is_no_edge(monkeypatch: pytest.MonkeyPatch) -> None:
    """Seen from below, a step hides the foot of the cylinder behind it, and not by the same everywhere."""
    angle, z = np.meshgrid(np.radians(np.arange(-60.0, 60.0, 0.4)), np.arange(0.0, 34.0, 0.5), indexing="ij")
    hidden = (z >= 12.0) & (z < np.where(_within(angle), 18.9, 20.5))
    seen = stepped(angle, z, ~hidden, (70.0, 60.0))
    up_rad = -0.6
    assert not outlines(seen, up_rad=up_rad)[0]
    monkeypatch.setattr(past_end, "_hidden", lambda *_: False)
    assert outlines(seen, up_rad=up_rad)[0]
