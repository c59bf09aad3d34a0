"""PNG files whose numbers matter: 8 and 16 bits, one channel."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from burrscan.errors import InputError


def write_grey(path: Path, image: NDArray[np.uint8] | NDArray[np.uint16]) -> None:
    """Write a grey image (h, w), 8 or 16 bits as its type says."""
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
    if not path.is_file():
        raise InputError(f"{path}: no such image; the capture is incomplete")
    image = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)
    if image is None:
        raise InputError(f"{path}: not an image that can be read")
    if image.ndim == 3:
        if np.any(image[..., :3] != image[..., :1]):
            raise InputError(f"{path}: a colour image; captures are grey: convert it first")
        image = image[..., 0]
    grey: NDArray[np.uint16] = image.astype(np.uint16)
    return grey
