"""How the small data came about: ``python -m tests.data.make`` writes it anew from ``../shared/data``.

Meshes of many faces are thinned by quadric edge collapse, those of few are copied. The capture is cropped to
320×256 pixels of every picture; one picture, all white, stays whole, for the chessboard in it.
"""

import shutil
from pathlib import Path

import cv2
import fast_simplification
import numpy as np
import trimesh

from burrscan.captures.png import read_grey
from tests.data import HERE, WHOLE

FACES = {"husky_wheel.stl": 8000, "tb3_left_tire.stl": 6000, "jackal_wheel.stl": 1600, "tm_torus.STL": 2000}
COPIED = ("tm_round.stl", "tm_tube.obj")
ROWS, COLUMNS = slice(120, 376), slice(820, 1140)  # the corner of the board, tape, and the wall behind
WHITE = "graycode_40.png"
SMALLEST = (cv2.IMWRITE_PNG_COMPRESSION, 9, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_FILTERED)


def thin(name: str, faces: int) -> None:
    """Write one mesh with so many faces left."""
    mesh = trimesh.load(WHOLE / "meshes" / name, process=True)
    points, triangles = fast_simplification.simplify(
        np.asarray(mesh.vertices), np.asarray(mesh.faces), target_count=faces
    )
    trimesh.Trimesh(points, triangles, process=False).export(HERE / "meshes" / name)


def crop(source: Path, target: Path) -> None:
    """Write one picture's part."""
    cv2.imwrite(
        str(target), np.ascontiguousarray(read_grey(source)[ROWS, COLUMNS].astype(np.uint8)), SMALLEST
    )


def main() -> None:
    """Write everything anew."""
    for name, faces in FACES.items():
        thin(name, faces)
    for name in COPIED:
        shutil.copyfile(WHOLE / "meshes" / name, HERE / "meshes" / name)
    whole, here = WHOLE / "captures" / "procam", HERE / "procam"
    for picture in sorted((whole / "capture_0").glob("*.png")):
        crop(picture, here / "capture_0" / picture.name)
    cv2.imwrite(str(here / "white.png"), read_grey(whole / "capture_0" / WHITE).astype(np.uint8), SMALLEST)
    for name in ("LICENSE", "calibration_result.xml"):
        shutil.copyfile(whole / name, here / name)


if __name__ == "__main__":
    main()
