"""The standard error that nets state of themselves, against nets whose error is known."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import qmc

from burrscan.arrays import Floats
from scenes.transport.arrivals import gather
from scenes.transport.paths import Arrival
from scenes.transport.uncertainty import standard_error

_SHAPE = (40, 50)
_SAMPLES = 64


def column(values: NDArray[Any]) -> Any:
    """An array as Dr.Jit hands it out."""
    return SimpleNamespace(numpy=lambda: values)


def lights(kind: str, rng: np.random.Generator) -> Floats:
    """(pixels, samples) of light that depends on a path's place on the unit square, net by net.

    The two halves of a net go different ways, and find different light.
    """
    pixels = _SHAPE[0] * _SHAPE[1]
    if kind == "independent":
        u = rng.random((pixels, _SAMPLES, 2))
    else:
        u = np.stack([qmc.Sobol(2, rng=rng).random(_SAMPLES) for _ in range(pixels)])
    x, y = u[..., 0], u[..., 1]
    guided = np.arange(_SAMPLES) < _SAMPLES // 2
    if kind == "edge":
        return np.where(guided, x + 0.7 * y < 0.9, np.hypot(x, y) < 0.8).astype(float)
    return np.where(guided, 1.0 + x * y**2, np.exp(x - y))


@pytest.mark.parametrize(("kind", "within"), [("independent", 0.12), ("edge", 0.12), ("smooth", 0.33)])
def test_the_error_of_a_net_is_as_stated(kind: str, within: float) -> None:
    """Whatever the rate: nothing gained, a light with an edge, a smooth one, whose rate still grows.

    The true error is that of 2000 nets. Halves that were taken for independent would state 1.4 times that of
    the edge and 1.9 times that of the smooth light.
    """
    light = lights(kind, np.random.default_rng(3))
    path = np.arange(light.size, dtype=np.uint32)
    lit = light.ravel() > 0.0
    arrival = Arrival(
        column(path[lit]),
        column(np.zeros(int(lit.sum()), np.uint32)),
        column(light.ravel()[lit].astype(np.float32)),
        [],
    )
    gathered = gather([arrival], samples=np.full(len(light), _SAMPLES), learn=False)
    stated = standard_error(
        gathered.variance.reshape(_SHAPE),
        gathered.halves.reshape(_SHAPE),
        gathered.quarters.reshape(_SHAPE),
        samples=np.full(_SHAPE, _SAMPLES),
        pilot=16,
        seen=np.ones(_SHAPE, np.bool_),
    )
    true = light.mean(axis=1).std()
    assert np.sqrt(np.mean(stated**2)) == pytest.approx(true, rel=within)
    assert np.median(stated) == pytest.approx(true, rel=within)
