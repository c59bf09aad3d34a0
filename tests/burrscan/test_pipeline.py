from __future__ import annotations

import numpy as np
import pytest

import burrscan
from bench.synthetic.revolution import revolution_scan
from burrscan.documents import build
from burrscan.errors import InputError
from burrscan.inspection import Burr
from burrscan.pipeline import Pipeline, Stage, check, inspect_surface, run, stage_function, stage_of
from burrscan.sight import Sight
from tests.burrscan.instrument import Instrument, small_rig


def test_tables_become_a_pipeline() -> None:
    document = {"axis": {"method": "seed", "parameters": {"planes": 20}}, "scan": {"method": "fixed"}}
    pipeline = build(Pipeline, document, source="suite.toml")
    assert pipeline.axis == Stage("seed", {"planes": 20})
    assert pipeline.burrs == Stage("residual")
    check(pipeline)


def test_unknown_keys_are_refused() -> None:
    with pytest.raises(InputError, match="did you mean 'burrs'"):
        build(Pipeline, {"burr": {"method": "seed"}}, source="suite.toml")


@pytest.mark.parametrize("kind", ["scan", "axis", "generatrix", "burrs"])
def test_every_stage_refuses_what_it_does_not_know(kind: str) -> None:
    with pytest.raises(InputError, match=f"unknown {kind} method"):
        check(Pipeline(**{kind: Stage("nothing")}))
    default: Stage = getattr(Pipeline(), kind)
    with pytest.raises(InputError, match="unknown parameter 'nonsense'"):
        stage_function(Stage(default.method, {"nonsense": 1}), kind)


def test_a_run_from_pictures_to_inspection() -> None:
    outcome = run(Instrument(small_rig(width=200)), Pipeline(scan=Stage("fixed")))
    assert len(outcome.surface.vertices_mm) == len(outcome.inspection.deviation_mm)
    assert abs(outcome.inspection.axis.direction[1]) > np.cos(np.radians(2.0))
    assert list(outcome.inspection.timings_s)[:2] == ["scan", "surface"]
    again = burrscan.inspect(Instrument(small_rig(width=200)), pipeline=Pipeline(scan=Stage("fixed")))
    assert np.array_equal(again.axis.direction, outcome.inspection.axis.direction)


def test_the_same_mesh_gives_the_same_bits() -> None:
    scan = revolution_scan(sigma_mm=0.05, seed=1, shape=(200, 100))
    first, second = (inspect_surface(scan.vertices_mm, scan.faces, Pipeline()) for _ in range(2))
    assert np.array_equal(first.deviation_mm, second.deviation_mm, equal_nan=True)
    assert np.array_equal(first.generatrix.r_mm, second.generatrix.r_mm, equal_nan=True)


def test_an_inspection_carries_its_secondary_tests() -> None:
    scan = revolution_scan(sigma_mm=0.1, shape=(240, 90))
    checks = inspect_surface(scan.vertices_mm, scan.faces, Pipeline()).checks
    assert {"determined", "centres_collinear", "landscape_margin", "residual_symmetry"} <= {
        check.name for check in checks
    }
    assert all(check.passed for check in checks)
    ball = revolution_scan("sphere", sigma_mm=0.1, shape=(160, 80))
    checks = inspect_surface(ball.vertices_mm, ball.faces, Pipeline()).checks
    assert "determined" in {check.name for check in checks if not check.passed}


def test_an_error_says_which_stage_raised_it_and_keeps_its_message() -> None:
    scan = revolution_scan(sigma_mm=0.1, shape=(120, 60))
    with pytest.raises(ZeroDivisionError) as caught:
        inspect_surface(scan.vertices_mm, scan.faces, Pipeline(generatrix=Stage(f"{__name__}:raises")))
    assert stage_of(caught.value) == "generatrix"
    assert str(caught.value) == "no light"
    with pytest.raises(InputError) as empty:
        inspect_surface(scan.vertices_mm * np.nan, scan.faces, Pipeline())
    assert stage_of(empty.value) == "surface"
    assert stage_of(ValueError("elsewhere")) == ""


def raises(*_mesh: object, sigma_mm: object) -> None:  # noqa: ARG001
    """A stage that always raises."""
    raise ZeroDivisionError("no light")


@pytest.fixture
def given() -> list[Sight | None]:
    """What the method below was given, emptied."""
    GIVEN.clear()
    return GIVEN


GIVEN: list[Sight | None] = []


def plain_burrs(*_fit: object, sigma_mm: object) -> tuple[Burr, ...]:  # noqa: ARG001
    """A burrs method of one's own that knows of no sight."""
    return ()


def seeing_burrs(*_fit: object, sigma_mm: object, sight: Sight | None = None) -> tuple[Burr, ...]:  # noqa: ARG001
    """One that has a parameter of that name."""
    GIVEN.append(sight)
    return ()


def test_a_burrs_method_gets_the_sight_if_it_asks_for_it(given: list[Sight | None]) -> None:
    def pipeline(name: str) -> Pipeline:
        return Pipeline(scan=Stage("fixed"), burrs=Stage(f"{__name__}:{name}"))

    instrument = Instrument(small_rig(width=120), decades=1.0)
    outcome = run(instrument, pipeline("seeing_burrs"))
    (sight,) = given
    assert sight is not None
    assert sight.rig is instrument.rig
    np.testing.assert_array_equal(sight.points_mm, outcome.surface.points_mm)
    truth = instrument.response * (1.0 - instrument.projector.light[0])
    lit = instrument.response > 100.0
    assert np.median(np.abs(sight.radiance[lit] / truth[lit] - 1.0)) < 0.02
    again = run(Instrument(small_rig(width=120), decades=1.0), pipeline("plain_burrs"))
    assert again.inspection.burrs == ()
    assert len(given) == 1


def test_a_mesh_alone_has_no_sight(given: list[Sight | None]) -> None:
    scan = revolution_scan(sigma_mm=0.1, shape=(120, 60))
    inspect_surface(scan.vertices_mm, scan.faces, Pipeline(burrs=Stage(f"{__name__}:seeing_burrs")))
    assert given == [None]


def test_a_scan_that_measured_no_radiance_gives_no_sight(given: list[Sight | None]) -> None:
    stage = Stage("fixed", {"exposure_ms": 2.0})
    run(
        Instrument(small_rig(width=120), decades=1.0),
        Pipeline(scan=stage, burrs=Stage(f"{__name__}:seeing_burrs")),
    )
    assert given == [None]
