"""Decode a plain Gray-code folder by opencv-contrib and save the result.

Runs under a Python that has ``opencv-contrib-python-headless`` and numpy, nothing of this project:
``opencv-contrib`` and the ``opencv-python-headless`` that burrscan depends on cannot share an environment.

Usage: ``python gray_by_opencv.py FOLDER WIDTH HEIGHT OUT.npz``
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import cv2
import numpy as np

_contrib: Any = cv2


def main(folder: Path, width: int, height: int, out: Path) -> None:
    """Ask OpenCV for the projector pixel of every camera pixel; -1 where it refuses."""
    images = [
        _contrib.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in sorted(folder.glob("graycode_*.png"))
    ]
    code = _contrib.structured_light.GrayCodePattern.create(width, height)
    code.setWhiteThreshold(5)  # its default: the least difference between a picture and its inverse
    bits, white, black = images[:-2], images[-2].astype(int), images[-1].astype(int)
    found = np.full((*white.shape, 2), -1, np.int32)
    for row in range(white.shape[0]):
        for column in range(white.shape[1]):
            refused, pixel = code.getProjPixel(bits, column, row)
            if not refused:
                found[row, column] = pixel
    lit = white - black > 40  # OpenCV's default black threshold, which its own decode() applies
    np.savez_compressed(out, found=found, lit=lit, version=cv2.__version__)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))
