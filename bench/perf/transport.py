"""What relighting costs against stock Mitsuba: 48 patterns traced once, against one pattern rendered.

    python -m bench.perf.transport [--scene NAME] [--scale S] [--rounds N]

Both sides run in turn in one process, with the same scene, samples per pixel and path length. Printed: wall
and processor seconds of each (median over the rounds), their ratio pair by pair, and the peak of memory.
"""

from __future__ import annotations

import argparse
import dataclasses
import resource
import time
from collections.abc import Callable

import numpy as np

from scenes.finish import finish_bsdf
from scenes.renderer import activate
from scenes.scene import scene_document, scene_from
from scenes.simulate import optics_of
from scenes.transport.stock import stock_image
from scenes.transport.trace import trace
from scenes.transport.world import wheel_mesh
from scenes.wheel import build_wheel

_PATTERNS = 48
"""Of a usual scan, whose relighting is to cost less than one stock image."""


def main() -> None:
    """Measure and print."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    parser.add_argument("--scene", default="paper")
    parser.add_argument("--scale", type=float, default=1.0)
    parser.add_argument("--rounds", type=int, default=5)
    given = parser.parse_args()
    ours, stock = _sides(given.scene, given.scale)
    ours()
    stock()  # both kernels are compiled before the clock starts
    pairs = [(_timed(ours), _timed(stock)) for _ in range(given.rounds)]
    for name, clock in (("wall", 0), ("processor", 1)):
        a, b = (np.array([pair[side][clock] for pair in pairs]) for side in (0, 1))
        ratio = a / b
        print(
            f"{name}: transport + {_PATTERNS} relit {np.median(a):.2f} s, "
            f"one stock image {np.median(b):.2f} s, "
            f"ratio {np.median(ratio):.2f} ({ratio.min():.2f} to {ratio.max():.2f})"
        )
    print(f"peak memory: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20:.1f} GiB")


def _sides(name: str, scale: float) -> tuple[Callable[[], object], Callable[[], object]]:
    """Our side and the stock side of the comparison."""
    mi = activate()
    document = scene_document(name)
    document["rig"] = document.get("rig", {}) | {"scale": scale}
    scene = scene_from(document, source=name)
    optics = optics_of(scene)
    pose = scene.pose.T_camera_part(standoff_mm=scene.rig.standoff_mm, middle_z_mm=0.0)
    wheel = build_wheel(scene.wheel, scene.burrs)
    mesh = wheel_mesh(mi, wheel, pose, finish_bsdf(scene.finish, channels="mono"))
    bare = mi.load_dict({"type": "scene", "wheel": mesh})
    light = np.random.default_rng(0).random((_PATTERNS, *optics.rig.projector.shape), dtype=np.float32)
    render = scene.render
    return (
        lambda: trace(mi, bare, optics, **dataclasses.asdict(render)).relight(light),
        lambda: stock_image(mi, mesh, optics, light[0], samples=render.samples, bounces=render.bounces),
    )


def _timed(work: Callable[[], object]) -> tuple[float, float]:
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


if __name__ == "__main__":
    main()
