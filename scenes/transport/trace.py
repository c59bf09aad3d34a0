"""Tracing a scene once: from every camera pixel along light paths to the projector pixels that feed it.

Every pixel gets the pilot's few paths. They are enough for its direct light, but through a lens that blurs
(:mod:`scenes.transport.lenses`); where its interreflected light is still too uncertain it gets as many more
as that takes (:mod:`scenes.transport.refine`). No pixel ever gets the light of another.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from burrscan.arrays import Floats, Ints
from burrscan.errors import InputError
from scenes.transport.arrivals import Finds
from scenes.transport.guide import found, together
from scenes.transport.hits import may_see
from scenes.transport.matrix import LightTransport
from scenes.transport.optics import Optics
from scenes.transport.photons import photon_finds
from scenes.transport.pilot import pilots
from scenes.transport.refine import LEAST_SAMPLES, most_of_a_path, needed_samples, refine, stripe_table
from scenes.transport.rows import SparseRows, added, scattered
from scenes.transport.uncertainty import standard_error


def trace(
    mi: Any,
    scene: Any,
    optics: Optics,
    *,
    samples: int = 16,
    bounces: int = 3,
    seed: int = 0,
    error: float = 0.023,
    most: int = 1024,
    paths: int = 1 << 24,
) -> LightTransport:
    """Trace the light transport between projector and camera.

    Parameters
    ----------
    mi, scene
        The activated vectorised Mitsuba module, and a scene (camera frame, mm) without emitters.
    optics
        The true rig.
    samples
        Per camera pixel; a power of two of at least 2.
    bounces
        Surface interactions of the longest path; 1 is direct light alone.
    seed
        Of the sampling. The same seed gives the same bits, whatever the number of threads.
    error
        Standard error of a pixel's interreflected light above which it gets more paths, relative to the
        geometric mean of its whole light and what of it goes with stripes; infinite for none.
    most
        Further paths that no pixel exceeds, beyond a first round of 32; a power of two.
    paths
        Further paths of all pixels together, by which time and memory are bounded: where they need more, as
        in deep polished grooves, ``most`` is halved until they do.

    Complexity: O(paths × bounces) rays; memory O(paths that carry light + one pass).

    Raises
    ------
    InputError
        When ``samples`` or ``most`` is no power of two.

    """
    if most & (most - 1):
        raise InputError(f"most paths per pixel must be a power of two, such as 512 or 1024, not {most}")
    view = optics.rig.camera
    seen = may_see(mi, scene, optics)
    first, lit = pilots(mi, scene, optics, seen=seen, samples=samples, bounces=bounces, seed=seed)
    direct = scattered([(one.pixels, one.rows) for one in lit], seen.size)
    bounced = [(one.pixels, one.bounced) for one in first]
    centres = np.full((3, *view.shape), np.nan, np.float32)
    ambient = np.zeros(view.shape, np.float32)
    for part in lit:
        _flat(centres)[:, part.pixels] = part.centres
    for some in first:
        _flat(ambient)[some.pixels] = some.ambient
    pilot_parts = len(first)
    del first, lit  # its rows are in ``direct``
    refined = np.zeros(view.shape, np.int64)
    stripes = stripe_table(optics.rig.projector.width)
    direct_light = direct.product(stripes).reshape(3, *view.shape).astype(float)
    variance, indirect_light, fresh = np.zeros(view.shape), np.zeros(direct_light.shape), bounced
    photons: list[Finds] = []
    # a first round shows where light comes from, and how much it varies
    for learn, most_now in ((True, LEAST_SAMPLES), (False, most)):
        for pixels, one in fresh:
            _flat(variance)[pixels] = one.variance
            _flat(indirect_light)[:, pixels] = one.rows.product(stripes)
        need = needed_samples(
            variance,
            direct=direct_light,
            indirect=indirect_light,
            refined=refined,
            pilot=samples,
            seen=seen,
            error=error,
            most=most_now,
            paths=paths,
        )
        if not need.any():
            break
        photons = photons or photon_finds(mi, scene, optics, seed=seed)
        finds = [together(*both) for both in zip(found(bounced, seen.size), photons, strict=True)]
        if not learn:  # nobody asks the parts again
            bounced = [(pixels, one._replace(finds=())) for pixels, one in bounced]
        pixels = np.flatnonzero(need)
        fresh = list(
            refine(
                mi,
                scene,
                optics,
                pixels=pixels,
                samples=need.ravel()[pixels],
                bounces=bounces,
                seed=seed,
                finds=finds,
                learn=learn,
            )
        )
        bounced += fresh
        refined += need
    traced = [(pixels, one.samples) for pixels, one in bounced]
    shared = list(zip(bounced, shares(traced, refined=refined.ravel(), pilots=pilot_parts), strict=True))
    sigma = standard_error(
        _sum([(pixels, one.variance * share) for (pixels, one), share in shared], view.shape),
        _sum([(pixels, one.halves * share**2) for (pixels, one), share in shared], view.shape),
        _sum([(pixels, one.quarters * share**2) for (pixels, one), share in shared], view.shape),
        samples=refined,
        pilot=samples,
        seen=seen,
    )
    return LightTransport(
        camera_shape=view.shape,
        projector_shape=optics.rig.projector.shape,
        direct=direct,
        indirect=_bounded(
            added([(pixels, one.rows, share) for (pixels, one), share in shared], seen.size),
            most_of_a_path(direct_light, indirect_light, seen=seen, error=error).ravel(),
        ),
        ambient=ambient,
        u_px=centres[0],
        v_px=centres[1],
        spread_px=centres[2],
        indirect_sigma=sigma.astype(np.float32),
    )


def shares(parts: Sequence[tuple[Ints, Ints]], *, refined: Ints, pilots: int) -> list[Floats]:
    """What the paths of each part count for in their pixels: by number; a pilot's not if there are others.

    How many paths a pixel gets does not depend on the light that its own earlier ones found. ``parts`` are
    flat pixels and the paths of each, the first ``pilots`` of them the pilot's; ``refined`` (flat camera
    pixels) counts the paths of all others.
    """
    return [
        (refined[pixels] == 0).astype(float) if k < pilots else samples / refined[pixels]
        for k, (pixels, samples) in enumerate(parts)
    ]


def _bounded(rows: SparseRows, most: Floats) -> SparseRows:
    """Rows of which no path gives more than its pixel's ``most`` (pixels,)."""
    bound = np.repeat(most.astype(np.float32), np.diff(rows.starts))
    return SparseRows(rows.starts, rows.columns, np.minimum(rows.values, bound))


def _sum(parts: Sequence[tuple[Ints, Floats]], shape: tuple[int, int]) -> Floats:
    image = np.zeros(shape)
    for pixels, values in parts:
        _flat(image)[pixels] += values
    return image


def _flat(images: NDArray[Any]) -> NDArray[Any]:
    """A view of (…, h, w) images by flat pixel."""
    return images.reshape(*images.shape[:-2], -1)
