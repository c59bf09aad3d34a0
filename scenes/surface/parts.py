"""A wheel's faces divided by what they look like: one Mitsuba mesh for each finish and set of blemishes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.errors import InputError
from scenes.finish import FinishSpec, torn
from scenes.surface.chart import Chart, Place
from scenes.surface.spec import Blemish, Zone
from scenes.surface.truth import placed_blemishes
from scenes.wheel import BurrSpec, Wheel


@dataclass(frozen=True)
class Cover:
    """A blemish on a part; its middle is at ``turns`` + angle / 360 in the part's u."""

    blemish: Blemish
    place: Place
    turns: int


@dataclass(frozen=True)
class SurfacePart:
    """Faces that look alike.

    Parameters
    ----------
    name
        Of the mesh.
    faces
        (T,) which of the wheel's.
    uvs
        (V, 2) of all of the wheel's vertices; u moved by whole turns where the part's blemishes need it.
    finish
        Under the blemishes.
    covers
        The blemishes that may cover some of it, in the scene's order: the last lies on top.
    outline_mm
        Length of the wheel's outline: the unit of v.

    """

    name: str
    faces: Ints32
    uvs: Floats
    finish: FinishSpec
    covers: tuple[Cover, ...]
    outline_mm: float


def surface_parts(
    wheel: Wheel,
    finish: FinishSpec,
    *,
    burrs: Sequence[BurrSpec] = (),
    zones: Sequence[Zone] = (),
    blemishes: Sequence[Blemish] = (),
) -> tuple[SurfacePart, ...]:
    """Divide a wheel by finish and blemishes. O(faces × blemishes).

    Parameters
    ----------
    wheel
        Built with its outline cut at the zones' ends (:func:`zone_ends_mm`).
    finish
        Of the wheel where nothing else is said.
    burrs
        As the wheel was built with; a burr keeps its finish wherever it stands.
    zones, blemishes
        Of the scene; zones must not overlap.

    Raises
    ------
    InputError
        When zones overlap or are empty, or a blemish is not on the wheel.

    """
    zone_ends_mm(zones)
    finishes, kind = _finishes(wheel, finish, burrs, zones)
    chart = Chart(wheel.generatrix_zr_mm) if blemishes else None
    places = placed_blemishes(blemishes, chart) if chart else []
    outline_mm = chart.length_mm if chart else 1.0
    touched = np.array([_touched(wheel, place, outline_mm) for place in places], np.bool_).reshape(
        -1, len(kind)
    )
    keys = np.concatenate([kind[None], touched], axis=0).T
    member = np.unique(kind, return_inverse=True)[1]
    for each in touched:  # faces of the same row share a number, in the rows' lexical order
        member = np.unique(2 * member + each, return_inverse=True)[1]
    rows = keys[np.unique(member, return_index=True)[1]]
    parts = []
    for number, row in enumerate(rows):
        covering = [i for i in range(len(places)) if row[1 + i]]
        uvs, covers = _unwrapped(wheel, [blemishes[i] for i in covering], [places[i] for i in covering])
        faces = np.flatnonzero(member == number).astype(np.int32)
        name = "wheel" if len(rows) == 1 else f"wheel_{number}"
        parts.append(SurfacePart(name, faces, uvs, finishes[int(row[0])], covers, outline_mm))
    return tuple(parts)


def zone_ends_mm(zones: Sequence[Zone]) -> tuple[float, ...]:
    """Where the wheel's outline is to be cut for its zones.

    Raises
    ------
    InputError
        When a zone is empty or overlaps another.

    """
    for index, zone in enumerate(zones):
        if not zone.z_start_mm < zone.z_end_mm:
            raise InputError(
                f"zone {index}: z_start_mm {zone.z_start_mm:g} must be less than z_end_mm {zone.z_end_mm:g}"
            )
    ordered = sorted(zones, key=lambda zone: zone.z_start_mm)
    for first, second in itertools.pairwise(ordered):
        if second.z_start_mm < first.z_end_mm:
            raise InputError(
                f"zones overlap between z {second.z_start_mm:g} and {first.z_end_mm:g} mm; one finish a place"
            )
    return tuple(sorted({end for zone in zones for end in (zone.z_start_mm, zone.z_end_mm)}))


def _finishes(
    wheel: Wheel, finish: FinishSpec, burrs: Sequence[BurrSpec], zones: Sequence[Zone]
) -> tuple[list[FinishSpec], Ints32]:
    """The finishes there are, and which each face has."""
    finishes, kind = [finish], np.zeros(len(wheel.faces), np.int32)
    body = wheel.face_burr < 0
    z = wheel.vertices_mm[wheel.faces, 2].mean(axis=1) if zones else np.zeros(len(kind))
    chosen = [
        (
            zone.finish.on(finish) if zone.finish else finish,
            body & (z > zone.z_start_mm) & (z < zone.z_end_mm),
        )
        for zone in zones
    ] + [(_burr_finish(burr, finish), wheel.face_burr == index) for index, burr in enumerate(burrs)]
    for one, faces in chosen:
        if one not in finishes:
            finishes.append(one)
        kind[faces] = finishes.index(one)
    return finishes, kind


def _burr_finish(burr: BurrSpec, wheel: FinishSpec) -> FinishSpec:
    """A burr's own finish; its u does not run round the wheel, so nothing varies with it."""
    return torn(wheel) if burr.finish is None else replace(burr.finish.on(wheel), roughness_variation=0.0)


def _touched(wheel: Wheel, place: Place, outline_mm: float) -> Bools:
    """(T,) the faces of the wheel itself that reach into a blemish's extent."""
    u, v = wheel.uvs[wheel.faces, 0], wheel.uvs[wheel.faces, 1]
    middle = u.mean(axis=1, keepdims=True)
    from_place, _ = place.local_mm(360.0 * middle, middle)
    x = from_place + (u - middle) * 2.0 * np.pi * place.radius_mm
    y = v * outline_mm - place.walked_mm
    half_x = np.inf if place.whole_turn else place.half_mm[0]
    reaches = (x.min(axis=1) <= half_x) & (x.max(axis=1) >= -half_x)
    reaches &= (y.min(axis=1) <= place.half_mm[1]) & (y.max(axis=1) >= -place.half_mm[1])
    return np.asarray(reaches & (wheel.face_burr < 0))


def _unwrapped(
    wheel: Wheel, blemishes: Sequence[Blemish], places: Sequence[Place]
) -> tuple[Floats, tuple[Cover, ...]]:
    """Texture coordinates without a seam in any of these blemishes, and where these are in them."""
    local = [place for place in places if not place.whole_turn]
    middles = [place.angle_deg / 360.0 for place in places]
    if not local:
        return wheel.uvs, tuple(Cover(b, p, 0) for b, p in zip(blemishes, places, strict=True))
    narrowest = min(local, key=lambda place: place.half_mm[0] / place.radius_mm).angle_deg / 360.0
    uvs = wheel.uvs.copy()
    uvs[:, 0] -= np.round(uvs[:, 0] - narrowest)
    turns = [round(narrowest - middle) for middle in middles]
    return uvs, tuple(Cover(b, p, t) for b, p, t in zip(blemishes, places, turns, strict=True))
