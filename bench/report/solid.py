"""A mesh to turn by hand: packed small for the page's own WebGL viewer, with a still picture of it."""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from bench.plotting.page import packed as pack
from bench.plotting.pictures import lossy, painted, ramp, view_from
from burrscan.arrays import Floats, Levels

_FINEST = 4095  # steps of a coordinate along the longest side: 12 bits
_UNKNOWN = 255
"""Byte of a vertex whose value is not known."""
_HALF = 127
"""Steps of a byte to each side of zero: 0 to 254 are values."""
_LIGHT = 0.35  # of the brightness stays where a face is seen edge on
_STILL = (640, 360)
"""Pixels of the picture shown before the viewer starts."""
_TURN_DEG, _TILT_DEG = -20.0, 18.0
"""From the camera's side: a little, so that depth shows."""


@dataclass(frozen=True)
class Solid:
    """A mesh with a value at each vertex.

    Parameters
    ----------
    label, css
        Whose it is.
    vertices_mm
        (V, 3) in the part frame, z along the axis.
    faces
        (F, 3).
    values_mm
        (V,) deviation, NaN: unknown.
    camera_mm
        (3,) where to look from first.

    """

    label: str
    css: str
    vertices_mm: Floats
    faces: NDArray[np.uint16]
    values_mm: Floats
    camera_mm: Floats


def viewer(solids: Sequence[Solid], limit_mm: float, label: str, *, first: int = 0) -> Markup:
    """The view of one or more meshes of the same part: a still picture that becomes a 3D view when touched.

    Without scripts or WebGL, and on paper, the still picture is what there is. O(V + F).

    Parameters
    ----------
    solids
        Shown one at a time; none makes no view.
    limit_mm
        Value of the strongest colour.
    label
        For those who hear pictures.
    first
        Which is shown first.

    """
    shown = [solid for solid in solids if len(solid.faces)]
    if not shown:
        return Markup("")
    first = min(first, len(shown) - 1)
    corners = np.concatenate([solid.vertices_mm for solid in shown])
    low, size = corners.min(axis=0), float(np.ptp(corners, axis=0).max()) or 1.0
    view = view_rotation(corners.mean(axis=0), shown[0].camera_mm)
    stills = [still(solid, limit_mm, view, low, size) for solid in shown]
    buttons = Markup("").join(
        Markup('<button type="button" class="{}" aria-pressed="{}">{}</button>').format(
            solid.css, "true" if number == first else "false", solid.label
        )
        for number, solid in enumerate(shown)
    )
    images = Markup("").join(
        Markup('<img src="{}" alt="{}, {}"{} width="{}" height="{}">').format(
            uri, label, solid.label, "" if number == first else Markup(" hidden"), *_STILL
        )
        for number, (solid, uri) in enumerate(zip(shown, stills, strict=True))
    )
    data = json.dumps(
        {
            "first": first,
            "view": [round(float(v), 5) for v in view.ravel()],
            "ramp": base64.b64encode(ramp().astype(np.uint8).tobytes()).decode("ascii"),
            "meshes": [packed(solid, limit_mm, low, size) for solid in shown],
        },
        separators=(",", ":"),
    )
    buttons = buttons if len(shown) > 1 else Markup("")
    return Markup(
        '<div class="solid" tabindex="0" role="application" aria-label="{label}; arrow keys turn it, plus '
        'and minus change its size, 0 turns it back">{images}<canvas hidden></canvas>'
        '<span class="hint">drag to turn</span>'
        '<script type="application/json">{data}</script></div><div class="choice">{buttons}</div>'
    ).format(
        label=label,
        images=images,
        data=Markup(data),  # noqa: S704
        buttons=buttons,
    )


def packed(solid: Solid, limit_mm: float, low_mm: Floats, size_mm: float) -> dict[str, object]:
    """A mesh in few bytes: 12 bit coordinates and faces as differences, in planes of low and high bytes."""
    steps = np.round((solid.vertices_mm - low_mm) / size_mm * _FINEST).astype(np.int64)
    data = (
        _planes(steps)
        + _planes(solid.faces.astype(np.int64))
        + _quantised(solid.values_mm, limit_mm).tobytes()
    )
    return {
        "v": len(steps),
        "f": len(solid.faces),
        "data": pack(data),
    }


def _planes(rows: NDArray[np.int64]) -> bytes:
    """Columns of differences from row to row: all low bytes, then all high bytes."""
    words = np.concatenate([np.diff(column, prepend=0) for column in rows.T]).astype(np.int16).view(np.uint16)
    return (words & 255).astype(np.uint8).tobytes() + (words >> 8).astype(np.uint8).tobytes()


def _quantised(values: Floats, limit: float) -> Levels:
    """0 to 254 from minus to plus the limit; 255 is unknown."""
    share = np.clip(np.nan_to_num(values) / limit, -1.0, 1.0)
    return np.where(np.isfinite(values), np.round((share + 1.0) * _HALF), _UNKNOWN).astype(np.uint8)


def view_rotation(middle_mm: Floats, camera_mm: Floats) -> Floats:
    """(3, 3) rows right, up, towards the eye: from the camera, a little turned to show depth; z up."""
    eye = camera_mm - middle_mm
    azimuth_deg = _TURN_DEG + float(np.degrees(np.arctan2(eye[1], eye[0])))
    return view_from(azimuth_deg=azimuth_deg, elevation_deg=_TILT_DEG)


def still(solid: Solid, limit_mm: float, view: Floats, low_mm: Floats, size_mm: float) -> str:
    """What the viewer shows first, as a data URI: faces painted from the farthest to the nearest."""
    width, height = _STILL
    centred = (solid.vertices_mm - low_mm) / size_mm
    turned = (centred - _middle(centred)) @ view.T
    half = _fit(turned, width / height)
    places = np.column_stack(
        [width / 2 + turned[:, 0] / half * height / 2, height / 2 - turned[:, 1] / half * height / 2]
    )
    colours = np.insert(shade(solid, limit_mm, turned)[:, ::-1], 3, 255.0, axis=1)
    canvas = np.zeros((height, width, 4), np.uint8)
    depth = turned[solid.faces].mean(axis=1)[:, 2]
    return lossy(painted(canvas, places[solid.faces], depth, colours))


def _middle(points: Floats) -> Floats:
    return np.asarray((points.min(axis=0) + points.max(axis=0)) / 2.0, float)


def _fit(turned: Floats, aspect: float) -> float:
    """Half of the height that a picture shows, so that all of it is inside."""
    reach = np.abs(turned).max(axis=0)
    return float(max(reach[1], reach[0] / aspect)) * 1.06


def shade(solid: Solid, limit_mm: float, turned: Floats) -> Floats:
    """(F, 3) red, green, blue: the deviation's colour, darker where a face is seen edge on."""
    a, b, c = (turned[solid.faces[:, k]] for k in range(3))
    normal = np.cross(b - a, c - a)
    length = np.maximum(np.linalg.norm(normal, axis=1), 1e-12)
    light = _LIGHT + (1.0 - _LIGHT) * np.abs(normal[:, 2]) / length
    known = np.asarray(np.isfinite(solid.values_mm[solid.faces]).any(axis=1))
    value = np.zeros(len(solid.faces))
    value[known] = np.nanmean(solid.values_mm[solid.faces[known]], axis=1)
    table = ramp().astype(float)
    index = np.round((np.clip(value / limit_mm, -1.0, 1.0) + 1.0) / 2.0 * (len(table) - 1)).astype(int)
    colour = np.where(known[:, None], table[index], 160.0)
    return np.asarray(colour * light[:, None], float)
