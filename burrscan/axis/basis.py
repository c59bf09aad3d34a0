"""The one part frame: sense of the axis, zero angle and origin, shared by everything that states them.

A direction fitted to a part is a line without sense, and no rule gives every line a sense and a perpendicular
without a jump somewhere (the hairy ball theorem is one reason, the projective plane another). The rule here
has one cut only, put where nobody has an axis on purpose:

- *Sense*: the axis points to the side where ``x + 2 y + 4 z`` of the mesh frame is positive. The cut is the
  plane of the directions where it is zero. It stays 12.6° clear of the coordinate axes, 8.8° of the
  diagonals of a cube's faces and 7.2° of the diagonals of the cube.
- *Zero angle*: the part frame is the mesh frame turned by the smallest rotation that takes the mesh's z axis
  to the axis (Frisvad 2012; Duff et al. 2017). On the kept side of the cut this is continuous everywhere: a
  tilt of the axis turns the frame about it by no more than 1.71 times itself, where the cut is farthest
  from z, and by nothing for an axis along z. Zero is at the mesh's +x for an axis along z or y, and at -z for
  one along x.
- *Origin*: z is zero at the foot of the perpendicular from the mesh's own origin (for a scan: the camera).
  So z of a part that is drawn along z is the drawing's z.
"""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats

SENSE = (1.0, 2.0, 4.0)
"""The side of the mesh frame that an axis points to; see the module."""
_STRAIGHT_DOWN = 1e-14
"""Nearer to -z than this (1 + its z), the smallest rotation from z is no longer determined."""


def sensed(direction: Floats) -> Floats:
    """A (3,) direction with the sense that the module states."""
    x, y, z = direction
    a, b, c = SENSE
    return direction if a * x + b * y + c * z >= 0.0 else -direction


def perpendicular_basis(direction: Floats) -> Floats:
    """Two unit vectors perpendicular to ``direction``, as the columns of a (3, 2) array.

    ``(e1, e2, direction)`` is right-handed: the mesh's axes after the smallest rotation of z to the
    direction. Continuous for every direction but -z, which :func:`sensed` never gives.
    """
    x, y, z = (float(part) for part in direction)
    if 1.0 + z < _STRAIGHT_DOWN:
        return np.array([[1.0, 0.0], [0.0, -1.0], [0.0, 0.0]])
    share = 1.0 / (1.0 + z)
    return np.array([[1.0 - share * x * x, -share * x * y], [-share * x * y, 1.0 - share * y * y], [-x, -y]])


def T_part_mesh(point_mm: Floats, direction: Floats) -> Floats:  # noqa: N802
    """4×4 motion from the mesh to the part frame of an axis through ``point_mm``; see the module."""
    basis = perpendicular_basis(direction)
    rotation = np.stack([basis[:, 0], basis[:, 1], direction])
    transform = np.eye(4)
    transform[:3, :3] = rotation
    transform[:2, 3] = -rotation[:2] @ point_mm
    return transform


def origin_mm(point_mm: Floats, direction: Floats) -> Floats:
    """(3,) the part frame's origin in the mesh frame: the point of the axis nearest to the mesh's origin."""
    foot: Floats = point_mm - (point_mm @ direction) * direction
    return foot
