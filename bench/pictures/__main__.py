"""``python -m bench.pictures``: every burr family and blemish close up, on one sheet: ``docs/families.jpg``.

Rendered by stock Mitsuba under white light and a dim surround: the pictures owe nothing to this project's own
light transport.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from bench.pictures.tiles import TILES, Tile
from burrscan.arrays import Floats, Floats32
from scenes.pose import PoseSpec
from scenes.renderer import activate
from scenes.scene import SceneSpec, load_scene
from scenes.simulate import optics_of
from scenes.surface.parts import surface_parts, zone_ends_mm
from scenes.transport.optics import Optics
from scenes.transport.stock import stock_ambient, stock_image
from scenes.transport.world import wheel_shapes
from scenes.wheel import Wheel, build_wheel

_WIDTH, _HEIGHT = 320, 240
"""Of a tile, px."""
_COLUMNS = 4
"""Tiles in a row of the sheet."""
_SURROUND = 0.25
"""Light from around over that of the projector: fills shadows, as a room does."""
_BRIGHTEST = 99.7
"""Percentile shown as white, so that a few highlights do not darken the rest."""
_CONTRAST = 12.0
"""Of the logarithmic tone curve."""
_BOUNCES = 2
"""One between surfaces, which is nearly all there is on a convex part."""
_CAPTION = 22
"""Height of a tile's title, px."""
_QUALITY = 85
"""Of the JPEG: no artefacts on metal, and a sheet of some hundred kB."""


def main() -> None:
    """Render all tiles and write the sheet."""
    parser = argparse.ArgumentParser(prog="python -m bench.pictures", description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("docs/families.jpg"), help="the sheet to write")
    parser.add_argument("--samples", type=int, default=256, help="light paths per pixel")
    arguments = parser.parse_args()
    wheels: dict[str, tuple[SceneSpec, Wheel]] = {}
    shown = []
    for tile in TILES:
        if tile.scene not in wheels:
            scene = load_scene(tile.scene)
            wheels[tile.scene] = (
                scene,
                build_wheel(scene.wheel, scene.burrs, cuts_mm=zone_ends_mm(scene.zone)),
            )
        shown.append(_captioned(_rendered(tile, *wheels[tile.scene], samples=arguments.samples), tile.title))
    rows = [np.hstack(shown[i : i + _COLUMNS]) for i in range(0, len(shown), _COLUMNS)]
    cv2.imwrite(str(arguments.out), np.vstack(rows), [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])


def _rendered(tile: Tile, scene: SceneSpec, wheel: Wheel, *, samples: int) -> Floats32:
    mi = activate()
    pose = PoseSpec(spin_deg=tile.turned_deg - tile.angle_deg, elevation_deg=tile.elevation_deg)
    z = wheel.generatrix_zr_mm[:, 0]
    T_camera_part = pose.T_camera_part(
        standoff_mm=scene.rig.standoff_mm, middle_z_mm=float(z.min() + z.max()) / 2.0
    )
    parts = surface_parts(wheel, scene.finish, burrs=scene.burrs, zones=scene.zone, blemishes=scene.blemish)
    channels: Any = "rgb" if str(mi.variant()).endswith("rgb") else "mono"
    shapes = wheel_shapes(mi, wheel, T_camera_part, parts, channels=channels)
    middle = T_camera_part[:3, :3] @ tile.middle_mm(wheel) + T_camera_part[:3, 3]
    optics = _zoomed(optics_of(scene), middle, tile.field_mm)
    white = np.ones(optics.rig.projector.shape, np.float32)
    lit = stock_image(mi, shapes, optics, white, samples=samples, bounces=_BOUNCES)
    around = stock_ambient(mi, shapes, optics, samples=samples // 2, bounces=_BOUNCES)
    return np.asarray(lit + _SURROUND * around, np.float32)


def _zoomed(optics: Optics, middle_mm: Floats, field_mm: float) -> Optics:
    """The same camera behind a longer lens, cropped to a place: the sensor moves, the view does not."""
    focal = _WIDTH * middle_mm[2] / field_mm
    camera = replace(
        optics.rig.camera,
        width=_WIDTH,
        height=_HEIGHT,
        fx=focal,
        fy=focal,
        cx=(_WIDTH - 1) / 2.0 - focal * middle_mm[0] / middle_mm[2],
        cy=(_HEIGHT - 1) / 2.0 - focal * middle_mm[1] / middle_mm[2],
    )
    return replace(optics, rig=replace(optics.rig, camera=camera))


def _captioned(light: Floats32, title: str) -> NDArray[np.uint8]:
    share = np.clip(light / np.percentile(light, _BRIGHTEST), 0.0, 1.0)
    shown = np.log1p(_CONTRAST * share) / np.log1p(_CONTRAST)  # metal spans more than paper or a screen
    tile = np.full((_HEIGHT + _CAPTION, _WIDTH), 255, np.uint8)
    tile[:_HEIGHT] = np.round(shown * 255.0)
    tile[:, -2:] = 255
    cv2.putText(tile, title, (4, _HEIGHT + 15), cv2.FONT_HERSHEY_SIMPLEX, 0.42, 0, 1, cv2.LINE_AA)
    return tile


if __name__ == "__main__":
    main()
