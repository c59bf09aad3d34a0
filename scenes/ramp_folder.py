"""Rendered ramps of an evenly lit white board, as the folder that the photometric calibration reads.

The board is traced in front of the scene's own rig; its pictures are cut to the middle of the sensor, as a
camera reads out a region of interest. The lamps are narrow-band surrounds, one per band; the projector ramps
one primary after the other. The board is white in every band, so one traced light serves all of them.
"""

from __future__ import annotations

import json
import zlib
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from burrscan.arrays import Floats, Floats32, Image, Ints, freeze
from burrscan.calibration.board import Board
from burrscan.calibration.ramps import ramp_exposures_ms
from burrscan.captures.png import write_colour, write_grey
from burrscan.captures.ramps import NAME
from burrscan.captures.sheets import sheet_tables
from burrscan.files import write_text
from burrscan.rig import View
from scenes.board import BoardSpec, board_light
from scenes.electronics.drift import falloff, per_picture
from scenes.electronics.sensor import expose
from scenes.scene import SceneSpec, scene_hash
from scenes.simulate import optics_of

_PICTURE = (96, 128)
"""Rows and columns kept of the sensor's middle: over a hundred tiles, and small files."""
_BOARD = Board(11, 8, 40.0)
_WHITE = 0.8
"""Reflectance of the board, as of matt white paint."""
_LEVELS = np.arange(0, 256, 15)
"""Of the projector, every fifteenth with 0 and 255: a response curve is smooth between."""
_LEVEL_EXPOSURES = (0.45, 1.3, 10.0)
"""Relative to the exposure at which the brightest channel fills the well under one primary at full."""
_OVER = 1.3
"""The longest lamp exposure over that which fills the well: the ramp must clip."""
_OFF_PICTURES = 6
"""With the light off, exposures halved each time: they tell black level and dark current apart."""
_COVERED = -1
"""Level that stands for a covered projector."""
_STREAM = zlib.crc32(b"ramps")
"""Keeps the noise of ramps apart from a scan's of the same seed: SeedSequence ignores trailing zeros."""


@dataclass(frozen=True)
class RampRig:
    """A scene's camera and projector in front of the board.

    Parameters
    ----------
    scene
        Its electronics.
    white, surround
        (h, w) light of the board under the projector at full, and under a surround of radiance 1.
    seed
        Of the noise.

    """

    scene: SceneSpec
    white: Floats32
    surround: Floats32
    seed: int

    def __post_init__(self) -> None:
        freeze(self, white=self.white, surround=self.surround)

    @property
    def camera_mix(self) -> Floats:
        """(channels, bands)."""
        return self._mix(self.scene.camera.crosstalk)

    @property
    def projector_mix(self) -> Floats:
        """(bands, primaries)."""
        return self._mix(self.scene.projector.crosstalk)

    @property
    def channels(self) -> int:
        """One, or three in a scene in colour or with crosstalk on either side."""
        mixed = self.scene.camera.crosstalk or self.scene.projector.crosstalk
        return 3 if mixed or self.scene.channels == "rgb" else 1

    def _mix(self, crosstalk: tuple[tuple[float, ...], ...]) -> Floats:
        return np.array(crosstalk) if crosstalk else np.eye(self.channels)

    def lamp_exposures_ms(self) -> Floats:
        """Exposures of a lamp's ramp, from dark to clipping, as far as the shutter goes."""
        camera = self.scene.camera
        times = ramp_exposures_ms(_OVER * camera.white_exposure_ms)
        return np.unique(np.clip(times, camera.shortest_ms, camera.longest_ms))

    def level_exposures_ms(self) -> Floats:
        """Exposures of the projector's ramps."""
        camera = self.scene.camera
        brightest = float(self.white.max()) * float((self.camera_mix @ self.projector_mix).max())
        times = np.array(_LEVEL_EXPOSURES) * camera.white_exposure_ms / brightest
        return np.unique(np.clip(times, camera.shortest_ms, camera.longest_ms))

    def picture(self, lamps: Floats, levels: Ints, *, exposure_ms: float, number: int) -> Image:
        """What the camera sees: (h, w), or (h, w, 3) in colour.

        Parameters
        ----------
        lamps
            (bands,) light of the lamps, relative to the brightest place of the board at 1.
        levels
            (primaries,) shown; -1 covered.
        exposure_ms
            Exposure time.
        number
            Of the picture: its noise and the projector's flicker belong to it.

        """
        projector = self.scene.projector
        table = np.append(projector.sheet.light, 0.0)  # -1 is the last: nothing
        flicker = 1.0 + projector.flicker * per_picture((self.seed,), "ramp flicker", number, 1, 1)[0, 0]
        bands = self.projector_mix @ (table[levels] * flicker)
        lamp = lamps / float(self.surround.max()) + self.scene.light.ambient
        light = self.white[..., None] * bands + self.surround[..., None] * lamp
        seen = (light @ self.camera_mix.T).astype(np.float32)
        images = [
            expose(
                np.ascontiguousarray(seen[None, ..., channel]),
                camera=self.scene.camera,
                exposure_ms=exposure_ms,
                identity=(self.seed, _STREAM, channel),
                first_frame=number,
            )[0]
            for channel in range(self.channels)
        ]
        return images[0] if self.channels == 1 else np.stack(images, axis=-1)


def ramp_rig(scene: SceneSpec, *, seed: int = 0) -> RampRig:
    """Trace the board in front of a scene's rig.

    Raises
    ------
    burrscan.errors.InputError
        When no vectorised renderer runs here.

    """
    optics = optics_of(scene)
    whole = optics.rig.camera
    cut = replace(optics, rig=replace(optics.rig, camera=_middle(whole)))
    pose = np.eye(4)
    pose[:3, 3] = -_BOARD.points_mm.mean(axis=0) + (0.0, 0.0, scene.rig.standoff_mm)
    board = BoardSpec(_BOARD, white=_WHITE, black=_WHITE)
    light = board_light(board, pose, cut, samples=scene.render.samples, seed=scene.render.seed)
    lens = falloff(whole, scene.camera.vignetting)[_inside(whole)]
    shown = falloff(optics.rig.projector, scene.projector.vignetting)
    return RampRig(scene, light.relight(shown[None])[0] * lens, light.ambient * lens, seed)


def write_ramps(scene: SceneSpec, folder: Path, *, seed: int = 0) -> Path:
    """Render the ramps that calibrate a scene's camera and projector, and write them to ``folder``.

    Besides ``ramps.json`` and the pictures the folder gets ``scene.json`` and ``truth.json`` (the true
    sheets), which no calibration reads.
    """
    rig = ramp_rig(scene, seed=seed)
    (folder / "images").mkdir(parents=True, exist_ok=True)
    shots = _Shots(rig, folder)
    document = {
        "format": "burrscan-ramps",
        "version": 1,
        "bit_depth": scene.camera.bit_depth,
        "exposure_range_ms": [scene.camera.shortest_ms, scene.camera.longest_ms],
        "lamps": [shot for band in range(rig.channels) for shot in shots.lamp(band)],
        "levels": shots.levels(),
    }
    _write(folder / "scene.json", asdict(scene) | {"hash": scene_hash(scene)})
    _write(folder / "truth.json", sheet_tables(scene.camera.sheet, scene.projector.sheet))
    _write(folder / NAME, document)
    return folder


class _Shots:
    """Takes pictures one after the other, writes them, and lists them."""

    def __init__(self, rig: RampRig, folder: Path) -> None:
        self._rig = rig
        self._folder = folder
        self._taken = 0

    def lamp(self, band: int) -> list[dict[str, Any]]:
        """A lamp's ramp, and some pictures with the lamp off."""
        times = self._rig.lamp_exposures_ms()
        off = times[-1] * 2.0 ** -np.arange(float(_OFF_PICTURES))
        dark, light = np.zeros(self._rig.channels), np.eye(self._rig.channels)[band]
        covered = np.full(self._rig.channels, _COVERED)
        lit = [self._take(light, covered, t) | {"lamp": band} for t in times]
        return lit + [self._take(dark, covered, t) | {"lamp": band, "lit": False} for t in off]

    def levels(self) -> list[dict[str, Any]]:
        """Each primary through its levels, the others at 0, and the projector covered; at each exposure."""
        count = self._rig.channels
        steps = [np.full((1, count), _COVERED)]
        steps += [level * np.eye(count, dtype=int)[[k]] for k in range(count) for level in _LEVELS]
        dark = np.zeros(count)
        return [
            self._take(dark, step, t) | {"levels": step.tolist()}
            for t in self._rig.level_exposures_ms()
            for step in np.concatenate(steps)
        ]

    def _take(self, lamps: Floats, levels: Ints, exposure_ms: float) -> dict[str, Any]:
        image = self._rig.picture(lamps, levels, exposure_ms=float(exposure_ms), number=self._taken)
        name = f"images/{self._taken:04d}.png"
        self._taken += 1
        (write_grey if image.ndim == 2 else write_colour)(self._folder / name, image)
        return {"image": name, "exposure_ms": float(exposure_ms)}


def _inside(view: View) -> tuple[slice, slice]:
    """Rows and columns of the middle of the sensor."""
    rows, columns = (min(n, most) for n, most in zip(view.shape, _PICTURE, strict=True))
    top, left = (view.height - rows) // 2, (view.width - columns) // 2
    return slice(top, top + rows), slice(left, left + columns)


def _middle(view: View) -> View:
    rows, columns = _inside(view)
    return replace(
        view,
        width=columns.stop - columns.start,
        height=rows.stop - rows.start,
        cx=view.cx - columns.start,
        cy=view.cy - rows.start,
    )


def _write(path: Path, document: dict[str, Any]) -> None:
    write_text(path, json.dumps(document, indent=1) + "\n")
