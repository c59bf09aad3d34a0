from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.documents import build
from burrscan.errors import InputError
from scenes.finish import FINISHES, Channels, FinishSpec, Metal, finish_bsdf, named_finish, optical_constants
from scenes.renderer import activate
from scenes.transport.world import wheel_mesh
from scenes.wheel import WheelSpec, build_wheel

CYLINDER = WheelSpec("cylinder", ((-30.0, 0.0), (-30.0, 100.0), (30.0, 100.0), (30.0, 0.0)))


@pytest.fixture(params=["chosen", "scalar_rgb"])
def renderer(request: pytest.FixtureRequest) -> Iterator[tuple[Any, Channels]]:
    """Mitsuba in the variant of this machine, and in the scalar one that always runs."""
    mi = activate()
    chosen = mi.variant()
    if request.param == "scalar_rgb":
        mi.set_variant("scalar_rgb")
    yield mi, "rgb" if mi.variant().endswith("rgb") else "mono"
    mi.set_variant(chosen)


def _first(value: Any) -> float:
    return float(np.array(value).ravel()[0])


def _hit(mi: Any, finish: FinishSpec, channels: Channels) -> Any:
    """Where the ray along -x meets a cylinder of that finish."""
    mesh = wheel_mesh(
        mi, build_wheel(CYLINDER, (), facet_error_mm=0.01), np.eye(4), finish_bsdf(finish, channels=channels)
    )
    scene = mi.load_dict({"type": "scene", "wheel": mesh})
    return scene, scene.ray_intersect(mi.Ray3f(mi.Point3f(300.0, 0.0, 3.0), mi.Vector3f(-1.0, 0.0, 0.0)))


def _reflected(mi: Any, hit: Any, towards: list[float]) -> float:
    direction = np.array(towards) / np.linalg.norm(towards)
    local = hit.to_local(mi.Vector3f(*map(float, direction)))
    return _first(hit.bsdf().eval(mi.BSDFContext(), hit, local))


@pytest.mark.parametrize("metal", get_args(Metal))
def test_retroreflection_at_normal_incidence_is_fresnel_over_4_pi_alpha_squared(
    renderer: tuple[Any, Channels], metal: Metal
) -> None:
    mi, channels = renderer
    _, hit = _hit(mi, FinishSpec(metal=metal, alpha=0.2), channels)
    n, k = (float(v[0]) for v in optical_constants(metal, (550.0,) if channels == "mono" else (611.0,)))
    fresnel = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    assert _reflected(mi, hit, [1.0, 0.0, 0.0]) == pytest.approx(fresnel / (4.0 * np.pi * 0.2**2), rel=2e-3)


def test_the_highlight_of_a_turned_surface_is_drawn_out_along_the_axis(
    renderer: tuple[Any, Channels],
) -> None:
    mi, channels = renderer
    _, hit = _hit(mi, named_finish("turned"), channels)
    along_axis = _reflected(mi, hit, [1.0, 0.0, 0.4])
    round_the_wheel = _reflected(mi, hit, [1.0, 0.4, 0.0])
    assert along_axis > 10.0 * round_the_wheel


def test_a_finish_of_equal_roughness_has_a_round_highlight(renderer: tuple[Any, Channels]) -> None:
    mi, channels = renderer
    _, hit = _hit(mi, named_finish("ground"), channels)
    assert _reflected(mi, hit, [1.0, 0.0, 0.4]) == pytest.approx(
        _reflected(mi, hit, [1.0, 0.4, 0.0]), rel=0.02
    )


@pytest.mark.parametrize("name", FINISHES)
def test_every_finish_reflects_no_more_than_it_receives(name: str) -> None:
    mi = activate()
    mi.set_variant("scalar_rgb")
    bsdf = mi.load_dict(finish_bsdf(named_finish(name, metal="brass"), channels="mono"))
    hit = mi.SurfaceInteraction3f()
    hit.sh_frame = mi.Frame3f(mi.Vector3f(0.0, 0.0, 1.0))
    hit.wi = mi.Vector3f(0.0, 0.0, 1.0)
    rng = np.random.default_rng(0)
    context = mi.BSDFContext()
    weights = [
        _first(bsdf.sample(context, hit, float(a), mi.Point2f(float(b), float(c)))[1])
        for a, b, c in rng.uniform(size=(2000, 3))
    ]
    activate()
    assert 0.5 < np.mean(weights) < 1.0


def test_the_matte_coating_reflects_eight_tenths_evenly(renderer: tuple[Any, Channels]) -> None:
    mi, channels = renderer
    _, hit = _hit(mi, named_finish("matte"), channels)
    assert _reflected(mi, hit, [1.0, 0.0, 0.0]) == pytest.approx(0.8 / np.pi, rel=1e-3)
    assert _reflected(mi, hit, [1.0, 0.5, 0.5]) == pytest.approx(0.8 / np.pi / np.sqrt(1.5), rel=1e-3)


def test_oxide_blends_the_metal_with_diffuse(renderer: tuple[Any, Channels]) -> None:
    mi, channels = renderer

    def value(share: float) -> float:
        _, hit = _hit(mi, FinishSpec(alpha=0.2, diffuse_share=share, diffuse_reflectance=0.5), channels)
        return _reflected(mi, hit, [1.0, 0.2, 0.1])

    assert value(0.25) == pytest.approx(0.75 * value(0.0) + 0.25 * value(1.0), rel=1e-4)


@pytest.mark.parametrize(
    ("metal", "mean"),
    [("aluminium", 0.915), ("steel", 0.65), ("brass", 0.78), ("chrome", 0.555), ("chrome-film", 0.65)],
)
def test_the_constants_give_the_known_reflectances_of_the_metals(metal: Metal, mean: float) -> None:
    n, k = optical_constants(metal, (550.0,))
    fresnel: Floats = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    assert fresnel[0] == pytest.approx(mean, abs=0.02)


def test_brass_is_yellow() -> None:
    rgb = finish_bsdf(named_finish("ground", metal="brass"), channels="rgb")["bsdf"]
    n, k = np.array(rgb["eta"]["value"]), np.array(rgb["k"]["value"])
    red, green, blue = ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
    assert red > green > 1.3 * blue


def test_a_finish_is_read_from_a_document_and_bad_ones_are_refused() -> None:
    spec = build(FinishSpec, json.loads('{"texture": "turned", "metal": "steel"}'), source="here")
    assert spec == FinishSpec(texture="turned", metal="steel")
    with pytest.raises(InputError, match="alpha"):
        build(FinishSpec, {"alpha": 0.0}, source=str(Path("scene.toml")))
    with pytest.raises(InputError, match="did you mean 'polished'"):
        named_finish("polishd")


@pytest.mark.parametrize(("metal", "symbol"), [("copper", "Cu"), ("gold", "Au"), ("aluminium", "Al")])
def test_constants_reflect_as_the_renderers_own_tables_do(metal: Metal, symbol: str) -> None:
    """Other samples of the metal, other films: they differ by percents, a typing error by more."""
    mi = activate()
    folder = Path(str(mi.__file__)).parent / "data" / "ior"
    wavelengths_nm = (464.0, 549.0, 611.0)
    n, k = optical_constants(metal, wavelengths_nm)
    tables = [np.loadtxt(folder / f"{symbol}.{part}.spd") for part in ("eta", "k")]
    others = [np.interp(wavelengths_nm, *table.T) for table in tables]
    np.testing.assert_allclose(_reflectance(n, k), _reflectance(*others), atol=0.06)


def _reflectance(n: Floats, k: Floats) -> Floats:
    return ((n - 1.0) ** 2 + k**2) / ((n + 1.0) ** 2 + k**2)
