"""A range scan as a shaded picture: triangles seen from far away, the nearest on top."""

from __future__ import annotations

import numpy as np

from bench.plotting.pictures import painted
from burrscan.arrays import Floats, Ints32, Levels

BACKGROUND = 236
"""Grey of what is no mesh: lighter than any shade."""
_WIDTH = 420  # of a picture, pixels: the file stays small
_LIGHT = np.array([0.35, -0.45, 0.82])
"""Direction towards the light in the viewer's frame; of unit length to 0.2 %."""


def shaded(
    vertices_mm: Floats,
    faces: Ints32,
    view: Floats,
    *,
    frame_mm: tuple[Floats, Floats],
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

    Returns
    -------
    (h, 420) grey levels.

    """
    low, high = frame_mm
    scale = _WIDTH / float(high[0] - low[0])
    height = max(round(scale * float(high[1] - low[1])), 1)
    seen = vertices_mm @ view.T
    places = np.column_stack([(seen[:, 0] - low[0]) * scale - 0.5, (high[1] - seen[:, 1]) * scale - 0.5])
    canvas = np.full((height, _WIDTH), BACKGROUND, np.uint8)
    grey = _tones(seen, faces)[:, None] * 190.0 + 20.0
    return painted(canvas, places[faces], seen[faces].mean(axis=1)[:, 2], grey)


def _tones(seen: Floats, faces: Ints32) -> Floats:
    """(T,) brightness 0 to 1 of each triangle by the cosine to the light; both sides are lit."""
    a, b, c = (seen[faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-300)
    facing = np.where(normal[:, 2] < 0.0, -1.0, 1.0)
    cosine = facing * (normal @ (_LIGHT * [1.0, -1.0, 1.0])) / length / np.linalg.norm(_LIGHT)
    return np.asarray(np.clip(0.15 + 0.85 * np.maximum(cosine, 0.0), 0.0, 1.0))


def frame_of(points_mm: Floats, view: Floats) -> tuple[Floats, Floats]:
    """Corners of a picture that holds nearly all points; strays are left out."""
    low, high = np.quantile(points_mm @ view[:2].T, [0.001, 0.999], axis=0)
    room = 0.04 * float((high - low).max())
    return low - room, high + room
