"""Agreement of our decoding of a plain Gray-code folder with opencv-contrib's; see the README beside.

Usage: ``python -m bench.checks.gray_agreement FOLDER WIDTHxHEIGHT --opencv PYTHON``
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from bench.cli.grammar import raster
from burrscan.captures.gray_folder import decode_gray_capture, read_gray_folder


def agreement(folder: Path, width: int, height: int, decoded: Path) -> dict[str, Any]:
    """Compare our decoding with one that ``gray_by_opencv.py`` saved."""
    ours = decode_gray_capture(read_gray_folder(folder, width=width, height=height))
    with np.load(decoded) as theirs:
        found, lit, version = theirs["found"], theirs["lit"], str(theirs["version"])
    assert ours.v_px is not None
    both = ours.mask & (found >= 0).all(axis=-1)
    off = np.maximum(np.abs(ours.u_px - found[..., 0]), np.abs(ours.v_px - found[..., 1]))
    return {
        "opencv": version,
        "accepted_by_us": int(ours.mask.sum()),
        "accepted_by_opencv": int((found >= 0).all(axis=-1).sum()),
        "accepted_by_opencv_and_lit": int(((found >= 0).all(axis=-1) & lit).sum()),
        "both": int(both.sum()),
        "same_pixel_or_border_percent": 100.0 * float((off[both] <= 0.5).mean()),
        "within_1_px_percent": 100.0 * float((off[both] <= 1.0).mean()),
        "same_pixel_or_border_percent_lit": 100.0 * float((off[both & lit] <= 0.5).mean()),
    }


def main() -> None:
    """Decode by both and print the figures as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("raster", type=raster)
    parser.add_argument("--opencv", required=True, help="a Python with opencv-contrib-python-headless")
    given = parser.parse_args()
    width, height = given.raster
    worker = Path(__file__).with_name("gray_by_opencv.py")
    with tempfile.TemporaryDirectory() as scratch:
        out = Path(scratch) / "opencv.npz"
        asked = [given.opencv, str(worker), str(given.folder), str(width), str(height), str(out)]
        subprocess.run(asked, check=True)  # noqa: S603
        figures = agreement(given.folder, width, height, out)
    sys.stdout.write(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
