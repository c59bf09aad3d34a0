"""Dense, noisy sectors of a scan: aligned within what is stated, or refused with the reason."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.registration import Alignment, PosedSurface, align, refuse_doubtful
from burrscan.registration.averaged import averaged
from burrscan.registration.scale import scale_of
from burrscan.registration.solve import Step, solve
from tests.burrscan.registration.sectors import OVERLAP, TURNS, pawn, sector
from tests.burrscan.registration.views import true_pose
from tests.tiers import some_of


def errors(found: Alignment, turns: tuple[float, ...] = TURNS) -> Floats:
    """(N-1, 6) rotation vector in rad and translation at the part's middle, mm, against the first view."""
    off = [found.T_world_camera[n] @ np.linalg.inv(true_pose(turn)) for n, turn in enumerate(turns)]
    relative = [np.linalg.inv(off[0]) @ one for one in off[1:]]
    return np.array([[*Rotation.from_matrix(m[:3, :3]).as_rotvec(), *m[:3, 3]] for m in relative])


def pulls(found: Alignment) -> Floats:
    return errors(found) / np.sqrt(np.diagonal(found.covariance[1:], axis1=1, axis2=2))


def sectors(seed: int, turns: tuple[float, ...] = TURNS, **options: object) -> list[PosedSurface]:
    rng = np.random.default_rng(seed)
    return [sector(turn, rng, **options) for turn in turns]  # type: ignore[arg-type]


@some_of(
    ("shape", "noise_mm", "spacing_mm", "gridded", "half_mm"),
    [
        # triangles folded over: twice as noisy as they are long
        pytest.param("pawn", 0.1, 0.05, True, 12.0, marks=pytest.mark.study),
        ("pawn", 0.1, 0.1, False, 20.0),
        pytest.param("pawn", 0.02, 0.1, True, 20.0, marks=pytest.mark.study),
        pytest.param("wheel", 0.1, 0.3, False, 20.0, marks=pytest.mark.study),
        ("wheel", 0.02, 1.0, True, 20.0),
    ],
)
def test_four_sectors_that_overlap_by_a_third_are_put_where_they_were(
    shape: str, noise_mm: float, spacing_mm: float, gridded: int, half_mm: float
) -> None:
    """No sigma is stated. Errors within 6 sigma: blurred edges of bosses err up to twice what is stated."""
    views = sectors(
        1, shape=shape, noise_mm=noise_mm, spacing_mm=spacing_mm, gridded=bool(gridded), half_mm=half_mm
    )
    found = align(views)
    assert found.doubts == ()
    refuse_doubtful(found)
    np.testing.assert_allclose(found.noise_mm, noise_mm, rtol=0.1)
    neighbours = [found.overlap[n, (n + side) % 4] for n in range(4) for side in (1, 3)]
    np.testing.assert_allclose(neighbours, OVERLAP, atol=0.04)
    assert found.overlap[0, 2] == 0.0
    assert 0.75 * found.floor_mm < found.rms_mm < 1.5 * found.floor_mm
    assert np.abs(pulls(found)).max() < 6.0
    stated = np.sqrt(np.diagonal(found.covariance[1:], axis1=1, axis2=2))
    assert stated[:, 3:].max() < 0.2 * 0.5  # the robot's word is 0.5 mm
    assert not any(motion.kind == "shift" for motions in found.free for motion in motions)


@pytest.mark.study
def test_the_stated_covariance_of_dense_round_sectors_is_that_of_the_errors() -> None:
    """Mean squared pull of 6 × 18 values: 1 within 4.5 of its sigma."""
    square = np.square([pulls(align(sectors(seed, bosses=False, spacing_mm=0.15))) for seed in range(6)])
    assert abs(square.mean() - 1.0) < 4.5 * np.sqrt(2.0 / square.size)


@pytest.mark.parametrize(
    ("shape", "spacing_mm", "noise_mm"),
    [("pawn", 0.15, 0.1), pytest.param("wheel", 0.3, 0.02, marks=pytest.mark.study)],
)
def test_a_round_part_names_the_turn_that_it_leaves_open(
    shape: str, spacing_mm: float, noise_mm: float
) -> None:
    """The wheel has 50 mm of lever for noise in its normals, which feigns to know the turn."""
    found = align(sectors(2, shape=shape, bosses=False, spacing_mm=spacing_mm, noise_mm=noise_mm))
    assert found.doubts == ()
    for motions in (found.free[1], found.free[3]):
        (turn,) = motions
        assert turn.kind == "turn"
        assert turn.direction[2] > 0.999
        x, y, z = turn.point_mm
        assert np.hypot(x, y) < 1.0 + 0.02 * abs(z)
        assert 0.5 * 0.2 < turn.sigma < np.sqrt(2.0) * 0.2
        assert str(turn).startswith("turn about (")


@pytest.mark.study
def test_bosses_hold_the_turn() -> None:
    assert align(sectors(2, shape="wheel", spacing_mm=0.4)).free[1] == ()


@pytest.mark.study
def test_noise_is_measured_at_any_spacing() -> None:
    """From a fifth of the noise to fifty times of it, within a tenth; a surface without noise has none."""
    for noise, spacing, half in ((0.1, 0.02, 4.0), (0.1, 0.1, 20.0), (0.02, 0.3, 20.0), (0.02, 1.0, 20.0)):
        for gridded in (True, False):
            view = sector(
                0.0,
                np.random.default_rng(0),
                shape="wheel" if spacing > 0.1 else "pawn",
                noise_mm=noise,
                spacing_mm=spacing,
                half_mm=half,
                gridded=gridded,
            )
            told = scale_of(view.vertices_mm, cKDTree(view.vertices_mm), np.random.default_rng(1))
            assert told.noise_mm == pytest.approx(noise, rel=0.1)
            assert told.working_mm >= max(6.0 * told.noise_mm, told.pitch_mm)
    view = sector(0.0, np.random.default_rng(0), noise_mm=0.0, spacing_mm=0.2)
    told = scale_of(view.vertices_mm, cKDTree(view.vertices_mm), np.random.default_rng(1))
    assert told.noise_mm < 1e-3
    assert told.pitch_mm == pytest.approx(0.2, rel=0.2)


def test_averages_lie_on_the_surface() -> None:
    """Off the true radius by what is stated of them, and not to one side: 5 sigma of the mean."""
    rng = np.random.default_rng(0)
    view = sector(0.0, rng, bosses=False, spacing_mm=0.1, noise_mm=0.1, gridded=False)
    told = scale_of(view.vertices_mm, cKDTree(view.vertices_mm), rng)
    sigma = np.full(len(view.vertices_mm), 0.1)
    means = averaged(view.vertices_mm, sigma, view.faces, pitch_mm=told.pitch_mm, working_mm=told.working_mm)
    assert means.count.sum() == len(view.vertices_mm)
    assert len(means.points_mm) < len(view.vertices_mm) / 10
    pose = true_pose(0.0)
    x, y, z = (means.points_mm @ pose[:3, :3].T + pose[:3, 3]).T
    straight = (np.abs(z) < 19.0) & (
        np.abs(np.gradient(pawn(np.linspace(-20, 20, 4001)), 0.01))[
            np.clip(((z + 20.0) / 0.01).astype(int), 0, 4000)
        ]
        < 0.2
    )
    off = (np.hypot(x, y) - pawn(z))[straight] / means.sigma_mm[straight]
    assert np.std(off) == pytest.approx(1.0, abs=0.25)
    assert abs(off.mean()) < 0.5  # curvature: a few µm of sagitta


def test_sectors_that_share_too_little_are_refused() -> None:
    with pytest.raises(InputError, match=r"view 2 shares hardly any surface .* overlap by a third"):
        refuse_doubtful(align(sectors(3, (0.0, 139.0), spacing_mm=0.15)))


def test_views_of_two_parts_are_refused() -> None:
    """A part that shrank by two per cent: no pose brings its surface onto the other's."""
    one, other = sectors(4, (0.0, 40.0), shape="wheel", spacing_mm=0.4, noise_mm=0.02)
    middle = other.vertices_mm.mean(axis=0)
    bent = other.vertices_mm + 0.4 * np.sin(0.5 * (other.vertices_mm - middle))
    with pytest.raises(InputError, match=r"apart where they overlap, and noise explains .* same part"):
        refuse_doubtful(align([one, replace(other, vertices_mm=bent)]))


def test_an_error_that_grew_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """A search that walks the wrong way, as one may that started in another basin."""

    def wrong(*given: object, **options: object) -> Step:
        step = solve(*given, **options)  # type: ignore[arg-type]
        return step._replace(twists=-0.5 * step.twists)

    monkeypatch.setattr(sys.modules["burrscan.registration.align"], "solve", wrong)
    found = align(sectors(5, (0.0, 60.0), spacing_mm=0.15, noise_mm=0.02), most_iterations=4)
    assert any("grew from" in doubt for doubt in found.doubts)
    with pytest.raises(InputError, match=r"grew from .* better rough poses"):
        refuse_doubtful(found)


def test_a_search_that_did_not_end_is_refused() -> None:
    with pytest.raises(InputError, match=r"still move by .* after 1 steps"):
        refuse_doubtful(align(sectors(6, (0.0, 60.0), spacing_mm=0.15, robot_deg=0.4), most_iterations=1))


def test_a_pose_far_from_what_the_robot_said_is_refused() -> None:
    """The rough poses are off by 0.5 mm and are stated to a fiftieth of it."""
    found = align(sectors(7, (0.0, 60.0), spacing_mm=0.2, robot_deg=0.01), sigma_mm=0.05, sigma_deg=0.01)
    with pytest.raises(InputError, match=r"standard deviations from its rough pose: .* larger sigma_mm"):
        refuse_doubtful(found)


def test_a_cloud_beside_a_mesh_is_aligned() -> None:
    views = sectors(8, spacing_mm=0.15, noise_mm=0.05)
    views[1] = replace(views[1], faces=np.zeros((0, 3), np.int32))
    found = align(views)
    assert found.doubts == ()
    assert np.abs(pulls(found)).max() < 6.0
