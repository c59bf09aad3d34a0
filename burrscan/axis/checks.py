"""Secondary tests of an axis, as the conclusion of the seed paper asks."""

from __future__ import annotations

import numpy as np

from burrscan.arrays import Floats, Ints, Ints32
from burrscan.axis.basis import perpendicular_basis
from burrscan.axis.fitting.starts import WIDTH, angle_cost, candidate_axes
from burrscan.axis.jit import kernel
from burrscan.axis.points.cloud import canonical_cloud, moments, voxel_moments
from burrscan.axis.points.surfels import Surfels, surfels_of
from burrscan.axis.sections import fit_circles, sections
from burrscan.inspection import Axis, Check
from burrscan.robust import SIGMA_PER_MEDIAN

PLANES = 20
"""Sections across the axis: twice the seed paper's ten, so that the four good circles needed are left on a
burred part."""
LARGEST_LEAN = 0.02
"""Lean of the line of centres, rad: what a few short arcs can be wrong by."""
LEAST_MARGIN = 1.2
"""Cost of the next best axis over this one's. 1 is a tie; nearer to it more doubtful axes pass unmarked."""
LARGEST_WAVE = 1.0
"""In robust spreads: where the deviations swing by more than their noise, once around, the axis is beside
the middle."""


def axis_checks(
    vertices_mm: Floats, faces: Ints32, axis: Axis, *, deviation_mm: Floats | None = None
) -> tuple[Check, ...]:
    """Secondary tests of a solution.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3) finite positions and (T, 3).
    axis
        The solution.
    deviation_mm
        (V,) distance of each vertex from the generatrix, NaN where none is stated; needed for the last test.

    Returns
    -------
    Of "determined", "centres_collinear", "centres_box", "landscape_margin" and "residual_symmetry" those
    that the data allow. O(V + T).

    """
    checks = [_determined(axis), _margin(vertices_mm, axis)]
    if len(faces):
        checks += _centres(vertices_mm, faces, axis)
    if deviation_mm is not None:
        checks.append(_symmetry(vertices_mm, axis, deviation_mm))
    return tuple(checks)


def _determined(axis: Axis) -> Check:
    open_ = ", ".join(axis.undetermined) or "nothing"
    return Check(
        "determined", not axis.undetermined, float(len(axis.undetermined)), 0.0, "",
        f"the data leave {open_} of the axis open",
    )  # fmt: skip


def _centres(vertices: Floats, faces: Ints32, axis: Axis) -> list[Check]:
    """Whether circle centres of sections across the axis lie along it, and the box around them."""
    e = perpendicular_basis(axis.direction)
    turn = np.stack([e[:, 0], e[:, 1], axis.direction])
    centred = vertices - axis.point_mm
    size = float(np.sqrt(np.trace(moments(vertices)[1])))
    state: Ints = np.array([1], dtype=np.int64)
    points, index = sections(centred, faces, turn, planes=PLANES, every=True)
    circles = fit_circles(points, index, PLANES, 0.02 * size, 0, True, True, state)
    good = circles[np.isfinite(circles[:, 3]) & (circles[:, 7] < 0.5)]
    if len(good) < 4:
        return []
    # A short arc tells its centre badly along its middle; the median and Theil's slope survive that.
    middle = np.median(good[:, :2], axis=0)
    box = 2.0 * np.median(np.abs(good[:, :2] - middle), axis=0)
    first, second = np.triu_indices(len(good), k=1)
    step = good[second, :3] - good[first, :3]
    step = step[np.abs(step[:, 2]) > 1e-9 * size]  # several circles may lie in one plane
    if not len(step):
        return []
    lean = float(np.hypot(*np.median(step[:, :2] / step[:, 2:], axis=0)))
    return [
        Check(
            "centres_collinear", lean < LARGEST_LEAN, float(np.degrees(lean)),
            float(np.degrees(LARGEST_LEAN)), "deg",
            "circles through sections across the axis have their centres along it",
        ),
        Check(
            "centres_box", float(box.max()) < 0.05 * size, float(box.max()), 0.05 * size, "mm",
            "half of those centres lie in a box of this side across the axis",
        ),
    ]  # fmt: skip


def _margin(vertices: Floats, axis: Axis) -> Check:
    """How much worse the next minimum of the landscape of axes is than this one."""
    cloud = canonical_cloud(np.ascontiguousarray(vertices), None)
    surfels = surfels_of(*voxel_moments(cloud.points, cloud.weights))
    direction = cloud.rotation.T @ axis.direction
    place = cloud.rotation.T @ (axis.point_mm - cloud.mean_mm) / cloud.scale_mm
    own = _cost(surfels, direction, place)
    candidates, _ = candidate_axes(surfels)
    others = [cost for a, _, cost in candidates if abs(a @ direction) < np.cos(np.radians(3.0))]
    ratio = min(others) / max(own, 1e-12) if others else np.inf
    return Check(
        "landscape_margin", bool(ratio > LEAST_MARGIN), float(min(ratio, 1e6)), LEAST_MARGIN, "",
        "cost of the next best axis, more than 3 degrees away, over the cost of this one",
    )  # fmt: skip


def _cost(surfels: Surfels, direction: Floats, place: Floats) -> float:
    return float(angle_cost(surfels.points, surfels.normals, surfels.weights, direction, place, WIDTH))


def _symmetry(vertices: Floats, axis: Axis, deviation: Floats) -> Check:
    """The first harmonic of the deviations around the axis, as a wrong axis would leave it."""
    amount = np.abs(deviation[np.isfinite(deviation)])
    sigma = SIGMA_PER_MEDIAN * float(np.median(amount)) if len(amount) > 3 else 0.0
    share = 0.0
    if sigma > 0.0:
        e = perpendicular_basis(axis.direction)
        normal, right = _wave_equations(vertices, axis.point_mm, e, deviation, 3.0 * sigma)
        wave = np.linalg.lstsq(normal, right, rcond=1e-10)[0]
        share = _swing(normal, wave) / sigma
    return Check(
        "residual_symmetry", share < LARGEST_WAVE, share, LARGEST_WAVE, "",
        "swing of the deviations once around the axis, over their robust spread",
    )  # fmt: skip


@kernel
def _around(vertices: Floats, i: int, point: Floats, e: Floats) -> tuple[float, float]:
    """Cosine and sine of a vertex's angle about the axis."""
    a, b, c = vertices[i, 0] - point[0], vertices[i, 1] - point[1], vertices[i, 2] - point[2]
    x = a * e[0, 0] + b * e[1, 0] + c * e[2, 0]
    y = a * e[0, 1] + b * e[1, 1] + c * e[2, 1]
    r = max(np.sqrt(x * x + y * y), 1e-300)
    return x / r, y / r


@kernel
def _wave_equations(
    vertices: Floats, point: Floats, e: Floats, deviation: Floats, limit: float
) -> tuple[Floats, Floats]:
    """Normal equations of a + b cos + c sin through the deviations, each cut off at ``limit``."""
    normal, right, row = np.zeros((3, 3)), np.zeros(3), np.ones(3)
    for i in range(len(deviation)):
        if not np.isfinite(deviation[i]):
            continue
        row[1], row[2] = _around(vertices, i, point, e)
        d = min(max(deviation[i], -limit), limit)
        for j in range(3):
            right[j] += row[j] * d
            for k in range(3):
                normal[j, k] += row[j] * row[k]
    return normal, right


def _swing(normal: Floats, wave: Floats) -> float:
    """Peak to peak of the sine that has as much power as the wave has over the data (its normal matrix)."""
    centred = normal[1:, 1:] - np.outer(normal[0, 1:], normal[0, 1:]) / normal[0, 0]
    power = float(wave[1:] @ centred @ wave[1:]) / float(normal[0, 0])
    return float(np.sqrt(8.0 * max(power, 0.0)))
