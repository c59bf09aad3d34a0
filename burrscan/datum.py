"""A part frame that the user states: an inspection counted from a datum of the part itself.

Without one, sense, zero angle and origin follow from the mesh's frame (:mod:`burrscan.axis.basis`). A part
that is laid down anew has another mesh frame; its datum (ISO 5459: a keyway, a mark, the face it is mounted
by) goes with it, so that the same burr has the same angle and the same z each time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.basis import origin_mm as default_origin_mm
from burrscan.axis.basis import perpendicular_basis
from burrscan.errors import InputError
from burrscan.inspection import Axis, Burr, Generatrix, Inspection, Value

Triple = tuple[float, float, float]
_LEAST_DEG = 1.0
"""A direction so near to perpendicular to the axis does not say which way the axis points."""
_LEAST_MM = 1e-3
"""Share of the part's radius: a point so near to the axis does not say where zero is."""


@dataclass(frozen=True)
class Datum:
    """What the part frame counts from, in the frame of the mesh (for a scan: the camera frame).

    Parameters
    ----------
    zero_mm
        A point at angle zero, off the axis.
    up
        A direction along which z grows: any that is not perpendicular to the axis.
    origin_mm
        A point at z = 0, on the axis or off it.

    What is None keeps its default.

    """

    zero_mm: Triple | None = None
    up: Triple | None = None
    origin_mm: Triple | None = None


def referred_to(inspection: Inspection, datum: Datum) -> Inspection:
    """An inspection in the part frame that a datum states.

    Parameters
    ----------
    inspection
        Of any mesh.
    datum
        In the same mesh's frame.

    Returns
    -------
    Inspection
        Angles, z, the sense of the axis, its covariance and ``T_part_mesh`` are the datum's; nothing else
        changes.

    Raises
    ------
    InputError
        When the datum holds no finite numbers, its point lies on the axis, or its direction across it.

    """
    _check_finite(datum)
    old = inspection.T_part_mesh
    new = _frame(inspection, datum)
    change = new @ np.linalg.inv(old)
    return replace(
        inspection,
        axis=_axis(inspection.axis, new, change),
        generatrix=_generatrix(inspection.generatrix, change),
        burrs=tuple(_burr(burr, change) for burr in inspection.burrs),
        T_part_mesh=new,
    )


def _check_finite(datum: Datum) -> None:
    for name in ("zero_mm", "up", "origin_mm"):
        given = getattr(datum, name)
        if given is not None and (np.shape(given) != (3,) or not np.isfinite(given).all()):
            raise InputError(f"datum: {name} is {given}: three finite numbers are needed")


def _frame(inspection: Inspection, datum: Datum) -> Floats:
    """(4, 4) from the mesh to the datum's frame."""
    point, direction = inspection.axis.point_mm, inspection.axis.direction
    along = direction * _sense(direction, datum.up)
    first = (
        perpendicular_basis(direction)[:, 0] if datum.zero_mm is None else _toward(inspection, datum.zero_mm)
    )
    origin = default_origin_mm(point, direction)
    if datum.origin_mm is not None:
        origin = point + ((np.array(datum.origin_mm) - point) @ direction) * direction
    frame = np.eye(4)
    frame[:3, :3] = np.stack([first, np.cross(along, first), along])
    frame[:3, 3] = -frame[:3, :3] @ origin
    return frame


def _sense(direction: Floats, up: Triple | None) -> float:
    if up is None:
        return 1.0
    share = float(direction @ up) / max(float(np.linalg.norm(up)), 1e-300)
    if abs(share) < np.sin(np.radians(_LEAST_DEG)):
        raise InputError(
            f"datum: up {up} is perpendicular to the axis found, within {_LEAST_DEG:g} deg: "
            "give a direction that tells one end of the axis from the other"
        )
    return float(np.sign(share))


def _toward(inspection: Inspection, zero_mm: Triple) -> Floats:
    """(3,) unit vector from the axis to a point."""
    axis = inspection.axis
    away = np.array(zero_mm) - axis.point_mm
    away = away - (away @ axis.direction) * axis.direction
    length = float(np.linalg.norm(away))
    if length <= _LEAST_MM * float(np.nanmax(inspection.generatrix.r_mm, initial=0.0)) or length == 0.0:
        raise InputError(
            f"datum: zero_mm {zero_mm} lies on the axis found: give a point off it, such as a keyway"
        )
    return np.asarray(away / length)


def _axis(axis: Axis, new: Floats, change: Floats) -> Axis:
    # Tilts are turns about e1 and e2, offsets moves along them: both are vectors across the axis.
    turn = np.kron(np.eye(2), change[:2, :2])
    return replace(axis, direction=new[2, :3].copy(), covariance=turn @ axis.covariance @ turn.T)


def _generatrix(curve: Generatrix, change: Floats) -> Generatrix:
    z = change[2, 2] * curve.z_mm + change[2, 3]
    columns = (z, curve.r_mm, curve.sigma_mm, curve.band_mm)
    # Seen from the other end the material would lie to the left: the curve is walked backwards.
    return Generatrix(*(column[::-1] for column in columns)) if change[2, 2] < 0.0 else Generatrix(*columns)


def _burr(burr: Burr, change: Floats) -> Burr:
    turn = np.radians(burr.angle_deg.value)
    x, y, _ = change[:3, :3] @ [np.cos(turn), np.sin(turn), 0.0]
    ends = [
        Value(change[2, 2] * end.value + change[2, 3], end.sigma) for end in (burr.z_start_mm, burr.z_end_mm)
    ]
    start, end = ends if change[2, 2] > 0.0 else ends[::-1]
    angle = Value(float(np.degrees(np.arctan2(y, x))), burr.angle_deg.sigma)
    return replace(burr, angle_deg=angle, z_start_mm=start, z_end_mm=end)
