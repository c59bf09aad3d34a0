"""The light decides what the depth alone gets wrong: whole runs of the method on synthetic scans."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from burrscan.burrs import residual
from burrscan.burrs.describe import describe
from burrscan.burrs.light.disturbed import Place, disturbed
from burrscan.burrs.light.shine import MIRRORED, walls_share
from burrscan.inspection import Burr, Value
from tests.burrscan.burrs.light.scene import Scene, bright_line, burrs_of, dark_line
from tests.burrscan.parts import turned


def mirrored(scene: Scene) -> None:
    """A ridge whose flank mirrors: much of it is not measured, the rest triangulates below the surface."""
    cells = scene.band(-12.0, 4.4, -15.0, 12.0)
    scene.log_light[cells] += 1.1
    scene.lift_mm[cells] -= 0.6
    scene.lost |= scene.band(-11.1, 2.6, -15.0, 12.0)


def mostly_dark(scene: Scene) -> None:
    """A ridge most of which is dark and has no depth; the rest cancels, for light bounced."""
    cells = scene.band(20.0, 4.4, -15.0, 12.0)
    rng = np.random.default_rng(1)
    scene.log_light[cells] -= 2.6
    scene.lost |= cells & (rng.random(cells.shape) < 0.6)
    scene.lift_mm[cells] += 0.25 * rng.choice([-1.0, 1.0], np.count_nonzero(cells))


def angle_at(scene: Scene, around_mm: float, along_mm: float) -> float:
    part = scene.in_part(scene.place_mm(around_mm, along_mm))
    return float(np.degrees(np.arctan2(part[1], part[0])))


@pytest.mark.parametrize("seed", range(3))
def test_a_ridge_that_triangulates_below_the_surface_is_a_ridge(seed: int) -> None:
    scene = Scene(seed=seed)
    mirrored(scene)
    assert [burr.side for burr in burrs_of(scene, seen=False)] == ["nick"]
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "protrusion"
    # the band is painted and shows no flank: its light tells its place to half of its width
    off = abs(turned(burr.angle_deg.value - angle_at(scene, -12.0, -1.5)))
    assert off < burr.angle_deg.sigma < np.degrees(0.5 * 4.4 / 90.0)


def test_where_hardly_any_depth_is_the_light_alone_tells() -> None:
    scene = Scene()
    dark_line(scene)
    scene.lost |= scene.band(20.0, 3.0, -15.0, 12.0)
    assert burrs_of(scene, seen=False) == ()
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "protrusion"
    assert abs(turned(burr.angle_deg.value - angle_at(scene, 20.0, -1.5))) < 0.5


@pytest.mark.parametrize(("sigma_mm", "calls"), [(0.1, 1), (np.nan, 1), (20.0, 0)])
def test_light_tells_nothing_where_nobody_knows_where_the_axis_lies(sigma_mm: float, calls: int) -> None:
    scene = Scene()
    dark_line(scene)
    scene.lost |= scene.band(20.0, 3.0, -15.0, 12.0)
    scene.axis = replace(scene.axis, covariance=np.diag([0.0, 0.0, sigma_mm**2, sigma_mm**2]))
    assert len(burrs_of(scene, seen=True)) == calls


@pytest.mark.parametrize(
    ("end_mm", "undetermined", "calls"), [(50.0, (), 1), (50.0, ("position",), 0), (44.0, ("position",), 1)]
)
def test_the_border_of_a_face_whose_axis_lies_anywhere_may_be_its_rounding(
    end_mm: float, undetermined: tuple[str, ...], calls: int
) -> None:
    """A cylinder seen from its end had two nicks where its rounding began."""
    scene = Scene()
    scene.lift_mm[scene.band(20.0, 6.0, end_mm - 8.0, end_mm)] -= 0.6
    scene.axis = replace(scene.axis, undetermined=undetermined)
    assert len(burrs_of(scene, seen=True)) == calls


@pytest.mark.parametrize(
    ("facing", "unmeasured", "contrast", "grazed"),
    [
        (0.37, 10, 3.0, True),
        (0.39, 10, 1.0, False),
        (0.49, 30, 1.9, True),
        (0.49, 30, 2.1, False),
        (0.51, 30, 1.0, False),
    ],
)
def test_what_is_only_grazed_is_no_burr_of_its_own(
    facing: float, unmeasured: int, contrast: float, *, grazed: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Holes of a turned wheel's shoulder, 67 degrees from the projector, were called a ridge."""

    def flat(*given: Any, **options: Any) -> Any:
        surface, looks, places = disturbed(*given, **options)
        seen = [replace(one, above=10, below=10, unmeasured=unmeasured) for one in places]
        return surface, looks, [replace(one, facing=facing, contrast=contrast) for one in seen]

    monkeypatch.setattr(residual, "disturbed", flat)
    scene = Scene()
    dark_line(scene)
    scene.lost |= scene.band(20.0, 3.0, -15.0, 12.0)
    assert len(burrs_of(scene, seen=True)) == (0 if grazed else 1)


def test_what_light_and_depth_agree_on_is_one_burr_measured_by_its_depth(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = Scene()
    bright_line(scene, at=(-15.0, -10.0, 20.0))
    (plain,), (burr,) = (burrs_of(scene, seen=seen) for seen in (False, True))
    assert burr.side == plain.side == "nick"
    assert burr.height_mm.value == pytest.approx(plain.height_mm.value, abs=0.04)
    assert plain.height_mm.value == pytest.approx(0.4, abs=0.08)
    # 30 degrees beside a highlight of 22 degrees six tenths of the light are gone: of a fifth of the height
    share = 0.2 * (1.0 - np.exp(-0.5 * (30.0 / 22.3) ** 2))
    monkeypatch.setattr(residual, "doubted", lambda burr, *_: burr)
    (alone,) = burrs_of(scene, seen=True)
    assert alone.height_mm.sigma == pytest.approx(share * burr.height_mm.value, rel=0.2)
    assert burr.height_mm.sigma < 2.0 * alone.height_mm.sigma


@pytest.mark.parametrize("seed", range(3))
def test_nothing_is_called_on_a_clean_part_and_on_a_stain(seed: int) -> None:
    scene = Scene(seed=seed)
    scene.log_light[np.hypot(scene.around - 15.0, scene.along) < 6.0] -= 1.5
    assert burrs_of(scene, seen=True) == ()


def test_the_light_of_one_place_says_nothing_of_another() -> None:
    scene = Scene()
    mirrored(scene)
    scene.lift_mm[scene.band(-25.0, 3.0, -10.0, 20.0)] -= 0.4  # a nick that changes no light
    sides = {
        round(turned(burr.angle_deg.value - angle_at(scene, 0.0, 0.0))): burr.side
        for burr in burrs_of(scene, seen=True)
    }
    assert sorted(sides.values()) == ["nick", "protrusion"]


def depth_alone(monkeypatch: pytest.MonkeyPatch) -> list[Burr]:
    """What the depth of a scan tells of its burrs, before light is asked; filled as they are described."""
    told: list[Burr] = []

    def described(*args: Any, **kwargs: Any) -> Burr | None:
        burr = describe(*args, **kwargs)
        if burr is not None:
            told.append(burr)
        return burr

    monkeypatch.setattr(residual, "describe", described)
    return told


def test_verdict_area_and_volume_are_those_of_the_height_that_is_stated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A low measured edge of a burr that is mostly dark: its fitted height was judged, another was stated."""
    scene = Scene()
    scene.log_light[scene.band(20.0, 4.4, -15.0, 12.0)] -= 1.1
    scene.lift_mm[scene.band(20.0, 4.4, -15.0, 12.0)] += 0.15
    scene.lost |= scene.band(20.0, 2.4, -15.0, 12.0)
    (low,) = burrs_of(scene, seen=False)
    told = depth_alone(monkeypatch)
    (burr,) = burrs_of(scene, seen=True, limit_mm=1.5 * low.height_mm.value)
    assert burr.height_mm.value > 1.5 * low.height_mm.value
    assert burr.within_limit is False
    (fitted,) = told
    grown = burr.height_mm.value / fitted.height_mm.value
    assert grown != pytest.approx(1.0, abs=0.05)
    assert burr.area_mm2.value == pytest.approx(grown * fitted.area_mm2.value)
    assert burr.volume_mm3.value == pytest.approx(grown * fitted.volume_mm3.value)


def test_the_most_significant_comes_first_whatever_told_it() -> None:
    scene = Scene()
    dark_line(scene)
    scene.lost |= scene.band(20.0, 3.0, -15.0, 12.0)
    scene.lift_mm[scene.band(-15.0, 2.0, -2.0, 2.0)] += 0.3
    told = [burr.significance for burr in burrs_of(scene, seen=True)]
    assert len(told) == 2
    assert told == sorted(told, reverse=True)


def test_a_small_place_beside_a_burr_that_a_large_one_confirmed_takes_nothing_from_it() -> None:
    """A ridge's mirror image beside it: fewer cells, below the surface, and near enough to belong to it."""
    scene = Scene()
    scene.log_light[scene.band(20.0, 3.0, -15.0, 12.0)] -= 1.1
    scene.lift_mm[scene.band(20.0, 3.0, -15.0, 12.0)] += 0.8
    beside = scene.band(24.2, 1.6, -8.0, 8.0)
    scene.log_light[beside] += 0.9
    scene.lift_mm[beside] -= 0.5
    (alone,) = burrs_of(scene, seen=False)[:1]
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == alone.side == "protrusion"
    assert burr.length_mm.value == pytest.approx(27.0, abs=3.0)


@pytest.mark.parametrize(
    ("above", "below", "other", "kept"),
    [(34, 34, 4.0, True), (36, 32, 4.0, True), (50, 18, 4.0, False), (34, 34, 140.0, False)],
)
def test_what_the_light_leaves_open_the_depth_decides(
    above: int, below: int, other: float, *, kept: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A nick of matt paint 225 sigma deep was called a ridge, for as many of its cells lay above as below.

    Where the depth shows both sides, as flanks do that mirror the wheel, it does not decide.
    """
    monkeypatch.setattr(residual, "belongs", lambda *_: True)
    monkeypatch.setattr(residual, "share_of", lambda *_: 1.0)
    monkeypatch.setattr(residual, "doubted", lambda burr, *_: burr)
    seen, on = SimpleNamespace(), np.zeros(0, int)
    nick = residual._Certain(seen, SimpleNamespace(sign=-1), 225.0, on)  # type: ignore[arg-type]
    halo = residual._Certain(seen, SimpleNamespace(sign=1), other, on)  # type: ignore[arg-type]
    place = Place(np.ones((2, 2), bool), above, below, 0, 1.0)
    unused: Any = SimpleNamespace()
    certain, dark = residual._told_by_light([halo, nick], [], [place], unused, unused)
    assert [one.burr for one in certain] == [(nick if kept else halo).burr]
    assert certain[0].place is place
    assert dark == []
    assert residual._told_by_light([], [], [place], unused, unused) == ([], [place])


@pytest.mark.parametrize(
    ("above", "below", "other", "side"),
    [(35, 33, 0.5, -1), (35, 33, 2.5, 1), (60, 8, 0.5, 1), (20, 48, 2.5, -1)],
)
def test_what_nobody_is_sure_of_a_faint_depth_decides(
    above: int, below: int, other: float, side: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Five nicks of 0.5 mm whose walls mirror each other were called ridges, for nothing told their side.

    The light has the first say, and a depth that shows both sides has none.
    """
    monkeypatch.setattr(residual, "belongs", lambda *_: True)
    seen, on = SimpleNamespace(), np.zeros(0, int)
    nick = residual._Certain(seen, SimpleNamespace(sign=-1), 2.9, on)  # type: ignore[arg-type]
    halo = residual._Certain(seen, SimpleNamespace(sign=1), other, on)  # type: ignore[arg-type]
    place = Place(np.ones((2, 2), bool), above, below, 0, 1.0)
    unused: Any = SimpleNamespace()
    certain, (dark,) = residual._told_by_light([], [nick, halo], [place], unused, unused)
    assert certain == []
    assert dark.side == side


def test_a_deep_nick_is_as_unsure_as_its_walls_light_each_other(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene()
    cells = scene.band(0.0, 5.0, -15.0, 12.0)
    scene.lift_mm[cells] -= 3.0 * (1.0 - np.abs(scene.around[cells]) / 2.5)
    told = depth_alone(monkeypatch)
    (plain,), (burr,) = (burrs_of(scene, seen=seen) for seen in (False, True))
    (of_many,) = burrs_of(scene, seen=True, several_views=True)
    assert of_many.height_mm == burr.height_mm
    assert burr.side == plain.side == "nick"
    assert walls_share(burr) > 0.2
    assert plain.height_mm.value == pytest.approx(3.0, rel=0.01)
    assert burr.height_mm.value == pytest.approx(3.0, rel=0.03)  # its pixels are points, and not means
    assert burr.height_mm.value == told[1].height_mm.value  # light leaves the depth's own as it is
    assert burr.height_mm.sigma > walls_share(burr) * burr.height_mm.value
    assert plain.height_mm.sigma < 0.5 * burr.height_mm.sigma


def test_so_is_a_nick_that_the_light_alone_tells(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = Scene()
    dark_line(scene)
    scene.lost |= scene.band(20.0, 3.0, -15.0, 12.0)
    (ridge,) = burrs_of(scene, seen=True)
    stated = Value(2.0 * ridge.width_mm.value, 0.01)
    nick = replace(ridge, side="nick", height_mm=stated)
    monkeypatch.setattr(residual, "called", lambda *_: nick)
    for shines, scattered in ((0.0, 1.0), (0.6, 0.8), (1.0, 0.0)):  # what is told knows what is mirrored
        monkeypatch.setattr(residual, "mirrored", lambda *_, shines=shines: shines)
        (burr,) = burrs_of(scene, seen=True)
        assert burr.height_mm.value == stated.value
        walls = scattered * walls_share(nick) * stated.value
        assert burr.height_mm.sigma == pytest.approx(np.hypot(stated.sigma, walls), rel=0.01)


def test_walls_that_mirror_each_other_leave_a_depth_unsure_before_the_light_is_asked(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Of 53 nicks on rendered metal depths were half as high again as the nick, the light's a tenth less."""
    scene = Scene()
    cells = scene.band(0.0, 5.0, -15.0, 12.0)
    scene.lift_mm[cells] -= 3.0 * (1.0 - np.abs(scene.around[cells]) / 2.5)
    asked: list[Burr] = []
    told_by_light = residual._told_by_light

    def spied(certain: Any, *rest: Any) -> Any:
        asked.append(certain[0].burr)
        return told_by_light(certain, *rest)

    monkeypatch.setattr(residual, "_told_by_light", spied)
    for shines in (0.0, 0.9):
        monkeypatch.setattr(residual, "mirrored", lambda *_, shines=shines: shines)
        burrs_of(scene, seen=True)
    plain, mirroring = (burr.height_mm for burr in asked)
    assert mirroring.value == plain.value
    share = 0.9 * np.hypot(MIRRORED, walls_share(asked[1]))
    assert share > 0.25
    assert mirroring.sigma == pytest.approx(np.hypot(plain.sigma, share * plain.value))


def test_what_may_be_a_scratch_is_left_to_other_views_where_there_are_some(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[bool] = []

    def spied(*given: Any, scratches: bool, **options: Any) -> Any:
        asked.append(scratches)
        return disturbed(*given, scratches=scratches, **options)

    monkeypatch.setattr(residual, "disturbed", spied)
    scene = Scene()
    across = scene.around - 0.3 * scene.along
    cells = scene.on & (np.abs(across) < 0.75) & (np.abs(scene.along) < 20.0)
    scene.log_light[cells] += np.log(4.0)
    scene.lift_mm[cells] += 0.6 * np.sign(across[cells])
    assert burrs_of(scene, seen=True) == ()
    assert len(burrs_of(scene, seen=True, several_views=True)) == 1
    assert asked == [False, True]


def test_a_place_most_of_which_has_no_depth_is_no_edge_of_brightness() -> None:
    """No scratch hides so much; polished ridges were dropped as one."""
    scene = Scene()
    mostly_dark(scene)
    assert burrs_of(scene, seen=False) == ()
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "protrusion"
    assert abs(turned(burr.angle_deg.value - angle_at(scene, 20.0, -1.5))) < 1.0


def test_a_stump_that_depth_shows_is_not_all_that_stands_there() -> None:
    """Of a ground ridge the depth was sure of the last 0.7 mm alone, and the light's 13 mm were lost."""
    scene = Scene()
    mostly_dark(scene)
    end = scene.band(20.0, 4.4, 7.0, 12.0)
    scene.lost &= ~end
    scene.lift_mm[end] = 0.5
    (stump,) = burrs_of(scene, seen=False)
    assert stump.length_mm.value < 8.0
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "protrusion"
    assert burr.length_mm.value == pytest.approx(27.0, abs=3.0)


def test_walls_that_mirror_each_other_show_two_depths_at_one_place() -> None:
    """A nick on turned copper, 0.65 mm deep: one ridge explains 0.43 of it, and a mesh's would be none."""
    scene = Scene()
    cells = scene.band(20.0, 4.4, -15.0, 12.0)
    twice = np.random.default_rng(1).random(cells.shape) < 0.2
    scene.lift_mm[cells] -= np.where(twice[cells], 2.0, 0.3)
    assert burrs_of(scene, seen=False) == ()
    (burr,) = burrs_of(scene, seen=True)
    assert burr.side == "nick"
    assert abs(turned(burr.angle_deg.value - angle_at(scene, 20.0, -1.5))) < 0.5
