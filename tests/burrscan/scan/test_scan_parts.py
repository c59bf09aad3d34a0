"""The adaptive scan's parts, each against a truth of its own."""

import numpy as np
import pytest

from burrscan.arrays import Bools, Floats
from burrscan.codes.code import patterns
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import NO_DISTORTION
from burrscan.scan.exposure import Response
from burrscan.scan.fill_columns import fill_columns
from burrscan.scan.intensity import intensities
from burrscan.scan.known_light import light_bias_px
from burrscan.scan.matching.epipolar import epipolar_nodes
from burrscan.scan.matching.matched import Reading, read
from burrscan.scan.plan import plan_exposures_ms
from burrscan.scan.rounds import left
from burrscan.scan.stripes import side_lobe, stripes
from burrscan.scan.validity.consistency import consistent
from burrscan.scan.validity.interreflection_sigma import interreflection_sigma_px
from burrscan.scan.validity.mixed_pixels import mixed_pixels
from burrscan.triangulation import camera_rays
from tests.burrscan.instrument import Instrument, plane_depth, small_rig

LENS = (-0.12, 0.03, 0.001, -0.0005, 0.01)
CODE = stripes(9, width=128)


def look(instrument: Instrument, intensity: Floats | None = None, exposure_ms: float = 10.0) -> Reading:
    rig = instrument.rig
    shown = patterns(
        CODE.frames(rig.projector.shape),
        CODE.names,
        view=rig.projector,
        sheet=instrument.projector,
        intensity=intensity,
    )
    images = instrument.capture(shown, exposure_ms)
    dark = instrument.response * 1e-3 + instrument.ambient_e_per_ms
    reading = read(
        images, CODE, camera=instrument.camera, rig=rig, dark_e=(exposure_ms * dark).astype(np.float32)
    )
    reading = reading.blanked(max_sigma_px=0.35)
    reading = reading.without(mixed_pixels(reading, images, CODE, camera=instrument.camera))
    gain = instrument.response.astype(np.float32)
    sharp = np.zeros_like(gain)
    bias = light_bias_px(
        reading.u_px, reading.v_px, gain, shown, CODE, sheet=instrument.projector, circles_px=sharp
    )
    return Reading(**{**vars(reading), "u_px": reading.u_px - bias})


def flat(**changes: object) -> Instrument:
    settings = {"depth": plane_depth, "decades": 0.0, "peak_e_per_ms": 800.0, "seed": 4, **changes}
    return Instrument(small_rig(width=160, distortion=settings.pop("lens", NO_DISTORTION)), **settings)  # type: ignore[arg-type]


def inside(found: Reading) -> Bools:
    """Pixels whose footprint the projector's border does not cut."""
    with np.errstate(invalid="ignore"):
        return np.asarray((np.abs(found.u_px - 63.5) < 58.0) & (np.abs(found.v_px - 47.5) < 42.0))


@pytest.mark.parametrize("width", [256, 1024, 1920])
@pytest.mark.parametrize("count", [7, 11])
def test_no_other_column_looks_alike(count: int, width: int) -> None:
    code = stripes(count, width=width)
    assert side_lobe(code.per_column, width=width) < 0.72
    assert abs((code.per_row * code.per_column).sum()) < 0.35 * np.abs(code.per_row * code.per_column).sum()


def test_stripes_are_light() -> None:
    frames = np.stack(list(CODE.frames((40, 60))))
    assert len(frames) == len(CODE) == len(set(CODE.names))
    assert frames.min() >= -1e-6
    assert frames.max() <= 1.0 + 1e-6
    np.testing.assert_allclose(frames.reshape(-1, 3, 40, 60).mean(axis=1), 0.5, atol=1e-5)


@pytest.mark.parametrize("lens", [NO_DISTORTION, LENS])
def test_truth_lies_on_the_epipolar_polyline(lens: tuple[float, float, float, float, float]) -> None:
    rig = small_rig(distortion=lens)
    rays = camera_rays(rig.camera)
    uv = rig.correspond(rays * plane_depth(rays)[..., None])
    nodes = epipolar_nodes(rig)
    for row, column in ((10, 20), (64, 80), (120, 150)):
        line = nodes[row, column]
        assert (np.diff(line[:, 0]) > 0.0).all()
        on_line = np.interp(uv[row, column, 0], line[:, 0], line[:, 1])
        assert abs(on_line - uv[row, column, 1]) < 0.3


@pytest.mark.parametrize("lens", [NO_DISTORTION, LENS])
def test_a_reading_is_exact_and_honest(lens: tuple[float, float, float, float, float]) -> None:
    instrument = flat(lens=lens)
    found = look(instrument)
    pulls = ((found.u_px - instrument.truth_u) / found.sigma_u_px)[inside(found)]
    assert len(pulls) > 0.4 * instrument.truth_u.size
    assert np.abs(pulls).max() < 8.0
    assert 0.9 < 1.4826 * np.median(np.abs(pulls)) < 1.1


def test_a_steep_intensity_leaves_no_bias() -> None:
    instrument = flat(noise=False)
    rows, columns = instrument.rig.projector.shape
    falling = np.exp(-0.06 * np.arange(columns)) * np.ones((rows, 1))
    found = look(instrument, np.maximum(falling, 0.02))
    bright = np.isfinite(found.u_px) & (found.u_px < 50.0)
    error = (found.u_px - instrument.truth_u)[bright]
    # six per cent per pixel would pull the centre by 0.06 var = 0.02 px
    assert abs(np.median(error)) < 0.003


def test_no_torn_footprint_is_accepted() -> None:
    def stepped(rays: Floats) -> Floats:
        return np.where(rays[..., 0] + 0.1 * rays[..., 1] > 0.0, 640.0, 600.0)

    instrument = flat(depth=stepped)
    found = look(instrument)
    known = np.isfinite(found.u_px)
    assert known.mean() > 0.5
    assert np.abs(found.u_px - instrument.truth_u)[known].max() < 1.0


def test_the_mean_row_is_free() -> None:
    found = look(flat())
    known = inside(found)
    off = found.off_line_px[known] / found.sigma_v_px[known]
    assert 0.85 < 1.4826 * np.median(np.abs(off)) < 1.3


def test_lone_outliers_go_and_edges_stay() -> None:
    u = np.tile(np.arange(40, dtype=np.float32), (30, 1))
    u[:, 20:] += 15.0
    u[10, 10] += 4.0
    good = consistent(u, np.full_like(u, 0.05), np.zeros_like(u), np.ones_like(u))
    assert not good[10, 10]
    # at the ends of an edge nothing on the far side of the border speaks for a pixel
    assert good.sum() >= good.size - 5


@pytest.mark.parametrize("bend", [0.0, 0.01])
def test_the_sigma_of_interreflected_light_is_learnt(bend: float) -> None:
    """And not from how a surface bends."""
    rng = np.random.default_rng(2)
    lost = np.full((80, 80), 0.2, np.float32)
    sigma = np.full((80, 80), 0.02, np.float32)
    ramp = 0.8 * np.arange(80) + bend * np.arange(80) ** 2
    still = (ramp + rng.normal(0.0, 0.02, (80, 80))).astype(np.float32)
    moved = (still + rng.normal(0.0, 0.2 * 0.5, (80, 80))).astype(np.float32)
    assert (interreflection_sigma_px(still, sigma, lost) / lost).max() < 0.03
    assert interreflection_sigma_px(moved, sigma, lost) / lost == pytest.approx(0.5, rel=0.06)


def test_holes_are_filled_smoothly() -> None:
    rows, columns = np.mgrid[:96, :128].astype(np.float32)
    u = 0.7 * columns + 0.002 * (rows - 40.0) ** 2
    known = np.hypot(rows - 50.0, columns - 60.0) > 14.0
    filled = fill_columns(np.where(known, u, np.nan).astype(np.float32), known, wanted=np.ones_like(known))
    assert np.abs(filled - u).max() < 2.0


def response(white: Floats) -> Response:
    return Response(
        white.astype(np.float32), np.zeros_like(white, np.float32), np.zeros(white.shape, bool), 0
    )


def intensity_of(white: Floats) -> Floats:
    rows, columns = np.mgrid[: white.shape[0], : white.shape[1]].astype(np.float32)
    return intensities(
        columns,
        rows.astype(float),
        response(white),
        np.full(rows.shape, np.inf, np.float32),
        shape=white.shape,
        camera=CameraSheet(),
        exposure_ms=200.0,
        period_px=9.0,
        steps=33,
        max_sigma_px=0.35,
        least=0.005,
    )


def test_intensities_keep_bright_pixels_within_range_and_dim_ones_lit() -> None:
    light = intensity_of(np.where(np.mgrid[:60, :80][1] < 40, 1.0, 400.0))
    assert (light[:, :35] > 0.95).all()
    assert ((400.0 * 200.0 * light)[:, 45:] < CameraSheet().full_well_e).all()
    assert ((400.0 * 200.0 * light)[:, 45:] > 0.4 * CameraSheet().full_well_e).all()


def test_what_every_intensity_clips_gets_the_least() -> None:
    """Full light there rose by a factor of 2.3 a pixel beside a lobe: columns were 0.04 px off at 0.004."""
    highest = CameraSheet().full_well_e / (200.0 * 0.005)
    light = intensity_of(np.where(np.mgrid[:60, :80][1] < 40, 0.7 * highest, 1.5 * highest))
    assert light == pytest.approx(0.005, rel=1e-6)


def test_what_is_too_dim_in_any_light_gets_all() -> None:
    assert intensity_of(np.full((60, 80), 1e-5)) == pytest.approx(1.0)


def test_the_plan_reads_the_brightest_and_reaches_the_dimmest() -> None:
    camera = CameraSheet()
    white = np.geomspace(0.3, 5e4, 5000)[None]
    crude_ms, final_ms = plan_exposures_ms(
        response(white), camera=camera, period_px=9.0, steps=(21, 33), max_sigma_px=0.35, least=0.005
    )
    assert crude_ms * np.quantile(white, 0.999) <= camera.full_well_e
    assert final_ms >= 0.2 * camera.exposure_range_ms[1]


def test_dither_needs_no_intensity() -> None:
    rig = small_rig(width=80)
    shown = patterns(
        CODE.frames(rig.projector.shape), CODE.names, view=rig.projector, sheet=ProjectorSheet.gamma()
    )
    light = ProjectorSheet.gamma().light[shown.frames].mean(axis=(1, 2))
    assert np.abs(light - 0.5).max() < 0.06


@pytest.mark.study
def test_frames_that_show_a_part_elsewhere_are_read_without_a_column_off_the_projector() -> None:
    """A part that shook: each frame of a look at other pixels, so that phasors fit no column."""
    instrument = flat()
    rig, rng = instrument.rig, np.random.default_rng(5)
    shown = patterns(
        CODE.frames(rig.projector.shape), CODE.names, view=rig.projector, sheet=instrument.projector
    )
    still = instrument.capture(shown, 10.0)
    dark = (instrument.response * 1e-3 + instrument.ambient_e_per_ms).astype(np.float32) * 10.0
    for _ in range(20):
        shaken = np.stack([np.roll(frame, rng.integers(-9, 10, 2), axis=(0, 1)) for frame in still])
        reading = read(shaken, CODE, camera=instrument.camera, rig=rig, dark_e=dark)
        u = reading.u_px[np.isfinite(reading.u_px)]
        assert u.size > 100
        assert -4.0 <= u.min() <= u.max() <= rig.projector.width + 3.0


def test_what_taking_the_bias_off_leaves_is_more_where_brightness_bends() -> None:
    even = np.full((20, 20), 5.0, np.float32)
    slope = np.exp(0.8 * np.mgrid[:20, :20][1]).astype(np.float32)
    edge = np.where(np.mgrid[:20, :20][1] < 10, 1.0, 9.0).astype(np.float32)
    assert left(even) == pytest.approx(0.12)
    assert left(slope)[:, 1:-1] == pytest.approx(0.12, abs=0.01)
    assert left(edge)[:, 9:11] == pytest.approx(1.0)
    assert left(edge)[:, :9] == pytest.approx(0.12)
    assert left(np.zeros((9, 9), np.float32)) == pytest.approx(0.12)
