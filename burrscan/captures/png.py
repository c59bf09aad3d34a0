"""PNG files whose numbers matter: 8 and 16 bits, one channel or three."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from burrscan.errors import InputError


def write_grey(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write a grey image (h, w), 8 or 16 bits as its type says."""
    _write(path, image)


def _write(path: Path, image: NDArray[np.generic]) -> None:
    done, data = cv2.imencode(".png", np.ascontiguousarray(image))
    if not done:
        raise InputError(f"{path}: the image could not be encoded as PNG")
    path.write_bytes(data.tobytes())


def read_grey(path: Path) -> NDArray[np.uint16]:
    """Read a grey image (h, w) as it is, 8 or 16 bits.

    Raises
    ------
    InputError
        When the file is missing, no image, or in colour with channels that differ.

    """
    image = _read(path)
    if image.ndim == 3:
        if np.any(image[..., :3] != image[..., :1]):
            raise InputError(f"{path}: a colour image; captures are grey: convert it first")
        image = image[..., 0]
    grey: NDArray[np.uint16] = image.astype(np.uint16)
    return grey


def write_colour(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write an image in colour (h, w, 3), red first, 8 or 16 bits as its type says."""
    _write(path, image[..., ::-1])


def read_colour(path: Path) -> NDArray[np.uint16]:
    """Read an image in colour (h, w, 3) as it is, red first, 8 or 16 bits.

    Raises
    ------
    InputError
        When the file is missing, no image, or grey.

    """
    image = _read(path)
    if image.ndim != 3:
        raise InputError(f"{path}: a grey image, but the others' camera has three channels")
    return np.ascontiguousarray(image[..., 2::-1], dtype=np.uint16)


def _read(path: Path) -> NDArray[np.generic]:
    if not path.is_file():
        raise InputError(f"{path}: no such image; the capture is incomplete")
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: not an image that can be read")
    return np.asarray(image)


def check_depth(image: NDArray[np.uint16], bit_depth: int, path: Path) -> None:
    """Refuse values that ``bit_depth`` bits cannot hold.

    Raises
    ------
    InputError
        With the depth that the values need, or how far they are shifted.

    """
    highest = int(image.max(initial=0))
    if highest < 1 << bit_depth:
        return
    spare = 16 - bit_depth
    shifted = not np.any(image & np.uint16((1 << spare) - 1))
    cure = (
        f"the values are shifted left: divide them by {1 << spare}"
        if shifted
        else f"state a bit_depth of {highest.bit_length()} or more, or convert the images"
    )
    raise InputError(
        f"{path}: values up to {highest}, but the camera is said to have {bit_depth} bits "
        f"(0 to {(1 << bit_depth) - 1}); {cure}"
    )
