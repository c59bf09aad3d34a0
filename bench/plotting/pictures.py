"""Arrays as pictures inside the page: WebP in data URIs, so that the report is one file."""

from __future__ import annotations

import base64
from collections.abc import Mapping
from typing import Any

import cv2
import numpy as np
from markupsafe import Markup
from numpy.typing import NDArray

from burrscan.arrays import Floats, Ints, Levels

_PHOTO_QUALITY = 82
"""Of WebP: a camera's noise survives, and the page stays small."""
_DRAWING_QUALITY = 60
"""Of WebP for renderings, which have no noise to keep."""
_WIDEST = 512
"""Pixels of a picture on the page; wider ones are reduced."""
_SCREEN_GAMMA = 2.2
"""Of a usual screen (sRGB, nearly)."""
_LOSSLESS = 101  # OpenCV's way to say so
_STEPS = 20  # colour steps on each side of zero: enough to see, few enough to stay small

_SHIFT = 4  # bits of a pixel's fraction where faces are painted

Anchors = tuple[tuple[int, int, int], ...]
"""Colours, red, green and blue, evenly spaced along a scale."""
BLUE_WHITE_RED: Anchors = ((5, 48, 97), (67, 147, 195), (247, 247, 247), (214, 96, 77), (103, 0, 31))
"""ColorBrewer's RdBu, from negative to positive: readable with any colour vision."""


def photo(image: Levels) -> str:
    """A grey picture (h, w) as a data URI, slightly lossy, wide ones reduced."""
    share = min(_WIDEST / image.shape[1], 1.0)
    size = (round(image.shape[1] * share), round(image.shape[0] * share))
    return _data_uri(cv2.resize(image, size, interpolation=cv2.INTER_AREA), _PHOTO_QUALITY)


def lossy(image: Levels) -> str:
    """A coloured picture (h, w, 4), blue first, as a data URI, slightly lossy."""
    return _data_uri(image, _DRAWING_QUALITY)


def brightened(image: Levels) -> Levels:
    """A linear camera picture with the gamma of screens, so that its dark parts can be seen."""
    table = np.round(255.0 * np.linspace(0.0, 1.0, 256) ** (1 / _SCREEN_GAMMA)).astype(np.uint8)
    return table[image]


def signed_map(values: NDArray[np.floating], limit: float) -> str:
    """Signed values (h, w) in blue, white and red, clipped at ±``limit``; NaN is transparent."""
    known = np.isfinite(values)
    share = np.clip(np.where(known, values, 0.0) / limit, -1.0, 1.0)
    colours = ramp()[np.round((share + 1.0) * _STEPS).astype(int)]
    return _data_uri(_with_alpha(colours, known), _LOSSLESS)


def classes(labels: Levels, colours: Mapping[int, str]) -> str:
    """Class numbers (h, w) in the given ``#rrggbb`` colours; classes without one are transparent."""
    table = np.zeros((256, 4), np.uint8)
    for label, colour in colours.items():
        table[label] = [*bytes.fromhex(colour.removeprefix("#")), 255]
    return _data_uri(_bgr(table[labels]), _LOSSLESS)


def gradient(anchors: Anchors = BLUE_WHITE_RED) -> str:
    """Colours as a CSS gradient, for a legend; by default those of :func:`signed_map`."""
    stops = ", ".join(f"rgb({r} {g} {b})" for r, g, b in anchors)
    return f"linear-gradient(to right, {stops})"


def ramp(anchors: Anchors = BLUE_WHITE_RED, count: int = 2 * _STEPS + 1) -> Levels:
    """(count, 3) colours from first anchor to last; by default those of :func:`signed_map`, -1 to +1."""
    at, wanted = np.linspace(0.0, 1.0, len(anchors)), np.linspace(0.0, 1.0, count)
    channels = [np.interp(wanted, at, channel) for channel in np.array(anchors, float).T]
    return np.stack(channels, axis=-1).round().astype(np.uint8)


def view_from(*, azimuth_deg: float, elevation_deg: float) -> Floats:
    """(3, 3) rows right, up, towards the viewer; z stays upright, azimuth 0 looks from +x."""
    a, e = np.radians([azimuth_deg, elevation_deg])
    towards = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
    right = np.array([-np.sin(a), np.cos(a), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def painted(canvas: Levels, corners_px: Floats, depth: Floats, colours: Floats) -> Levels:
    """Paint faces (F, 3, 2) onto a canvas (h, w, c), from the least depth (F,) to the largest.

    ``colours`` are (F, c); the canvas is returned.
    """
    places = np.round(corners_px * 2.0**_SHIFT).astype(np.int32)
    for face in np.argsort(depth):
        cv2.fillConvexPoly(canvas, places[face], colours[face].tolist(), cv2.LINE_8, _SHIFT)
    return canvas


def window(truth: Mapping[str, NDArray[Any]]) -> tuple[slice, slice]:
    """Rows and columns of the camera's pictures that hold what can be measured, with a margin."""
    mask = truth["measurable"]
    if not mask.any():
        return slice(None), slice(None)
    margin = max(mask.shape) // 20
    rows, columns = (np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0))
    return _widened(rows, margin), _widened(columns, margin)


def _widened(used: Ints, margin: int) -> slice:
    return slice(max(int(used[0]) - margin, 0), int(used[-1]) + 1 + margin)


def picture(uri: str, label: str) -> Markup:
    """A picture as an element of the page."""
    return Markup('<img src="{}" alt="{}" decoding="async">').format(uri, label)


def _with_alpha(colours: Levels, known: NDArray[np.bool_]) -> Levels:
    opaque = np.where(known, 255, 0).astype(np.uint8)
    return _bgr(np.dstack([np.where(known[..., None], colours, 0).astype(np.uint8), opaque]))


def _bgr(rgba: Levels) -> Levels:
    return np.ascontiguousarray(rgba[..., [2, 1, 0, 3]])  # OpenCV's order


def _data_uri(image: Levels, quality: int) -> str:
    done, data = cv2.imencode(".webp", np.ascontiguousarray(image), [cv2.IMWRITE_WEBP_QUALITY, quality])
    if not done:
        raise ValueError(f"an image of shape {image.shape} cannot be written as WebP")
    return "data:image/webp;base64," + base64.b64encode(data.tobytes()).decode("ascii")
