"""A range scan as a shaded picture: triangles seen from far away, each pixel the nearest one."""

from __future__ import annotations

import numpy as np
from numba import njit

from burrscan.arrays import Floats, Floats32, Ints32, Levels

BACKGROUND = 236
"""Grey of what is no mesh: lighter than any shade."""
_LIGHT = np.array([0.35, -0.45, 0.82])
"""Direction towards the light in the viewer's frame; of unit length to 0.2 %."""


@njit(cache=True)  # type: ignore[untyped-decorator]
def _rasterised(
    points: Floats, faces: Ints32, tone: Floats, height: int, width: int
) -> Floats32:  # pragma: no cover
    """(height, width) tone of the nearest triangle (largest third coordinate), NaN where there is none."""
    depth = np.full((height, width), -np.inf)
    image = np.full((height, width), np.nan, np.float32)
    for t in range(len(faces)):
        a, b, c = points[faces[t, 0]], points[faces[t, 1]], points[faces[t, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(area) < 1e-12:
            continue
        left = max(int(np.ceil(min(a[0], b[0], c[0]))), 0)
        right = min(int(np.floor(max(a[0], b[0], c[0]))), width - 1)
        top = max(int(np.ceil(min(a[1], b[1], c[1]))), 0)
        bottom = min(int(np.floor(max(a[1], b[1], c[1]))), height - 1)
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
                v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
                w = 1.0 - u - v
                inside = u >= -1e-9 and v >= -1e-9 and w >= -1e-9
                z = u * a[2] + v * b[2] + w * c[2]
                nearer = inside and z > depth[y, x]
                depth[y, x] = z if nearer else depth[y, x]
                image[y, x] = tone[t] if nearer else image[y, x]
    return image


def shaded(
    vertices_mm: Floats,
    faces: Ints32,
    view: Floats,
    *,
    frame_mm: tuple[Floats, Floats],
    width: int = 420,
) -> Levels:
    """A mesh in grey, lit from above left.

    Parameters
    ----------
    vertices_mm, faces
        (V, 3), (T, 3).
    view
        (3, 3) rows: right, up and towards the viewer.
    frame_mm
        Lower left and upper right corner (2,) of the picture, along right and up.
    width
        Of the picture, pixels.

    Returns
    -------
    (h, width) grey levels.

    """
    low, high = frame_mm
    scale = width / float(high[0] - low[0])
    height = max(round(scale * float(high[1] - low[1])), 1)
    seen = vertices_mm @ view.T
    places = np.column_stack(
        [(seen[:, 0] - low[0]) * scale - 0.5, (high[1] - seen[:, 1]) * scale - 0.5, seen[:, 2]]
    )
    image = _rasterised(np.ascontiguousarray(places), faces, _tones(seen, faces), height, width)
    grey = np.where(np.isfinite(image), image * 190.0 + 20.0, BACKGROUND)
    return np.asarray(np.clip(grey, 0, 255), np.uint8)


def _tones(seen: Floats, faces: Ints32) -> Floats:
    """(T,) brightness 0 to 1 of each triangle by the cosine to the light; both sides are lit."""
    a, b, c = (seen[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    facing = np.where(normal[:, 2] < 0.0, -1.0, 1.0)
    cosine = facing * (normal @ (_LIGHT * [1.0, -1.0, 1.0])) / length / np.linalg.norm(_LIGHT)
    return np.asarray(np.clip(0.15 + 0.85 * np.maximum(cosine, 0.0), 0.0, 1.0))


def view_from(*, azimuth_deg: float, elevation_deg: float) -> Floats:
    """(3, 3) rows right, up, towards the viewer; z stays upright, azimuth 0 looks from +x."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def frame_of(points_mm: Floats, view: Floats, *, margin: float = 0.04) -> tuple[Floats, Floats]:
    """Corners of a picture that holds nearly all points; strays are left out."""
    low, high = np.quantile(points_mm @ view[:2].T, [0.001, 0.999], axis=0)
    room = margin * float((high - low).max())
    return low - room, high + room
