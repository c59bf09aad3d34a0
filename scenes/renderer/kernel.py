"""The representative kernel, run as a script in a process of its own: ``python kernel.py VARIANT``.

It imports nothing of this project, because some libraries abort the process that compiles with them: LLVM 15
loads, then dies on "Cannot select: fminimum" when it meets a rough conductor. Prints one JSON line when the
kernel ran and its numbers are right; otherwise it raises, or the library kills it.
"""

from __future__ import annotations

import json
import sys
from contextlib import suppress
from typing import Any

RAYS = 4096
"""Enough that every lane of a vector unit and the loop's masks are used; a fraction of a second anywhere."""
TOLERANCE = 1e-4  # float32 at distance 5, with the head-room of a fast square root


def main(variant: str) -> None:
    """Trace a sphere of rough metal, compare the distances with the formula, and evaluate its reflection."""
    no_core_dump()
    import drjit as dr  # noqa: PLC0415 (the variant's library is chosen by the environment of this process)
    import mitsuba as mi  # noqa: PLC0415

    mi.set_variant(variant)
    sphere, ray, height = sphere_and_rays(dr, mi)
    hit = sphere.ray_intersect(ray)
    error = dr.max(dr.abs(hit.t - (5 - height)))[0]
    if not error < TOLERANCE:
        raise RuntimeError(f"the kernel ran but its distances are wrong by {error}")
    shine = reflect(dr, mi, hit)
    if not 0 < shine < 1:
        raise RuntimeError(f"the kernel ran but a metal sphere reflects {shine} of the light")
    version = dr.detail.llvm_version() if variant.startswith("llvm") else ()
    sys.stdout.write(json.dumps({"ran": True, "llvm": ".".join(map(str, version))}) + "\n")


def no_core_dump() -> None:
    """An abort is an answer here, not an accident worth a core file."""
    with suppress(ImportError, ValueError, OSError):
        import resource  # noqa: PLC0415 (not on Windows)

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def sphere_and_rays(dr: Any, mi: Any) -> tuple[Any, Any, Any]:
    """A turned metal sphere, parallel rays that all meet it, and its height under each ray."""
    metal = {"type": "roughconductor", "eta": 1.5, "k": 7.0, "alpha_u": 0.2, "alpha_v": 0.05}
    shape = {"type": "sphere", "bsdf": {"type": "twosided", "metal": metal}}
    scene = mi.load_dict({"type": "scene", "shape": shape})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(1, RAYS)
    x, y = sampler.next_1d() - 0.5, sampler.next_1d() - 0.5
    ray = mi.Ray3f(mi.Point3f(x, y, -5), mi.Vector3f(0, 0, 1))
    return scene, ray, dr.sqrt(1 - x * x - y * y)


def reflect(dr: Any, mi: Any, hit: Any) -> float:
    """Mean reflected share of importance-sampled directions, through a loop, a gather and a scatter."""
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(2, RAYS)
    context, bsdf, total, turn = mi.BSDFContext(), hit.bsdf(), mi.Float(0), mi.UInt32(0)

    def bounce(turn: Any, total: Any) -> tuple[Any, Any]:
        sample, _ = bsdf.sample(context, hit, sampler.next_1d(), sampler.next_2d())
        value, density = bsdf.eval_pdf(context, hit, sample.wo)
        share = dr.select(density > 0, dr.mean(value) / density, 0)
        return turn + 1, total + dr.clip(share, 0, 1)

    turn, total = dr.while_loop((turn, total), lambda turn, _: turn < 4, bounce)
    histogram = dr.zeros(mi.Float, 16)
    dr.scatter_add(histogram, total / 4, dr.arange(mi.UInt32, RAYS) % 16)
    return float(dr.sum(dr.gather(mi.Float, histogram, dr.arange(mi.UInt32, 16)))[0] / RAYS)


if __name__ == "__main__":
    main(sys.argv[1])
