"""The public face of the axis methods: checks the input, then hands over to the method."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from burrscan.arrays import Bools, Floats, Ints32
from burrscan.errors import InputError
from burrscan.inspection import Axis
from burrscan.strays import WILD, beyond
from burrscan.variants import check_parameters, resolve
from burrscan.welding import welded

METHODS: dict[str, str] = {
    "profile": "burrscan.axis.profile:find_axis_profile",
    "seed": "burrscan.axis.rivals.seed:find_axis_seed",
    "seed-literal": "burrscan.axis.rivals.seed:find_axis_seed_literal",
    "seed-mended": "burrscan.axis.rivals.seed_mended:find_axis_seed_mended",
    "line-complex": "burrscan.axis.rivals.line_complex:find_axis_line_complex",
    "line-complex-robust": "burrscan.axis.rivals.line_complex:find_axis_line_complex_robust",
    "andrews-sequin": "burrscan.axis.rivals.andrews_sequin:find_axis_andrews_sequin",
    "potsac": "burrscan.axis.rivals.potsac:find_axis_potsac",
    "orriols": "burrscan.axis.rivals.orriols:find_axis_orriols",
    "qian-huang": "burrscan.axis.rivals.qian_huang:find_axis_qian_huang",
}
"""Short name to function, of the methods that come with burrscan."""

_LEAST_ACROSS, _MOST_ACROSS = 1e-9, 1e12
"""Largest extent, in the mesh's own unit: outside of these no unit of length makes a part, and the number
is an error."""
_THIN = 1e-7
"""Of the largest extent: what is thinner is flat to single precision, in which meshes are stored."""

FEWEST = 30
"""An axis, a generatrix and their noise cannot be told apart from fewer points."""


def find_axis(
    vertices_mm: ArrayLike, faces: ArrayLike | None = None, *, method: str = "profile", **parameters: Any
) -> Axis:
    """Find the axis of a surface of revolution in a mesh or a cloud.

    Parameters
    ----------
    vertices_mm
        (V, 3) positions in the mesh frame; rows with NaN or infinity are dropped, with the faces that use
        them, and those that coincide count once. The unit may be any: the axis comes in the same one.
    faces
        (T, 3) vertex indices; None or empty for a cloud. Their senses do not matter.
    method
        A key of :data:`METHODS`, or ``"module:function"`` of anyone's package.
    **parameters
        Keyword parameters of the method, such as ``sigma_mm`` (V,) or ``seed``.

    Raises
    ------
    InputError
        When the arrays are not a mesh, hold too few points or no extent, or the method is not known.

    """
    function = resolve(method, METHODS, stage="axis method")
    check_parameters(function, parameters, stage=f"axis method '{method}'")
    vertices, triangles = checked_mesh(vertices_mm, faces)
    sigma = parameters.pop("sigma_mm", None)
    if sigma is not None:
        sigma = _checked_sigma(np.asarray(sigma, dtype=np.float64), len(vertices))
    vertices, triangles, sigma = _finite(vertices, triangles, sigma)
    if len(vertices) and np.ptp(vertices, axis=0).max() == 0.0:
        raise InputError("all vertices coincide: hand over a mesh with an extent")
    if len(vertices) >= FEWEST:
        refuse_flat(vertices)
    vertices, triangles, sigma, _ = welded(vertices, triangles, sigma)
    if len(vertices) < FEWEST:
        raise InputError(
            f"{len(vertices)} points are too few to find an axis: hand over at least {FEWEST} finite vertices"
        )
    axis: Axis = function(vertices, triangles, sigma_mm=sigma, **parameters)
    return axis


def checked_mesh(vertices_mm: ArrayLike, faces: ArrayLike | None) -> tuple[Floats, Ints32]:
    """The mesh as contiguous arrays, or an :class:`InputError` that says what is wrong with it."""
    try:
        vertices = np.ascontiguousarray(vertices_mm, dtype=np.float64)
        triangles = np.asarray(np.empty((0, 3)) if faces is None else faces)
    except (TypeError, ValueError) as error:
        raise InputError(f"vertices and faces must be numeric arrays: {error}") from error
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        raise InputError(f"vertices must have the shape (V, 3), not {vertices.shape}")
    if triangles.size == 0:
        return vertices, np.empty((0, 3), dtype=np.int32)
    if triangles.ndim != 2 or triangles.shape[1] != 3 or not np.issubdtype(triangles.dtype, np.integer):
        raise InputError(
            f"faces must be integers of the shape (T, 3), not {triangles.dtype} {triangles.shape}: "
            "triangulate the mesh first"
        )
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(f"faces must hold vertex indices from 0 to {len(vertices) - 1}")
    return vertices, np.ascontiguousarray(triangles, dtype=np.int32)


def refuse_flat(vertices: Floats) -> None:
    """Refuse points that no arithmetic holds, that lie on one line, or in one plane.

    Raises
    ------
    InputError
        With what the points are instead of a surface.

    """
    across = float(np.ptp(vertices, axis=0).max())
    if not _LEAST_ACROSS <= across <= _MOST_ACROSS:
        raise InputError(
            f"the mesh is {across:.3g} across, from {_LEAST_ACROSS:g} to {_MOST_ACROSS:g} can be measured: "
            "are its coordinates in another unit (--unit), or damaged?"
        )
    middle = vertices - vertices.mean(axis=0)
    extents = np.sqrt(np.linalg.eigvalsh(middle.T @ middle / len(vertices)).clip(0.0))[::-1]
    if extents[1] < _THIN * extents[0]:
        raise InputError("all vertices lie on one line: hand over a surface")
    if extents[2] < _THIN * extents[0]:
        raise InputError("all vertices lie in one plane: a plane has no axis of revolution; hand over a part")


def _checked_sigma(sigma: Floats, count: int) -> Floats:
    if sigma.shape != (count,):
        raise InputError(f"sigma_mm must have one value per vertex, ({count},), not {sigma.shape}")
    return sigma


def _finite(
    vertices: Floats, triangles: Ints32, sigma: Floats | None
) -> tuple[Floats, Ints32, Floats | None]:
    """Drop vertices not finite, strays, or without a positive sigma, and the faces that use them."""
    good: Bools = np.asarray(np.isfinite(vertices).all(axis=1))
    good[good] = ~beyond(vertices[good], times=WILD)
    if sigma is not None:
        good &= np.isfinite(sigma) & (sigma > 0.0)
    if good.all():
        return vertices, triangles, sigma
    index = np.cumsum(good, dtype=np.int32) - 1
    kept = triangles[good[triangles].all(axis=1)]
    return vertices[good], index[kept].astype(np.int32), None if sigma is None else sigma[good]
