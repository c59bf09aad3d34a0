"""Plain Gray-code folders as other people record them: numbered pictures and nothing else.

The layout is that of OpenCV's ``structured_light`` module and of the tools built on it: for the projector's
columns each bit and then its inverse, the most significant bit first; the same for its rows; then white, then
black. Codes count from the first column and the first row. Inverses may be missing, and then white and black,
too.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from burrscan.arrays import Bools, Image, freeze
from burrscan.captures.noise import noise_of, of_levels, of_pairs
from burrscan.captures.png import check_depth, read_grey
from burrscan.codes.gray import bits_for, decode, encode_gray
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet
from burrscan.errors import InputError
from burrscan.linear import linear_camera, linear_images
from burrscan.robust import SIGMA_PER_MEDIAN
from burrscan.scanner import Patterns

_NUMBERED = re.compile(r"^(?P<stem>.*?)(?P<number>\d+)(?P<suffix>\.(png|bmp|tiff?|pgm))$", re.IGNORECASE)
_DEPTHS = (8, 10, 12, 14, 16)
"""Bits that cameras deliver; the least that holds the brightest pixel is taken, for a file does not say."""
_FEWEST_LIT = 100
"""Pixels: fewer that change from black to white are hot pixels or reflexes, no scene."""
_LEAST_SHARE = 0.25
"""Of the contrast, the median over lit pixels. Noise stays far below; of pictures of two bits half are off
by all of it."""
_SURE_Z = 3.0
"""Standard deviations by which a bit must differ: one in 370 of noise alone does."""
_DIMMEST = 5.0 / 256.0
"""Of full scale: a pixel to which the projector adds no more than 5 DN of 8 bits is not believed."""
_INVERTED_NOISE = 5.0
"""How much more variance a bit against a threshold has at most than against its inverse; see ``_paired``."""

ToldBy = Literal["inverses", "white and black", "own range"]
"""What a bit is compared with: its inverse, the middle of white and black, or of a pixel's own range."""


@dataclass(frozen=True)
class GrayCapture:
    """The pictures of a plain Gray-code folder, DN.

    Parameters
    ----------
    columns, rows
        (2 bits, h, w) each bit and its inverse, the most significant first; (bits, h, w) where there are no
        inverses.
    white, black
        (h, w); where they were not taken, each pixel's brightest and darkest value.
    camera
        A data sheet: estimated from the pictures themselves, or measured.
    width, height
        The projector's raster.
    told_by
        What bits are compared with.

    """

    columns: Image
    rows: Image
    white: Image
    black: Image
    camera: CameraSheet
    width: int
    height: int
    told_by: ToldBy = "inverses"

    def __post_init__(self) -> None:
        freeze(self, columns=self.columns, rows=self.rows, white=self.white, black=self.black)


def is_gray_folder(folder: Path) -> bool:
    """Whether a folder holds numbered pictures named ``graycode_…`` and no ``capture.json``."""
    return not (folder / "capture.json").exists() and any(folder.glob("graycode_*[0-9].*"))


def read_gray_folder(
    folder: Path, *, width: int, height: int, camera: CameraSheet | None = None
) -> GrayCapture:
    """Read a plain Gray-code folder for a projector of ``width`` × ``height``.

    Parameters
    ----------
    folder
        The pictures.
    width, height
        The projector's raster.
    camera
        The camera's measured data sheet; by default one is estimated from the pictures themselves.

    Raises
    ------
    InputError
        For a folder without numbered pictures, a missing picture, pictures of different sizes, in colour or
        in another order, and for a capture that holds no light.

    """
    paths = _frames(folder, width, height)
    images = [read_grey(path) for path in paths]
    for path, image in zip(paths, images, strict=True):
        if image.shape != images[0].shape:
            raise InputError(
                f"{path}: {image.shape[1]}×{image.shape[0]} pixels, but {paths[0].name} has "
                f"{images[0].shape[1]}×{images[0].shape[0]}"
            )
    stack: Image = np.stack(images)
    bits, white, black, told_by = _parted(stack, width, height)
    _refuse_unlit(folder, white, black)
    if told_by == "inverses":
        _refuse_other_order(paths, stack)
    for path, image in zip(paths, images, strict=True):
        if camera is not None:
            check_depth(image, camera.bit_depth, path)
    sheet = camera or _camera_of(bits, white, black, told_by)
    split = bits_for(width=width, cell_px=1) * (2 if told_by == "inverses" else 1)
    return GrayCapture(bits[:split], bits[split:], white, black, sheet, width, height, told_by)


def _parted(stack: Image, width: int, height: int) -> tuple[Image, Image, Image, ToldBy]:
    """Bits, white, black, and what bits are compared with."""
    if len(stack) == gray_frames(width=width, height=height):
        return stack[:-2], stack[-2], stack[-1], "inverses"
    if len(stack) == gray_frames(width=width, height=height, inverses=False):
        return stack[:-2], stack[-2], stack[-1], "white and black"
    return stack, stack.max(axis=0), stack.min(axis=0), "own range"


def decode_gray_capture(capture: GrayCapture) -> Correspondence:
    """Projector columns and rows of a plain Gray-code capture.

    A pixel is accepted where columns and rows both decode: at most one bit of each is doubtful (within
    three standard deviations of its inverse or its threshold), flipping it moves the pixel by one, and the
    projector adds more than 5 DN of 8 bits. Its stated sigma is that of an even spread over one projector
    pixel. O(frames · pixels).
    """
    camera = linear_camera(capture.camera)
    u, v = (
        decode(pairs, camera, width=extent, cell_px=1, doubtful_z=z)
        for (pairs, z), extent in (
            (_paired(capture, capture.columns), capture.width),
            (_paired(capture, capture.rows), capture.height),
        )
    )
    mask = u.mask & v.mask & _lit(capture)
    nan = np.float32(np.nan)
    return Correspondence(
        u_px=np.where(mask, u.u_px, nan),
        sigma_u_px=np.where(mask, u.sigma_u_px, nan),
        mask=mask,
        v_px=np.where(mask, v.u_px, nan),
        sigma_v_px=np.where(mask, v.sigma_u_px, nan),
    )


def _paired(capture: GrayCapture, images: Image) -> tuple[Image, float]:
    """Linear pictures of bits, each with what it is compared with, and after how many sigmas it is sure.

    Without inverses that is ``white + black - bit``: a bit beats it where it is above their middle. The
    difference is then ``2 bit - white - black``, whose variance, ``4 bit + white + black`` in photons, is at
    most five times ``white + black``, which the decoder takes it for; and three times the read noise.
    """
    linear = linear_images(images, capture.camera)
    if capture.told_by == "inverses":
        return linear, _SURE_Z
    ends = (linear_images(end, capture.camera).astype(np.float32) for end in (capture.white, capture.black))
    against = sum(ends) - linear
    pairs = np.stack([linear.astype(np.float32), against], axis=1)
    return pairs.reshape(-1, *linear.shape[1:]), _SURE_Z * float(np.sqrt(_INVERTED_NOISE))


def _lit(capture: GrayCapture) -> Bools:
    """(h, w) True where the projector's light is seen at all."""
    gain = capture.white.astype(np.float32) - capture.black
    return np.asarray(gain > _DIMMEST * (capture.camera.saturation_dn + 1))


def gray_frames(*, width: int, height: int, inverses: bool = True) -> int:
    """How many pictures a plain Gray-code capture has, white and black among them."""
    bits = bits_for(width=width, cell_px=1) + bits_for(width=height, cell_px=1)
    return (2 * bits if inverses else bits) + 2


def _frames(folder: Path, width: int, height: int) -> list[Path]:
    """The numbered pictures in order, none missing."""
    if not folder.is_dir():
        raise InputError(f"{folder}: {'not a folder' if folder.exists() else 'no such folder'}")
    series = numbered_pictures(folder)
    expected = gray_frames(width=width, height=height)
    fewer = gray_frames(width=width, height=height, inverses=False)
    numbers = sorted(series)
    first = numbers[0]
    if len(numbers) in {fewer, fewer - 2} and numbers[-1] - first == len(numbers) - 1:
        return [series[n] for n in numbers]
    missing = sorted(set(range(first, first + expected)) - set(numbers))
    if missing or len(numbers) > expected:
        what = (
            f"picture {', '.join(str(n) for n in missing[:5])} is missing"
            if missing
            else f"{len(numbers)} pictures"
        )
        raise InputError(
            f"{folder}: {what}; a projector of {width}×{height} takes {expected} pictures, numbered {first} "
            f"to {first + expected - 1}: columns and rows as bit and inverse, white, black; or {fewer} "
            f"without inverses, {fewer - 2} without white and black, too"
        )
    return [series[n] for n in numbers]


def numbered_pictures(folder: Path) -> dict[int, Path]:
    """The longest run of files that differ in their number alone: number to file."""
    found: dict[tuple[str, str], dict[int, Path]] = {}
    for path in sorted(folder.iterdir()):
        match = _NUMBERED.match(path.name)
        if match:
            key = match["stem"], match["suffix"].lower()
            found.setdefault(key, {})[int(match["number"])] = path
    if not found:
        raise InputError(f"{folder}: holds no numbered pictures such as graycode_00.png")
    return max(found.values(), key=len)


def _refuse_unlit(folder: Path, white: Image, black: Image) -> None:
    gain = white.astype(float) - black
    noise = 1.0 + SIGMA_PER_MEDIAN * float(np.median(np.abs(gain - np.median(gain))))
    if (gain > 5.0).sum() >= _FEWEST_LIT:
        return
    if (-gain > 5.0 * noise).sum() >= _FEWEST_LIT:
        raise InputError(
            f"{folder}: the last picture is brighter than the one before; white goes before black"
        )
    raise InputError(
        f"{folder}: nothing decodes: white and black do not differ (the brightest pixel of white shows "
        f"{int(white.max())} DN); check the lens cap, that the projector was on, and the exposure"
    )


def _refuse_other_order(paths: list[Path], stack: Image) -> None:
    """A picture and its inverse add up to white and black; a gap in the sequence does not."""
    white, black = stack[-2].astype(np.int32), stack[-1].astype(np.int32)
    whole = white + black
    lit = (white - black) >= max(5.0, float(np.quantile(white - black, 0.9)) / 4.0)
    lit &= (white < white.max()) | (white.max() == white.min())
    for i in range(0, len(stack) - 2, 2):
        apart = np.abs(stack[i].astype(np.int32) + stack[i + 1] - whole)[lit]
        if len(apart) and np.median(apart / (white - black)[lit]) > _LEAST_SHARE:
            raise InputError(
                f"{paths[i].name} and {paths[i + 1].name} are not a picture and its inverse (their sum is "
                "not that of white and black); the order must be: columns and then rows, the most "
                "significant bit first, each bit before its inverse, then white, then black"
            )


def _camera_of(bits: Image, white: Image, black: Image, told_by: ToldBy) -> CameraSheet:
    """A data sheet by the photon transfer of the pictures themselves (:mod:`burrscan.captures.noise`)."""
    depth = next(d for d in _DEPTHS if int(max(bits.max(), white.max())) < 1 << d)
    top = (1 << depth) - 1
    if told_by == "inverses":
        samples = of_pairs(bits, top=top)
    else:
        samples = of_levels(bits, 2.0 * bits > white.astype(np.float32) + black, top=top)
    full_well_e, read_noise_e = noise_of(samples, top=top, black_level_dn=0.0)
    return CameraSheet(depth, full_well_e, read_noise_e, black_level_dn=0.0)


def plain_gray_patterns(*, width: int, height: int) -> Patterns:
    """What a projector of ``width`` × ``height`` shows for a plain Gray-code capture, levels 0 and 255."""
    shape = height, width
    columns, _ = encode_gray(width=width, cell_px=1)
    rows, _ = encode_gray(width=height, cell_px=1)
    frames = [
        *(np.broadcast_to(line, shape) for line in columns),
        *(np.broadcast_to(line[:, None], shape) for line in rows),
        np.ones(shape),
        np.zeros(shape),
    ]
    levels = np.stack([(255.0 * frame).astype(np.uint8) for frame in frames])
    return Patterns(levels, tuple(f"graycode_{i:02d}" for i in range(len(levels))))
