"""Ramp folders: pictures of an evenly lit board for the photometric calibration (``README.md``)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from burrscan.arrays import Image
from burrscan.calibration.ramps import ExposureRamp, LevelRamp
from burrscan.captures.png import check_depth, read_colour, read_grey
from burrscan.documents import STRICT, build, read_json
from burrscan.errors import InputError

NAME = "ramps.json"
Positive = Annotated[float, Field(gt=0.0)]
Level = Annotated[int, Field(ge=-1, le=255)]


@dataclass(frozen=True)
class LampShot:
    """A picture under a lamp, the projector covered.

    Parameters
    ----------
    image
        Path relative to the folder.
    exposure_ms
        Exposure time.
    lamp
        Which lamp's ramp it belongs to: the number of the camera channel whose band it lights; 0 for the
        white lamp of a grey camera.
    lit
        False where the lamp is off.

    """

    __pydantic_config__ = STRICT

    image: str
    exposure_ms: Positive
    lamp: Annotated[int, Field(ge=0)]
    lit: bool = True


@dataclass(frozen=True)
class LevelShot:
    """A picture under the projector alone.

    Parameters
    ----------
    image
        Path relative to the folder.
    exposure_ms
        Exposure time.
    levels
        Even level of each primary, 0 to 255; -1 in all of them where the projector is covered.

    """

    __pydantic_config__ = STRICT

    image: str
    exposure_ms: Positive
    levels: tuple[Level, ...]


@dataclass(frozen=True)
class RampDocument:
    """``ramps.json``."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-ramps"]
    version: Literal[1]
    bit_depth: Annotated[int, Field(ge=1, le=16)]
    exposure_range_ms: tuple[Positive, Positive]
    lamps: Annotated[tuple[LampShot, ...], Field(min_length=1)]
    levels: Annotated[tuple[LevelShot, ...], Field(min_length=1)]


@dataclass(frozen=True)
class RampCapture:
    """A ramp folder, read.

    Parameters
    ----------
    lamps
        One exposure ramp per lamp.
    levels
        The projector's ramps.
    bit_depth, exposure_range_ms
        Of the camera.

    """

    lamps: tuple[ExposureRamp, ...]
    levels: LevelRamp
    bit_depth: int
    exposure_range_ms: tuple[float, float]


_ROUNDED = 1e-3
"""Share by which an exposure may be beyond the range: both were rounded."""


def is_ramp_folder(folder: Path) -> bool:
    """Whether a folder holds ramps."""
    return (folder / NAME).is_file()


def read_ramps(folder: Path) -> RampCapture:
    """Read a ramp folder.

    Raises
    ------
    InputError
        With every error in ``ramps.json``; for a missing picture, one of another size, one in colour where
        one lamp says that the camera is grey, or values beyond the bit depth.

    """
    path = folder / NAME
    document = build(RampDocument, read_json(path), source=str(path))
    numbers = sorted({shot.lamp for shot in document.lamps})
    if numbers != list(range(len(numbers))):
        raise InputError(f"{path}: lamps {numbers} of the ramps; they are numbered 0, 1, 2 by their bands")
    shortest, longest = document.exposure_range_ms
    shots: list[LampShot | LevelShot] = [*document.lamps, *document.levels]
    for shot in shots:
        if not shortest * (1.0 - _ROUNDED) <= shot.exposure_ms <= longest * (1.0 + _ROUNDED):
            raise InputError(
                f"{path}: {shot.image} was exposed for {shot.exposure_ms:g} ms; exposure_range_ms says "
                f"{shortest:g} to {longest:g}"
            )
    primaries = {len(shot.levels) for shot in document.levels}
    if len(primaries) != 1:
        raise InputError(f"{path}: levels of {sorted(primaries)} primaries; every shot names them all")
    colour = len(numbers) > 1

    def images(shots: list[LampShot] | list[LevelShot]) -> Image:
        return _images(folder, [shot.image for shot in shots], document.bit_depth, colour=colour)

    def exposures(shots: list[LampShot] | list[LevelShot]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return np.array([shot.exposure_ms for shot in shots])

    lamps = [[shot for shot in document.lamps if shot.lamp == number] for number in numbers]
    levels = list(document.levels)
    return RampCapture(
        lamps=tuple(
            ExposureRamp(images(shots), exposures(shots), np.array([shot.lit for shot in shots]))
            for shots in lamps
        ),
        levels=LevelRamp(images(levels), exposures(levels), np.array([shot.levels for shot in levels])),
        bit_depth=document.bit_depth,
        exposure_range_ms=document.exposure_range_ms,
    )


def _images(folder: Path, names: list[str], bit_depth: int, *, colour: bool) -> Image:
    read = read_colour if colour else read_grey
    found = [read(folder / name) for name in names]
    for name, image in zip(names, found, strict=True):
        check_depth(image, bit_depth, folder / name)
        if image.shape != found[0].shape:
            raise InputError(
                f"{folder / name}: {image.shape[1]}×{image.shape[0]} pixels, but {names[0]} has "
                f"{found[0].shape[1]}×{found[0].shape[0]}"
            )
    return np.stack(found)
