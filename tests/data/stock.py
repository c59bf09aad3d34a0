"""Stock Mitsuba's light, kept: ``python -m tests.data.stock`` renders it anew, three minutes.

Only what is held against it is traced in every run of the tests.
"""

from typing import Any, NamedTuple

import numpy as np

from bench.checks.zoomed import ZOOMS, Reference, Rendered
from burrscan.arrays import Floats
from scenes.renderer import activate
from scenes.transport.stock import stock_images
from tests.data import HERE
from tests.scenes.pulley import FINISHES, RUNS, blocks, stripes_on

KEPT = HERE / "stock_light.npz"
SHAPE = (32, 40)
"""Rows and columns of the zoomed cameras."""
SAMPLES = 8192
"""Of each run of a zoomed camera, 131,072 paths a pixel: of 4,096 most pixels beside a bright edge of turned
steel met none of the few that carry a tenth of their light, and their scatter did not say so."""
NAMES = ("ridge-lying-ground", "ridge-turned", "rim-ground", "nick-chrome", "groove-polished")


class Blocks(NamedTuple):
    """Of the pulley: direct light of blocks per pattern, its variance, and each pattern's whole light."""

    mean: Floats
    variance: Floats
    whole: Floats


def kept(name: str) -> Reference:
    """The reference of a zoomed scene, which must be the one that was rendered."""
    with np.load(KEPT) as file:
        assert str(file[f"{name}.scene"]) == repr(ZOOMS[name]), f"{name} changed: python -m tests.data.stock"
        direct, mean, variance = file[name].astype(float)
    return Reference(direct, mean, variance)


def kept_blocks(finish: str) -> Blocks:
    """The pulley's, in a finish."""
    with np.load(KEPT) as file:
        return Blocks(*(file[f"pulley-{finish}.{field}"].astype(float) for field in Blocks._fields))


def main() -> None:
    """Render everything anew."""
    mi = activate()
    arrays: dict[str, Any] = {}
    for name in NAMES:
        light = Rendered(mi, ZOOMS[name], shape=SHAPE).reference(SAMPLES)
        arrays[name] = np.stack([light.direct, light.mean, light.variance]).astype(np.float32)
        arrays[f"{name}.scene"] = np.array(repr(ZOOMS[name]))
    for finish in FINISHES:
        for field, values in _blocks_of(mi, finish)._asdict().items():
            arrays[f"pulley-{finish}.{field}"] = values.astype(np.float32)
    np.savez_compressed(KEPT, **arrays)


def _blocks_of(mi: Any, finish: str) -> Blocks:
    mesh, _, optics, light = stripes_on(mi, finish)

    def images(count: int, samples: int, bounces: int) -> Any:
        seeds = range(1000, 1000 + count)
        frames = [
            stock_images(mi, mesh, optics, frame, samples=samples, bounces=bounces, seeds=seeds)
            for frame in light
        ]
        return np.stack(frames, axis=1)

    direct = blocks(images(RUNS, 8, 1))
    whole = images(3, 64, 3).mean(axis=(0, 2, 3))
    return Blocks(direct.mean(axis=0), direct.var(axis=0, ddof=1) / RUNS, whole)


if __name__ == "__main__":
    main()
