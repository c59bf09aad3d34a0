"""From vertices that belong to a burr to everything that is said of it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.burrs.edges import SHARP, normals_at, on_edge
from burrscan.burrs.field import Field
from burrscan.burrs.height import volume
from burrscan.burrs.pose import pose_on_surface
from burrscan.burrs.shape.along import height_of
from burrscan.burrs.shape.crest import crest_of, with_tip
from burrscan.burrs.shape.grid_posterior import STEEPEST
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import Ridge, first_ridge, fit_ridge, misfit_of
from burrscan.generatrix.polyline import turned
from burrscan.inspection import Axis, Burr, Value, side_of
from burrscan.turns import turn_rad

_ELONGATED = 1.3
"""Below this ratio of its two standard deviations a region has no direction of its own: along the curve."""
_STRETCH = 4.0
"""Least length over which a crest's height is stated, in spacings of the vertices. With 6 the tops of torn
burrs are lost (95 % of heights 0.49 instead of 0.45 mm), 3 gains nothing."""
_LEAST_SIGNIFICANCE = 4.0
"""In noise deviations of the height: lower lets noise through as burrs, higher loses faint ones."""
NO_TRIANGLE = 0.02
"""Share of a burr's height by which it departs from the simple cross-sections that are fitted."""
_NO_TRIANGLE_SHARED = 0.01
"""The part of it that is the same all along the burr: no number of vertices takes it off. Of 40 drawn burrs
without any noise the heights are 0.4 % off in the median, 2.4 in all but one, which is 5.7."""
_NO_HEIGHT = 0.5
"""Share of a burr's height by which heights in corners of the part may be wrong."""
_MOST_CORNERED = 0.35
"""Share of a burr's vertices: with more of them left out, the rest tells neither height nor width."""
_LEAST_EXPLAINED = 0.5
"""Share of a nick's squared deviations that its description explains: with less it leaves more than that.
Where metal is missing each place has one depth, and one ridge is like it: of 42 nicks, rough ones too, all
had 0.85 or more. A burr that is rolled over has two heights at one place, and a torn one many along it: of
such down to 0.26 is explained, so nothing is asked of them. Nor of nicks that a scan shows: walls that mirror
each other have two depths at one place, too (0.43 of one on turned copper), and its light tells of them."""
_DIFFER = 2.0
"""Standard deviations between a ridge's height and a crest's from which the ridge is not what is there."""
_NO_PEDESTAL = 1.5
"""Crest over ridge from which the ridge that fits is not what stands there. Of 13 burrs, seven had 1.16 at
most, and the six that had more read 0.15 to 0.75 of their height."""
_LEAST_OF_CREST = 0.1
"""Share of a crest that its ridge is at least: of those six burrs it was 0.15 and more. On turned metal a
mound of errors that pixels share, 0.02 mm high and 9 mm wide, had a burr of 1.2 mm near its border, and was
called as high as that in its own middle."""
_OF_NOISE = 2.5
"""Standard deviations by which noise alone lifts the highest of a slice's vertices over the others."""
_UNRESOLVED = 0.5
"""Share of a crest by which a burr may be higher or lower: a pixel as wide as its base shows half of it."""
_TELLS_FRAMES = 1.5
"""Half-width, in vertex spacings, from which the first triangles tell which frame is the burr's."""
_GRAZED = 0.1
"""Cosine between line of sight and normal, over the largest of a burr's, below which slants are held: what
turns away so far is seen at a corner, and is no part of the burr."""
_SAME_RADIUS = 0.03
"""Share by which the radius may change along a burr before width and angle must be told apart."""


@dataclass(frozen=True)
class Site:
    """Where a burr is.

    Parameters
    ----------
    chosen
        (M,) vertices of the field around it.
    on
        (M,) True for those that belong to it.
    sign
        +1 for material too much, -1 for material missing.
    significance
        The detection statistic over its noise.
    inflation
        How much the noise of a mean of many vertices exceeds what independent noise would give.

    """

    chosen: Ints
    on: Bools
    sign: int
    significance: float
    inflation: float = 1.0


@dataclass(frozen=True)
class _Frame:
    """A burr's own frame on the unrolled surface.

    Origin (angle, arc length), direction along it as (around, along), the radius (M,) by which each vertex's
    angle is made a length, the vertices' places, and their distance across the burr.
    """

    angle: float
    direction: Floats
    radius: Floats
    patch: Patch
    across_mm: float


class Eye(NamedTuple):
    """The camera that sees a surface: its centre (3,), part frame, and the angle of a pixel, radians."""

    at_mm: Floats
    pixel_rad: float


def describe(
    field: Field, site: Site, axis: Axis, *, facing: float = 0.0, eye: Eye | None = None
) -> Burr | None:
    """Measure a burr; None where no ridge rises out of the noise, or none is like it. O(vertices chosen).

    ``facing`` is the cosine at which a camera looks at the surface below, whose pixels the vertices are: 1
    where it looks down on the burr. 0 where nobody knows of one. ``eye`` is the camera of a scan, whose
    vertices are means over its pixels; None for a mesh of which nobody knows how it was seen. What was
    scanned by light may have two depths at one place.
    """
    lift = site.sign * field.deviation_mm[site.chosen]
    weight = np.where(site.on, np.clip(lift, 0.0, None), 0.0)
    if not weight.any():
        return None
    edged = on_edge(field, site.chosen[site.on], site.sign)
    frame, ridge = _best(field, site, lift, weight, edged=edged, eye=eye)
    if ridge is None or not _credible(ridge):
        return None
    one_depth = site.sign < 0 and eye is None
    if one_depth and _explained(field, site, frame.patch, ridge) < _LEAST_EXPLAINED:
        return None
    height = _height(field, site, ridge, frame, edged=edged, facing=facing)
    if not edged and ridge.height_mm < _LEAST_OF_CREST * height.value:
        return None
    return _burr(field, site, ridge, frame, height, axis)


def _credible(ridge: Ridge) -> bool:
    """Whether the ridge rises out of the noise, is known at all, and is no spike."""
    known = ridge.height_mm > 2.0 * ridge.sigma_of([1, 0, 0, 0, 0])
    clear = ridge.height_mm > _LEAST_SIGNIFICANCE * ridge.noise_mm
    return known and clear and ridge.height_mm < STEEPEST * ridge.width_mm


def _explained(field: Field, site: Site, patch: Patch, ridge: Ridge) -> float:
    """Share of what an anomaly's own vertices deviate by that its ridge explains (R², noise taken off both).

    Beyond the ridge's ends nothing is explained. 1 where noise explains it all: nothing is left.
    """
    on, u = site.on, patch.u_mm
    model = np.where((u >= ridge.start_mm) & (u <= ridge.end_mm), ridge.height_mm * ridge.shape(patch), 0.0)
    noise = np.maximum(field.local_mm, field.stated_mm)[site.chosen[on]]
    lift, expected = patch.lift_mm[on], float(noise @ noise)
    every = float(lift @ lift) - expected
    left = float(((lift - model[on]) ** 2).sum()) - expected
    return 1.0 - max(left, 0.0) / every if every > 0.0 else 1.0


def _best(
    field: Field, site: Site, lift: Floats, weight: Floats, *, edged: bool, eye: Eye | None
) -> tuple[_Frame, Ridge | None]:
    """The fit of a ridge of constant width, or of constant angle where the radius changes along the burr."""
    local = np.maximum(field.foot[site.chosen, 1], 1e-9)
    mean = float((weight * local).sum() / weight.sum())
    radii = [local]
    if np.ptp(local[site.on]) >= _SAME_RADIUS * mean:
        radii.append(np.full(len(local), mean))
    frames = [_framed(field, site, lift, weight, radius, edged=edged, eye=eye) for radius in radii]
    firsts = [(frame, _first(site, frame)) for frame in frames]
    fits = [(frame, ridge) for frame, ridge in firsts if ridge is not None]
    if not fits:
        return frames[0], None
    if all(ridge.parameters[3] > _TELLS_FRAMES * frame.across_mm for frame, ridge in fits):
        fits = [min(fits, key=_misfit)]
    return min(
        ((frame, fit_ridge(frame.patch, ridge, spacing_mm=frame.across_mm)) for frame, ridge in fits),
        key=_misfit,
    )


def _misfit(fit: tuple[_Frame, Ridge]) -> float:
    return misfit_of(fit[0].patch, fit[1])


def _first(site: Site, frame: _Frame) -> Ridge | None:
    u = frame.patch.u_mm[site.on]
    return first_ridge(frame.patch, spacing_mm=frame.across_mm, start=(float(u.min()), float(u.max())))


def _framed(
    field: Field,
    site: Site,
    lift: Floats,
    weight: Floats,
    radius: Floats,
    *,
    edged: bool,
    eye: Eye | None,
) -> _Frame:
    angle = field.angle[site.chosen]
    middle = float(np.angle((weight * np.exp(1j * angle)).sum()))
    x = turn_rad(angle - middle) * radius
    y = field.along_mm[site.chosen] - (weight * field.along_mm[site.chosen]).sum() / weight.sum()
    direction = _direction(x, y, weight)
    a, b = direction
    high = float(np.quantile(lift[site.on], 0.9))
    sigma = np.hypot(field.sigma_mm[site.chosen] * site.inflation, NO_TRIANGLE * high)
    if not edged:
        cornered = _cornered(field, site, high)
        sigma[cornered] = np.hypot(sigma[cornered], _NO_HEIGHT * high)
    patch = Patch(x * a + y * b, y * a - x * b, lift, sigma)
    if eye is not None and not edged:
        patch = _seen_by(eye, patch, field, site, direction)
    return _Frame(middle, direction, radius, patch, _across_mm(field, site, direction))


def _seen_by(eye: Eye, patch: Patch, field: Field, site: Site, direction: Floats) -> Patch:
    """The patch with each vertex where its line of sight meets the surface below the burr."""
    angle, normal = field.angle[site.chosen], field.normal[site.chosen]
    along = np.stack([normal[:, 1], -normal[:, 0]], axis=1)  # the curve's direction, (z, r)
    around = np.stack([-np.sin(angle), np.cos(angle), np.zeros(len(angle))], axis=1)
    towards = eye.at_mm - turned(field.foot[site.chosen], angle)
    across = direction[0] * turned(along, angle) - direction[1] * around
    up = (towards * turned(normal, angle)).sum(axis=1)
    slant = site.sign * (towards * across).sum(axis=1) / np.maximum(up, _GRAZED * np.abs(up).max())
    middle = float(np.median(slant[site.on]))
    far = float(np.median(np.linalg.norm(towards, axis=1)))
    return replace(
        patch,
        v_mm=patch.v_mm - slant * patch.lift_mm,
        slant=middle,
        pixel_mm=far * eye.pixel_rad * float(np.hypot(1.0, middle)),
        sunk=site.sign < 0,
    )


def _across_mm(field: Field, site: Site, direction: Floats) -> float:
    """Distance between vertices across a burr: the usual one, or more on a surface that is grazed."""
    pitch = field.pitch_mm[site.chosen[site.on]]
    pitch = pitch[np.isfinite(pitch).all(axis=1)]
    if not len(pitch):
        return field.spacing_mm
    return max(field.spacing_mm, float(np.abs(direction) @ np.median(pitch, axis=0)))


def _cornered(field: Field, site: Site, high: float) -> Bools:
    """(M,) True for vertices so near a corner of the generatrix that a burr's heights are not seen there.

    In a corner the nearest place on the curve is not the one below. Not where much of the burr is in corners:
    burrs along an edge are known by nothing else.
    """
    along, normal = field.along_mm[site.chosen], field.normal[site.chosen]
    beside = normals_at(field, site.chosen, along - high, along + high)
    cornered: Bools = np.minimum(*((normal * other).sum(axis=1) for other in beside)) < SHARP
    few = np.count_nonzero(cornered & site.on) < _MOST_CORNERED * np.count_nonzero(site.on)
    return cornered if few else np.zeros_like(cornered)


def _direction(x: Floats, y: Floats, weight: Floats) -> Floats:
    """Unit vector (around, along) of the region's longer side; along the curve where it has none.

    Of its two senses the one that noise leaves alone where burrs lie: around the axis, and along the curve.
    """
    xx, yy, xy = (float((weight * product).sum() / weight.sum()) for product in (x * x, y * y, x * y))
    mean, half = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
    if mean + half < _ELONGATED**2 * (mean - half):
        return np.array([0.0, 1.0])
    turn = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    direction = np.array([np.cos(turn), np.sin(turn)])
    return direction if direction.sum() > 0.0 else -direction


def _burr(field: Field, site: Site, ridge: Ridge, frame: _Frame, height: Value, axis: Axis) -> Burr:
    end_sigma = 0.4 * field.spacing_mm
    length = Value(ridge.end_mm - ridge.start_mm, end_sigma * np.sqrt(2.0))
    area = _area(ridge)
    angle, vertex = _middle(site, ridge, frame, field.spacing_mm)
    z_low, z_high = _reach_z(field, site, frame, ridge, vertex)
    return Burr(
        side=side_of(site.sign),
        angle_deg=Value(float(np.degrees(angle.value)), float(np.degrees(angle.sigma))),
        z_start_mm=Value(z_low, end_sigma),
        z_end_mm=Value(z_high, end_sigma),
        height_mm=height,
        width_mm=Value(ridge.width_mm, ridge.sigma_of([0, 0, 0, 2, 0])),
        length_mm=length,
        area_mm2=area,
        volume_mm3=volume(area, length),
        T_mesh_burr=pose_on_surface(
            field.foot[vertex], field.normal[vertex], float(angle.value), frame.direction, axis
        ),
        significance=site.significance,
    )


def _height(field: Field, site: Site, ridge: Ridge, frame: _Frame, *, edged: bool, facing: float) -> Value:
    """Largest height along the burr: the ridge's, or on an edge that of the crest where the two differ.

    Elsewhere, too, where what stands up is a pedestal with something much higher on it: pixels that hold a
    part of a burr no wider than they are, and of its shadow.
    """
    patch = frame.patch
    most, sigma = height_of(patch, ridge, row_mm=field.spacing_mm)
    known = float(np.hypot(sigma, _NO_TRIANGLE_SHARED * most))
    height = Value(most, float(np.hypot(known, ridge.open_mm)))
    if not edged and site.sign < 0:
        return height
    own = field.local_mm[site.chosen]  # a crest is often the border of what is seen, whose sigma is another
    on = replace(patch, sigma_mm=own).of(site.on)
    extent = ridge.start_mm, ridge.end_mm
    crest = crest_of(on, extent, spacing_mm=field.spacing_mm, least_mm=_STRETCH * field.spacing_mm)
    if crest is None:
        return height
    if not edged:
        if crest.value - _OF_NOISE * float(np.median(on.sigma_mm)) <= _NO_PEDESTAL * height.value:
            return height
        return Value(crest.value, float(np.hypot(crest.sigma, _UNRESOLVED * crest.value)))
    pixel_mm = max(facing, 0.0) * frame.across_mm
    crest = with_tip(crest, width_mm=ridge.width_mm, footprint_mm=pixel_mm)
    # what a footprint leaves open chooses neither, and where both agree the crest, with its tip, closes it
    off = abs(crest.value - most)
    if off > _DIFFER * float(np.hypot(crest.sigma, known)) or crest.sigma < known:
        return crest
    return Value(most, min(height.sigma, max(crest.sigma, off)))


def _area(ridge: Ridge) -> Value:
    """Cross-section area."""
    h, w, full = ridge.height_mm, ridge.width_mm, ridge.fullness
    return Value(ridge.area_mm2, full * ridge.sigma_of([w, 0, 0, 2.0 * h, 0]))


def _middle(site: Site, ridge: Ridge, frame: _Frame, spacing: float) -> tuple[Value, int]:
    """Angle (radians) of the middle of the burr's base, and the vertex nearest to it."""
    u = 0.5 * (ridge.start_mm + ridge.end_mm)
    v = ridge.base_middle_mm(u)
    nearest = int(np.argmin((frame.patch.u_mm - u) ** 2 + (frame.patch.v_mm - v) ** 2))
    radius = float(frame.radius[nearest])
    a, b = frame.direction
    angle = turn_rad(frame.angle + (u * a - v * b) / radius)
    across = ridge.sigma_of([0, 1, u, 0, ridge.parameters[3]])
    return Value(angle, float(np.hypot(across * b, 0.3 * spacing * a)) / radius), int(site.chosen[nearest])


def _reach_z(field: Field, site: Site, frame: _Frame, ridge: Ridge, vertex: int) -> tuple[float, float]:
    """Least and greatest axial position under the burr, its middle (below ``vertex``) included.

    What runs around the wheel and stands up along the axis reaches as far as it stands up: on the edge of an
    end face nothing is under it.
    """
    patch = frame.patch
    on = (ridge.shape(patch) > 0.0) & (patch.u_mm >= ridge.start_mm) & (patch.u_mm <= ridge.end_mm)
    under = site.chosen[on] if on.any() else site.chosen
    z = np.append(field.foot[under, 0], field.foot[vertex, 0])
    if site.sign > 0 and abs(frame.direction[0]) > abs(frame.direction[1]):
        stands = site.chosen[site.on]
        z = np.append(z, field.foot[stands, 0] + field.deviation_mm[stands] * field.normal[stands, 0])
    return float(z.min()), float(z.max())
