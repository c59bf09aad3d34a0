"""Rays of the camera and light of the projector, as Dr.Jit expressions.

The formulas are those of :class:`burrscan.rig.View`; they are written again here because they run inside the
traced kernel, and a test holds the two against each other. ``mi`` is the activated Mitsuba module: it may be
imported only after the renderer has chosen LLVM's library, hence the argument.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import numpy as np

from burrscan.rig import NO_DISTORTION, UNDISTORT_STEPS, View
from scenes.transport.optics import Optics


class Lit(NamedTuple):
    """Light that reaches surface points from the projector: its pixel, and what goes to the camera."""

    u_px: Any
    v_px: Any
    weight: Any


def _distort(view: View, x: Any, y: Any) -> tuple[Any, Any]:
    if view.distortion == NO_DISTORTION:
        return x, y
    k1, k2, p1, p2, k3 = view.distortion
    r2 = x * x + y * y
    radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    return (
        x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
        y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
    )


def _undistorted(view: View, column: Any, row: Any) -> tuple[Any, Any]:
    """Slopes of the rays through pixel coordinates."""
    x0, y0 = (column - view.cx) / view.fx, (row - view.cy) / view.fy
    x, y = x0, y0
    if view.distortion != NO_DISTORTION:
        for _ in range(UNDISTORT_STEPS):
            xd, yd = _distort(view, x, y)
            x, y = x - (xd - x0), y - (yd - y0)
    return x, y


def camera_rays(mi: Any, optics: Optics, column: Any, row: Any, lens: Any) -> Any:
    """Rays in the camera frame through pixel coordinates; ``lens`` is a point on the unit disc."""
    x, y = _undistorted(optics.rig.camera, column, row)
    if optics.camera_aperture_mm == 0.0:
        return mi.Ray3f(mi.Point3f(0.0), dr.normalize(mi.Vector3f(x, y, 1.0)))
    radius, focus = 0.5 * optics.camera_aperture_mm, optics.camera_focus_mm
    origin = mi.Point3f(radius * lens.x, radius * lens.y, 0.0)
    target = mi.Point3f(x * focus, y * focus, focus)
    return mi.Ray3f(origin, dr.normalize(target - origin))


def projected_light(mi: Any, scene: Any, optics: Optics, si: Any, lens: Any, active: Any) -> Lit:
    """Next-event estimation to the projector at surface interactions ``si``.

    The irradiance of a pixel of unit light is ``π standoff² / (z² cos θ)``: every pixel carries the same
    flux, and a white diffuser (BRDF 1/π) at the standoff returns 1. This is the radiometry of Mitsuba's
    ``projector``. A finite pupil is sampled at ``lens`` (unit disc); the ray through it meets the focus plane
    at the projector pixel that is seen: defocus and penumbra follow.
    """
    rig, view = optics.rig, optics.rig.projector
    rotation = rig.T_projector_camera[:3, :3]
    radius, focus = 0.5 * optics.projector_aperture_mm, optics.projector_focus_mm
    q = mi.Matrix3f(rotation) @ mi.Vector3f(si.p) + mi.Vector3f(rig.T_projector_camera[:3, 3])
    pupil = mi.Vector3f(radius * lens.x, radius * lens.y, 0.0) if radius else mi.Vector3f(0.0)
    origin = mi.Point3f(mi.Matrix3f(np.ascontiguousarray(rotation.T)) @ pupil) + mi.Vector3f(
        rig.projector_centre_mm
    )
    towards = origin - si.p
    distance = dr.norm(towards)
    towards /= distance
    x, y = (
        (pupil.x + (q.x - pupil.x) * (focus / q.z)) / focus,
        (pupil.y + (q.y - pupil.y) * (focus / q.z)) / focus,
    )
    x, y = _distort(view, x, y)
    u, v = x * view.fx + view.cx, y * view.fy + view.cy
    inside = (u > -0.5) & (u < view.width - 0.5) & (v > -0.5) & (v < view.height - 0.5) & (q.z > 0.0)
    irradiance = dr.pi * optics.standoff_mm**2 * distance / (q.z * q.z * q.z)
    active = active & inside
    reflected = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(towards), active)
    active &= reflected[0] > 0.0
    active &= ~scene.ray_test(si.spawn_ray_to(origin), active)
    return Lit(u, v, dr.select(active, reflected[0] * irradiance, 0.0))


def projector_rays(mi: Any, optics: Optics, column: Any, row: Any) -> Any:
    """Rays of the projector, as of a pinhole, through its pixel coordinates, in the camera frame."""
    x, y = _undistorted(optics.rig.projector, column, row)
    rotation = mi.Matrix3f(np.ascontiguousarray(optics.rig.T_projector_camera[:3, :3].T))
    towards = rotation @ mi.Vector3f(x, y, 1.0)
    return mi.Ray3f(mi.Point3f(optics.rig.projector_centre_mm), dr.normalize(towards))


def seen_light(mi: Any, scene: Any, optics: Optics, si: Any) -> tuple[Any, Any]:
    """Flat camera pixel, as of a pinhole, that sees interactions, and its light for a unit of flux there.

    A pixel sees ``distance² · Ω`` of the surface, square to its ray; its solid angle is ``cos³ θ / (fx fy)``.
    """
    view = optics.rig.camera
    x, y = _distort(view, si.p.x / si.p.z, si.p.y / si.p.z)
    column = mi.Int32(dr.floor(x * view.fx + view.cx + 0.5))
    row = mi.Int32(dr.floor(y * view.fy + view.cy + 0.5))
    inside = (column >= 0) & (column < view.width) & (row >= 0) & (row < view.height) & (si.p.z > 0.0)
    inside &= si.is_valid()
    distance = dr.norm(si.p)
    reflected = si.bsdf().eval(mi.BSDFContext(), si, si.to_local(-si.p / distance), inside)[0]
    inside &= reflected > 0.0
    inside &= ~scene.ray_test(si.spawn_ray_to(mi.Point3f(0.0)), inside)
    light = reflected * (view.fx * view.fy * distance / (si.p.z * si.p.z * si.p.z))
    return dr.select(inside, mi.UInt32(row * view.width + column), 0), dr.select(inside, light, 0.0)
