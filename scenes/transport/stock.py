"""The same scene without our tracing: Mitsuba's ``perspective``, ``projector`` and ``path``.

It is the independent reference for the traced transport, and the renderer of last resort where no vectorised
variant runs: slower, one pattern at a time, with the same expectation.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from burrscan.arrays import Floats, Floats32
from burrscan.errors import InputError
from burrscan.rig import NO_DISTORTION, Rig, View
from scenes.transport.optics import Optics
from scenes.transport.profile import PixelProfile

_TO_MITSUBA = np.diag([-1.0, -1.0, 1.0, 1.0])
"""OpenCV axes (right, down, forward) to Mitsuba's (left, up, forward)."""


def check_stock_can(optics: Optics) -> None:
    """Refuse what stock Mitsuba cannot render.

    Raises
    ------
    InputError
        Naming the first feature of the rig that needs the traced transport.

    """
    rig = optics.rig
    needs = {
        "lens distortion": any(v.distortion != NO_DISTORTION for v in (rig.camera, rig.projector)),
        "a finite aperture": optics.camera_aperture_mm > 0.0 or optics.projector_aperture_mm > 0.0,
        "pixels that are not square": any(v.fx != v.fy for v in (rig.camera, rig.projector)),
        "a pixel gap or another blur than one pixel": optics.profile != PixelProfile(),
    }
    for feature, needed in needs.items():
        if needed:
            raise InputError(
                f"this scene has {feature}, which stock Mitsuba cannot render; install a usable LLVM "
                "(see 'burrscan doctor'), or take it out of the scene"
            )


def stock_image(
    mi: Any,
    mesh: Any,
    optics: Optics,
    light: Floats32,
    *,
    samples: int = 16,
    bounces: int = 3,
    seed: int = 0,
) -> Floats32:
    """The scene under one pattern of light (H, W), in the units of the traced transport; (h, w).

    ``mesh`` is a Mitsuba mesh, or several by name (:func:`scenes.transport.world.wheel_shapes`).

    Raises
    ------
    InputError
        When the rig needs more than stock Mitsuba has.

    """
    image: Floats32 = stock_images(mi, mesh, optics, light, samples=samples, bounces=bounces, seeds=(seed,))[
        0
    ]
    return image


def stock_images(
    mi: Any,
    mesh: Any,
    optics: Optics,
    light: Floats32,
    *,
    samples: int,
    bounces: int,
    seeds: Sequence[int],
) -> Floats32:
    """Independent images of one pattern, one for each seed; (runs, h, w). See :func:`stock_image`."""
    check_stock_can(optics)
    return _render(mi, mesh, optics, _projector(mi, optics, light), samples, bounces, seeds)


def stock_ambient(
    mi: Any,
    mesh: Any,
    optics: Optics,
    *,
    samples: int = 16,
    bounces: int = 3,
    seed: int = 0,
) -> Floats32:
    """The scene in a uniform surround of radiance 1, which the camera itself does not see; (h, w)."""
    surround = {"type": "constant", "radiance": 1.0}
    image: Floats32 = _render(mi, mesh, optics, surround, samples, bounces, (seed,))[0]
    return image


def _render(
    mi: Any,
    mesh: Any,
    optics: Optics,
    emitter: dict[str, Any],
    samples: int,
    bounces: int,
    seeds: Sequence[int],
) -> Floats32:
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {
                "type": "path",
                "max_depth": bounces + 1,
                "rr_depth": 1000,
                "hide_emitters": True,
            },
            "sensor": _sensor(mi, optics.rig.camera, samples),
            "emitter": emitter,
            **(mesh if isinstance(mesh, Mapping) else {"wheel": mesh}),
        }
    )
    images = np.stack([np.array(mi.render(scene, seed=seed), dtype=np.float32) for seed in seeds])
    return images.reshape(len(seeds), *optics.rig.camera.shape, -1)[..., 0]


def _sensor(mi: Any, view: View, samples: int) -> dict[str, Any]:
    return {
        "type": "perspective",
        "fov": math.degrees(2.0 * math.atan(0.5 * view.width / view.fx)),
        "fov_axis": "x",
        "near_clip": 1.0,
        "far_clip": 1e6,
        "principal_point_offset_x": 0.5 - (view.cx + 0.5) / view.width,
        "principal_point_offset_y": 0.5 - (view.cy + 0.5) / view.height,
        "to_world": mi.ScalarTransform4f(_TO_MITSUBA),
        "sampler": {"type": "independent", "sample_count": samples},
        "film": {
            "type": "hdrfilm",
            "width": view.width,
            "height": view.height,
            "rfilter": {"type": "box"},
            "pixel_format": "luminance",
            "component_format": "float32",
        },
    }


def _projector(mi: Any, optics: Optics, light: Floats32) -> dict[str, Any]:
    """Mitsuba's projector has its principal point in the middle: pad the image until ours is there."""
    view = optics.rig.projector
    padded, shift = _centred(light, view)
    rows, columns = padded.shape
    bitmap = {
        "type": "bitmap",
        "bitmap": mi.Bitmap(np.ascontiguousarray(padded[..., None])),
        "raw": True,
        "filter_type": "bilinear",
        "wrap_mode": "clamp",
        "to_uv": mi.ScalarTransform4f().translate([shift[0] / columns, shift[1] / rows, 0.0]),
    }
    return {
        "type": "projector",
        "irradiance": bitmap,
        "fov": math.degrees(2.0 * math.atan(0.5 * columns / view.fx)),
        "fov_axis": "x",
        "scale": optics.standoff_mm**2,
        "to_world": mi.ScalarTransform4f(_camera_from_projector(optics.rig) @ _TO_MITSUBA),
    }


def _centred(light: Floats32, view: View) -> tuple[Floats32, tuple[float, float]]:
    """``light`` in the middle of a dark frame, and the sub-pixel shift that is left for the texture."""
    half_x = math.ceil(max(view.cx + 0.5, view.width - view.cx - 0.5)) + 1
    half_y = math.ceil(max(view.cy + 0.5, view.height - view.cy - 0.5)) + 1
    padded = np.zeros((2 * half_y, 2 * half_x), np.float32)
    left, top = half_x - (view.cx + 0.5), half_y - (view.cy + 0.5)
    x, y = round(left), round(top)
    padded[y : y + view.height, x : x + view.width] = light
    return padded, (x - left, y - top)


def _camera_from_projector(rig: Rig) -> Floats:
    return np.asarray(np.linalg.inv(rig.T_projector_camera), dtype=float)
