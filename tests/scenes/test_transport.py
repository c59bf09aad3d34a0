"""The traced transport against stock Mitsuba and against plain numpy."""

import os
import time
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy import stats
from scipy.ndimage import binary_erosion

from burrscan.arrays import Floats, Ints
from burrscan.errors import InputError
from scenes.rig import RigSpec
from scenes.transport.footprint import sample_sets
from scenes.transport.hits import centre_hits
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics
from scenes.transport.profile import PixelProfile
from scenes.transport.refine import needed_samples
from scenes.transport.rows import SparseRows, added, empty_rows
from scenes.transport.splat import splat
from scenes.transport.stock import stock_ambient, stock_image
from scenes.transport.store import stored
from scenes.transport.trace import trace
from scenes.transport.world import wheel_mesh
from scenes.wheel import Wheel, build_wheel, load_wheel
from tests.data.stock import kept_blocks
from tests.scenes.pulley import FINISHES, RUNS, blocks, bsdf, patterns, pose, pulley, stripes_on, uneven
from tests.tiers import some_of


@pytest.fixture(scope="module")
def wheel() -> Wheel:
    return pulley()


@pytest.mark.parametrize("dimensions", [2, 6])
def test_sample_sets_are_centred_and_uniform(dimensions: int) -> None:
    sets = sample_sets(sets=512, samples=16, seed=3, dimensions=dimensions)
    assert np.abs(sets.mean(axis=1) - 0.5).max() < 1e-6
    for axis in range(dimensions):
        assert stats.kstest(sets[:, 0, axis], "uniform").pvalue > 1e-3
    with pytest.raises(InputError, match="power of two"):
        sample_sets(sets=1, samples=12, seed=0)


@pytest.mark.parametrize("profile", [PixelProfile(), PixelProfile(fill=0.8, blur_px=0.5)])
def test_splat_equals_a_dense_matrix(profile: PixelProfile) -> None:
    rng = np.random.default_rng(0)
    shape, pixels = (9, 11), 40
    offsets = np.concatenate([[0], np.cumsum(rng.integers(0, 30, pixels))])
    u = rng.uniform(-1.0, 11.0, offsets[-1]).astype(np.float32)
    v = rng.uniform(-1.0, 9.0, offsets[-1]).astype(np.float32)
    w = (rng.random(offsets[-1]) * (rng.random(offsets[-1]) > 0.3)).astype(np.float32)
    starts, columns, values = splat(u, v, w, offsets, shape=shape, profile=profile)
    got = np.zeros((pixels, *shape))
    for pixel in range(pixels):
        row = slice(starts[pixel], starts[pixel + 1])
        assert len(np.unique(columns[row])) == len(columns[row])
        got[pixel].flat[columns[row]] = values[row]
    fine = np.linspace(-0.5, 0.5, 20001) * profile.blur_px

    def light(x: float, n: int) -> Floats:
        near = np.abs(x + fine[None, :] - np.arange(n)[:, None]) <= 0.5 * profile.fill
        return np.asarray(near.mean(axis=1) / profile.fill)

    want = np.zeros_like(got)
    for pixel in range(pixels):
        for s in range(offsets[pixel], offsets[pixel + 1]):
            want[pixel] += w[s] * np.outer(light(v[s], shape[0]), light(u[s], shape[1]))
    assert np.abs(got - want).max() < 2e-3


def test_relighting_is_the_matrix_product() -> None:
    rng = np.random.default_rng(2)
    dense = rng.random((12, 20)) * (rng.random((12, 20)) > 0.6)
    rows = SparseRows(
        np.concatenate([[0], np.cumsum((dense > 0).sum(axis=1))]),
        np.nonzero(dense)[1].astype(np.int32),
        dense[dense > 0].astype(np.float32),
    )
    image = np.zeros((3, 4), np.float32)
    transport = LightTransport((3, 4), (4, 5), rows, empty_rows(12), image, image, image, image, image)
    light = rng.random((7, 4, 5)).astype(np.float32)
    assert transport.relight(light).reshape(7, 12) == pytest.approx(light.reshape(7, 20) @ dense.T, rel=1e-5)
    columns = np.broadcast_to(light[:, :1], light.shape)
    assert transport.relight(columns) == pytest.approx(transport.relight(columns.copy()), rel=1e-6)


@some_of("finish", sorted(FINISHES))
def test_agrees_with_stock_mitsuba(mi: Any, finish: str) -> None:
    """Every block of every pattern of direct light, z-tested with Bonferroni's correction at 99.9 % in all.

    Interreflected light has tails that no t-test of blocks expects: it is compared pixel by pixel in
    ``test_interreflection.py``, and here as the sum over the picture, of every pattern.
    """
    scene, optics, light = stripes_on(mi, finish)[1:]
    known = kept_blocks(finish)
    direct = [trace(mi, scene, optics, samples=4, bounces=1, seed=i).relight(light) for i in range(RUNS)]
    ours = blocks(np.stack(direct))
    variance = ours.var(axis=0, ddof=1) / RUNS + known.variance
    lit = known.mean > 1e-4
    t = (ours.mean(axis=0) - known.mean)[lit] / np.sqrt(variance[lit])
    limit = stats.t.isf(0.0005 / t.size, RUNS - 1)  # the fewest degrees of freedom that Welch's test can have
    assert lit.sum() > 100
    assert np.abs(t).max() < limit
    # one of ours is known to a thousandth, the reference with 192 paths a pixel to two or three
    whole = trace(mi, scene, optics).relight(light).mean(axis=(1, 2))
    assert whole == pytest.approx(known.whole, rel=0.005)


def test_a_shifted_projector_is_noticed(mi: Any, wheel: Wheel) -> None:
    """The z-test above has teeth: half a projector pixel of shift breaks it."""
    spec = RigSpec(scale=0.1875)
    optics = uneven(spec)
    shifted = replace(
        optics,
        rig=replace(optics.rig, projector=replace(optics.rig.projector, cx=optics.rig.projector.cx + 0.5)),
    )
    scene = mi.load_dict({"type": "scene", "wheel": wheel_mesh(mi, wheel, pose(spec), bsdf("ground"))})
    light = patterns(optics.rig.projector)[1:2]
    runs = 6
    a, b = (
        blocks(np.stack([trace(mi, scene, o, bounces=1, seed=i).relight(light) for i in range(runs)]))
        for o in (optics, shifted)
    )
    variance = (a.var(axis=0, ddof=1) + b.var(axis=0, ddof=1)) / runs
    lit = b.mean(axis=0) > 1e-3
    assert np.abs((a - b).mean(axis=0)[lit] / np.sqrt(variance[lit])).max() > 20.0


def test_most_paths_are_a_power_of_two(mi: Any) -> None:
    spec = RigSpec(scale=0.125)
    with pytest.raises(InputError, match="power of two"):
        trace(mi, None, uneven(spec), most=100)


def test_paths_are_asked_for_in_whole_nets_and_never_too_many() -> None:
    """A power of two, and at most the most."""
    rng = np.random.default_rng(0)
    shape, seen = (40, 50), np.ones((40, 50), np.bool_)
    variance = 1e-4 * np.exp2(np.arange(50) * 0.35 + np.zeros(shape))
    refined = rng.choice([0, 64], size=shape)
    for most in (64, 128, 1024):
        need = needed_samples(
            variance,
            direct=np.ones((3, *shape)),
            indirect=np.ones((3, *shape)),
            refined=refined,
            pilot=16,
            seen=seen,
            error=0.02,
            most=most,
            paths=1 << 30,
        )
        asked = need[need > 0]
        assert asked.size > 50
        assert (asked & (asked - 1) == 0).all()
        assert asked.max() <= most
    assert np.unique(asked).tolist() == [32, 64, 128, 256, 512, 1024]


def test_all_paths_together_are_bounded_by_what_the_dearest_pixels_get() -> None:
    """Whole nets still; pixels that need little keep them all, unless even the least is too much."""
    shape, seen = (40, 50), np.ones((40, 50), np.bool_)
    variance = 1e-4 * np.exp2(np.arange(50) * 0.35 + np.zeros(shape))

    def need(paths: int) -> Ints:
        return needed_samples(
            variance,
            direct=np.ones((3, *shape)),
            indirect=np.ones((3, *shape)),
            refined=np.zeros(shape, np.int64),
            pilot=16,
            seen=seen,
            error=0.02,
            most=1024,
            paths=paths,
        )

    free = need(1 << 30)
    for share in (0.9, 0.5, 0.2):
        bounded = need(int(share * free.sum()))
        most = int(bounded.max())
        assert 0.2 * share * free.sum() < bounded.sum() <= share * free.sum()
        assert np.array_equal(bounded, np.minimum(free, most))
        assert most & (most - 1) == 0
        assert np.minimum(free, 2 * most).sum() > share * free.sum()
    assert np.array_equal(need(1) > 0, free > 0)
    assert need(1).max() == 32


def test_where_stripes_cancel_more_paths_are_asked_for() -> None:
    """Pixels alike under white, whose light goes with stripes to all, a quarter and nothing of it."""
    shape, seen = (30, 30), np.ones((30, 30), np.bool_)
    share = np.repeat([1.0, 0.25, 0.0], 10)[None] * np.ones(shape)
    light = np.stack([np.ones(shape), 0.6 * share, -0.8 * share])
    need = needed_samples(
        np.full(shape, 0.25),
        direct=0.5 * light,
        indirect=0.5 * light,
        refined=np.zeros(shape, np.int64),
        pilot=16,
        seen=seen,
        error=0.02,
        most=4096,
        paths=1 << 30,
    )
    middles = need[15, [4, 14, 25]]
    # the error allowed falls as the root of the share, at most to a tenth's; paths grow as its power -1/0.6
    assert middles[1] / middles[0] == pytest.approx(2.0 ** (1.0 / 0.6), rel=0.3)
    assert middles[2] / middles[0] == pytest.approx(10.0 ** (0.5 / 0.6), rel=0.3)


def test_rows_are_added_by_their_share() -> None:
    one = SparseRows(np.array([0, 2, 3]), np.array([1, 4, 2], np.int32), np.array([1, 2, 3], np.float32))
    two = SparseRows(np.array([0, 1, 2]), np.array([4, 0], np.int32), np.array([8, 16], np.float32))
    rows = added(
        [(np.array([5, 1]), one, np.array([0.25, 0.0])), (np.array([1, 5]), two, np.array([1.0, 0.75]))], 7
    )
    dense = np.zeros((7, 5))
    np.add.at(dense, (np.repeat(np.arange(7), np.diff(rows.starts)), rows.columns), rows.values)
    expected = np.zeros((7, 5))
    expected[5, [1, 4, 0]] = 0.25, 0.5, 12.0
    expected[1, 4] = 8.0
    assert np.array_equal(dense, expected)
    assert len(rows.values) == 4


@pytest.mark.study
@pytest.mark.parametrize(
    ("bounces", "settings"),
    [
        pytest.param(3, ({"most": 64}, {"most": 128}, {"samples": 64}), marks=pytest.mark.study),
        (2, ({},)),
        pytest.param(4, ({},), marks=pytest.mark.study),
    ],
)
def test_other_numbers_of_paths_and_bounces_agree(
    mi: Any, wheel: Wheel, bounces: int, settings: tuple[dict[str, int], ...]
) -> None:
    """The sum of all light by other settings is that of many pilot paths alone, which know no aim."""
    optics = uneven(RigSpec(scale=0.125))
    mesh = wheel_mesh(mi, wheel, pose(RigSpec(scale=0.125)), bsdf("ground"))
    scene = mi.load_dict({"type": "scene", "wheel": mesh})
    many = trace(mi, scene, optics, seed=4, error=np.inf, samples=1024, bounces=bounces)
    for given in settings:
        ours = trace(mi, scene, optics, seed=3, bounces=bounces, **given)
        sigma = np.sqrt((ours.indirect_sigma**2).sum() + (many.indirect_sigma**2).sum())
        assert abs(ours.white_indirect.sum() - many.white_indirect.sum()) < 4.0 * sigma, given
        assert sigma < 0.02 * many.white_indirect.sum(), given


def test_same_seed_same_bits(mi: Any, wheel: Wheel) -> None:
    spec = RigSpec(scale=0.0625)
    optics = uneven(spec)
    scene = mi.load_dict({"type": "scene", "wheel": wheel_mesh(mi, wheel, pose(spec), bsdf("ground"))})
    one, two = (trace(mi, scene, optics, seed=5) for _ in range(2))
    assert np.array_equal(one.direct.values, two.direct.values)
    assert np.array_equal(one.indirect.values, two.indirect.values)
    assert np.array_equal(one.indirect_sigma, two.indirect_sigma)


def test_footprint_noise_is_a_hundredth_of_a_pixel(mi: Any) -> None:
    """What 16 samples leave of noise in the response-weighted coordinate, against 128 samples."""
    wheel = build_wheel(load_wheel("cylinder"), (), facet_error_mm=0.005)
    spec = RigSpec(scale=0.25)
    optics = uneven(spec)
    scene = mi.load_dict({"type": "scene", "wheel": wheel_mesh(mi, wheel, pose(spec), bsdf("ground"))})
    few = trace(mi, scene, optics, samples=16, bounces=1, seed=1)
    many = trace(mi, scene, optics, samples=128, bounces=1, seed=2)
    whole = (many.spread_px < 0.5) & (few.spread_px < 0.5)
    inner = binary_erosion(
        whole, np.ones((3, 3), np.bool_)
    )  # creases and silhouettes cut footprints: no one place there
    error = np.abs(few.u_px - many.u_px)
    assert inner.sum() > 5000
    assert np.median(error[inner]) < 0.001
    assert np.sqrt(np.mean(error[inner] ** 2)) < 0.01


def test_distorted_rays_meet_their_pixels(mi: Any, wheel: Wheel) -> None:
    """With distortion and 2 samples the mean projector coordinate is where View says it is."""
    spec = RigSpec(scale=0.25)
    rig = spec.rig()
    bent = (-0.12, 0.3, 1e-3, -2e-3, 0.1)
    optics = Optics(
        replace(
            rig,
            camera=replace(rig.camera, distortion=bent),
            projector=replace(rig.projector, distortion=bent),
        ),
        spec.standoff_mm,
    )
    scene = mi.load_dict({"type": "scene", "wheel": wheel_mesh(mi, wheel, pose(spec), bsdf("ground"))})
    traced = trace(mi, scene, optics, samples=64, bounces=1)
    hits = centre_hits(mi, scene, optics)
    expected = optics.rig.correspond(hits.points_mm)
    flat = traced.spread_px < 0.4
    error = np.stack([traced.u_px, traced.v_px], axis=-1)[flat] - expected[flat]
    assert flat.sum() > 3000
    assert np.nanmedian(np.abs(error)) < 0.01


@pytest.mark.study
def test_ambient_agrees_with_stock(mi: Any, wheel: Wheel) -> None:
    spec = RigSpec(scale=0.125)
    optics = uneven(spec)
    mesh = wheel_mesh(mi, wheel, pose(spec), bsdf("ground"))
    scene = mi.load_dict({"type": "scene", "wheel": mesh})
    ours = trace(mi, scene, optics, samples=256).ambient.mean()
    assert ours == pytest.approx(stock_ambient(mi, mesh, optics, samples=256, bounces=2).mean(), rel=0.01)


def test_stored_transport_is_the_same_and_a_damaged_one_is_made_again(tmp_path: Any) -> None:
    rows = SparseRows(np.array([0, 1]), np.array([3], np.int32), np.array([0.5], np.float32))
    image = np.zeros((1, 1), np.float32)
    made: list[int] = []

    def make() -> LightTransport:
        made.append(1)
        return LightTransport((1, 1), (2, 2), rows, empty_rows(1), image, image, image, image, image)

    first = stored(tmp_path, "key", make)
    again = stored(tmp_path, "key", make)
    assert len(made) == 1
    assert np.array_equal(first.direct.values, again.direct.values)
    next(tmp_path.iterdir()).write_bytes(b"broken")
    stored(tmp_path, "key", make)
    assert len(made) == 2


def test_a_full_store_forgets_what_was_used_longest_ago(tmp_path: Any) -> None:
    rows = SparseRows(np.array([0, 1]), np.array([3], np.int32), np.array([0.5], np.float32))
    image = np.zeros((64, 64), np.float32)
    transport = LightTransport((64, 64), (2, 2), rows, empty_rows(4096), image, image, image, image, image)
    for age, key in ((30, "a"), (20, "b"), (10, "c")):
        stored(tmp_path, key, lambda: transport)
        path = next(tmp_path.glob(f"*-{key}.npz"))
        os.utime(path, (time.time() - age, time.time() - age))
    stored(tmp_path, "a", lambda: transport)  # used again: now the youngest
    size = path.stat().st_size
    stored(tmp_path, "d", lambda: transport, limit_bytes=int(2.5 * size))
    left = {path.name.split("-")[-1].removesuffix(".npz") for path in tmp_path.iterdir()}
    assert left == {"a", "d"}


def test_a_store_that_cannot_be_written_costs_nothing_but_time(tmp_path: Any) -> None:
    (tmp_path / "file").write_text("not a folder")
    rows = SparseRows(np.array([0, 1]), np.array([3], np.int32), np.array([0.5], np.float32))
    image = np.zeros((1, 1), np.float32)
    transport = LightTransport((1, 1), (2, 2), rows, empty_rows(1), image, image, image, image, image)
    assert stored(tmp_path / "file", "key", lambda: transport) is transport


def test_stock_refuses_what_it_cannot_render(mi: Any) -> None:
    spec = RigSpec()
    optics = Optics(spec.rig(), 600.0, profile=PixelProfile(fill=0.9))
    with pytest.raises(InputError, match="pixel gap"):
        stock_image(mi, None, optics, np.ones(optics.rig.projector.shape, np.float32))
