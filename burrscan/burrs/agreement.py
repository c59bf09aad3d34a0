"""Whether what a burr method says of a burr is one statement: angle, extent and pose of the same place.

Everything downstream (scores, reports, a robot) takes the place from one of the three; a method that states
them apart would be right in one table and wrong in another.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from burrscan.arrays import Floats
from burrscan.errors import InputError
from burrscan.inspection import Burr, Value
from burrscan.turns import turn_deg

WITHIN_DEG = 0.1
"""Angles stated twice may differ by so much: two estimates of one place, not two places."""
WITHIN_MM = 0.1
"""The pose may lie beyond the stated extent by so much, or by three of its standard deviations."""
_RIGID = 1e-6
"""Largest entry of RᵀR - 1 and of the last row: single precision rounds by less; a scale or shear of a
millionth is none."""
_FRAME = "the part frame, T_part_mesh(axis.point_mm, axis.direction) of burrscan.axis.basis"


def agreed(burrs: Any, T_part_mesh: Floats, *, method: str) -> tuple[Burr, ...]:
    """The burrs of a method, each stated once.

    Parameters
    ----------
    burrs
        What the method returned.
    T_part_mesh
        (4, 4) the part frame that angles and extents count in.
    method
        Its name, for the message.

    Returns
    -------
    tuple of Burr
        Where a burr has a pose and no angle, the angle is the pose's, its sigma not stated.

    Raises
    ------
    InputError
        When this is no tuple of :class:`Burr`, or a burr states no place, or two. It names the burr, both
        values and what to do.

    """
    if not isinstance(burrs, tuple | list) or not all(isinstance(burr, Burr) for burr in burrs):
        raise InputError(f"burrs method '{method}': must return a tuple of burrscan.Burr, not {_kind(burrs)}")
    return tuple(_agreed(b, T_part_mesh, f"burrs method '{method}': burr {i}") for i, b in enumerate(burrs))


def _kind(burrs: Any) -> str:
    if not isinstance(burrs, tuple | list):
        return type(burrs).__name__
    strange = next(type(burr).__name__ for burr in burrs if not isinstance(burr, Burr))
    return f"a {type(burrs).__name__} that holds {strange}"


def _agreed(burr: Burr, T_part_mesh: Floats, who: str) -> Burr:
    if burr.side not in {"protrusion", "nick"}:
        raise InputError(f"{who}: side is '{burr.side}': say 'protrusion' or 'nick'")
    start, end = burr.z_start_mm.value, burr.z_end_mm.value
    if start > end:
        raise InputError(f"{who}: z_start_mm {start:.3f} is above z_end_mm {end:.3f}: swap them")
    pose = np.asarray(burr.T_mesh_burr, dtype=np.float64)
    if pose.shape != (4, 4):
        raise InputError(f"{who}: T_mesh_burr has the shape {pose.shape}: state a (4, 4) pose, or NaN")
    if not np.isfinite(pose).all():
        if not np.isfinite(burr.angle_deg.value):
            raise InputError(
                f"{who}: neither angle_deg nor T_mesh_burr is stated: state one of them, or no burr"
            )
        return burr
    _check_rigid(pose, who)
    x, y, z = (T_part_mesh @ pose)[:3, 3]
    _check_extent(burr, float(z), who)
    return _with_angle(burr, float(np.degrees(np.arctan2(y, x))), who)


def _check_rigid(pose: Floats, who: str) -> None:
    turn = pose[:3, :3]
    off = max(
        float(np.abs(turn.T @ turn - np.eye(3)).max()), float(np.abs(pose[3] - [0.0, 0.0, 0.0, 1.0]).max())
    )
    if off > _RIGID or np.linalg.det(turn) < 0.0:
        raise InputError(f"{who}: T_mesh_burr is no rigid motion: orthonormal right-handed axes are needed")


def _check_extent(burr: Burr, z: float, who: str) -> None:
    for name, end, beyond in (("z_start_mm", burr.z_start_mm, -1.0), ("z_end_mm", burr.z_end_mm, 1.0)):
        sigma = end.sigma if np.isfinite(end.sigma) else 0.0
        if beyond * (z - end.value) > max(WITHIN_MM, 3.0 * sigma):
            raise InputError(
                f"{who}: {name} is {end.value:.3f}, but T_mesh_burr lies at z = {z:.3f} mm: "
                f"count extents in {_FRAME}"
            )


def _with_angle(burr: Burr, angle_deg: float, who: str) -> Burr:
    stated = burr.angle_deg.value
    if not np.isfinite(stated):
        return replace(burr, angle_deg=Value(angle_deg, float("nan")))
    if abs(turn_deg(stated - angle_deg)) > WITHIN_DEG:
        raise InputError(
            f"{who}: angle_deg is {stated:.3f}, but T_mesh_burr lies at {angle_deg:.3f} deg: "
            f"state one place, in {_FRAME}, or NaN for what is not known"
        )
    return burr
