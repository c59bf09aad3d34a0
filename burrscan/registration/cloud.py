"""A view made ready for comparison: averaged to its working scale, with normals, rims and a search tree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from burrscan.arrays import Bools, Floats, Ints
from burrscan.errors import InputError
from burrscan.registration.alignment import PosedSurface
from burrscan.registration.averaged import Averaged, averaged
from burrscan.registration.scale import Scale, scale_of

_FEWEST = 100
"""Points: with fewer there is no surface to align six unknowns by."""
_NEIGHBOURS = (40, 20, 10)
"""Of the plane whose normal a point has. The first is enough to average noise off it, and to tell an edge
that is sharper than the pitch from a plane; fewer where a part is so small that most of it would be one."""
_LEAST_PLANE = 0.5
"""Share of the points that must be left beside rims and edges, or fewer neighbours are tried."""
_LOPSIDED = 0.5
"""In pitches: where the middle of the surroundings is this far off, they lie to one side, as at a rim."""
_BENT = 0.2
"""Thickness of the surroundings over their lesser width, from which they are an edge and no plane."""
_CHUNK = 20_000
"""Planes found at a time: the neighbours of each are some 20 MB."""


@dataclass(frozen=True)
class Cloud:
    """Points that have a normal, in the camera frame.

    Parameters
    ----------
    points_mm, normals
        (V, 3).
    middles_mm
        (V, 3) the middle of every point's surroundings: where its normal is that of the surface.
    sigma_mm
        (V,).
    count
        (V,) how many points of the view each stands for.
    lean
        (V,) variance of the normal in either direction across it, rad², that noise makes.
    rim
        (V,) True beside the end of the view and on edges, where the nearest point need not be the nearest
        place and normals lean.
    oriented
        Whether the normals point to the side that was seen; those of a cloud point either way.
    samples
        (S,) indices of the points that are compared with other views.
    tree
        Over the points.
    pitch_mm
        Distance of neighbours.
    noise_mm
        Standard deviation of the view's single points across its surface.

    """

    points_mm: Floats
    normals: Floats
    middles_mm: Floats
    sigma_mm: Floats
    count: Floats
    lean: Floats
    rim: Bools
    oriented: bool
    samples: Ints
    tree: cKDTree
    pitch_mm: float
    noise_mm: float


def clouds_of(views: list[tuple[PosedSurface, str]], *, samples: int, seed: int) -> list[Cloud]:
    """Prepare views, all at the coarsest of their working scales: what is compared is then alike.

    Raises
    ------
    InputError
        When a view has hardly any points.

    """
    used = [_used(view, name) for view, name in views]
    scales = [
        scale_of(view.vertices_mm[one], cKDTree(view.vertices_mm[one]), np.random.default_rng(seed))
        for (view, _), one in zip(views, used, strict=True)
    ]
    working = max(scale.working_mm for scale in scales)
    clouds = []
    for (view, name), one, scale in zip(views, used, scales, strict=True):
        clouds.append(_cloud(view, one, scale, working, samples=samples, seed=seed, name=name))
    return clouds


def _used(view: PosedSurface, name: str) -> Bools:
    """(V,) vertices on a face, or all of a cloud."""
    used: Bools = np.asarray(np.isfinite(view.vertices_mm).all(axis=1))
    if len(view.faces):
        used = used & np.isin(np.arange(len(used)), view.faces)
    if used.sum() < _FEWEST:
        raise InputError(f"{name}: only {used.sum()} points; an alignment needs {_FEWEST} of a surface")
    return used


def _cloud(
    view: PosedSurface, used: Bools, scale: Scale, working: float, *, samples: int, seed: int, name: str
) -> Cloud:
    number = np.cumsum(used) - 1
    faces = number[view.faces[used[view.faces].all(axis=1)]].astype(np.int32)
    sigma = _sigma(view.sigma_mm[used], scale)
    thin = averaged(view.vertices_mm[used], sigma, faces, pitch_mm=scale.pitch_mm, working_mm=working)
    if len(thin.points_mm) < _FEWEST:
        raise InputError(
            f"{name}: {len(thin.points_mm)} points are left of {used.sum()} once noise of "
            f"{scale.noise_mm:.2g} mm is averaged over {working:.2g} mm; an alignment needs {_FEWEST}: hand "
            "over more of the part, or a less noisy scan"
        )
    tree = cKDTree(thin.points_mm)
    for neighbours in _NEIGHBOURS:
        planes = [
            _planes(thin, tree, slice(at, at + _CHUNK), neighbours)
            for at in range(0, len(thin.points_mm), _CHUNK)
        ]
        normals, middles, lean, shift, bent, reach = (
            np.concatenate(part) for part in zip(*planes, strict=True)
        )
        pitch = float(np.median(reach)) * float(np.sqrt(np.pi / neighbours))
        rim = np.asarray((shift > _LOPSIDED * pitch) | bent)
        if np.mean(rim) < 1.0 - _LEAST_PLANE:
            break
    chosen = np.sort(np.random.default_rng(seed).permutation(len(thin.points_mm))[:samples])
    return Cloud(
        points_mm=thin.points_mm,
        normals=normals,
        middles_mm=middles,
        sigma_mm=thin.sigma_mm,
        count=thin.count,
        lean=lean,
        rim=rim,
        oriented=len(faces) > 0,
        samples=chosen,
        tree=tree,
        pitch_mm=pitch,
        noise_mm=float(np.median(sigma)),
    )


def _sigma(stated_mm: Floats, scale: Scale) -> Floats:
    """(V,) standard deviations: as stated, raised to what the points show, which is all where none is."""
    known = np.isfinite(stated_mm) & (stated_mm > 0.0)
    if not known.any():
        return np.full(len(stated_mm), max(scale.noise_mm, np.finfo(float).tiny))
    middle = float(np.median(stated_mm[known]))
    return np.where(known, stated_mm, middle) * max(1.0, scale.noise_mm / middle)


def _planes(thin: Averaged, tree: cKDTree, which: slice, neighbours: int) -> tuple[Floats, ...]:
    """Normals and middles of the planes through some points' surroundings, and what makes them unsure.

    Noise in the normals of a surface of revolution looks like information about the turn that slides it along
    itself (errors in variables), and so does any lean: surroundings are round, whatever the faces. Returned
    are normal, middle, variance of the normal's lean, how far the middle is off sideways, whether the
    surroundings are bent, and their reach.
    """
    points_mm, sigma_mm, outwards = thin.points_mm, thin.sigma_mm, thin.outwards
    found = tree.query(points_mm[which], k=neighbours)
    distance, near = (np.asarray(part) for part in found)
    around = points_mm[near]
    middle = around.mean(axis=1)
    local = around - middle[:, None]
    spread, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", local, local) / near.shape[1])
    normal = axes[:, :, 0]
    side = np.einsum("ni,nki->n", normal, outwards[near])
    normal = normal * np.where(side < 0.0, -1.0, 1.0)[:, None]
    off = middle - points_mm[which]
    shift = np.linalg.norm(off - np.einsum("ni,ni->n", off, normal)[:, None] * normal, axis=1)
    width = np.maximum(spread[:, 1], np.finfo(float).tiny)
    lean = np.mean(sigma_mm[near] ** 2, axis=1) / (near.shape[1] * width)
    return normal, middle, lean, shift, spread[:, 0] > _BENT**2 * width, distance[:, -1]
