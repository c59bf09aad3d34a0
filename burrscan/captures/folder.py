"""A capture folder as a scanner: it shows nothing new, but it has the pictures."""

from __future__ import annotations

import json
import math
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from burrscan.arrays import Image
from burrscan.captures.document import CaptureDocument, RigDocument, ScanDocument, Shot
from burrscan.captures.noise import Samples, joined, noise_of, of_pairs, of_steps
from burrscan.captures.png import check_depth, read_colour, read_grey
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.documents import build, read_json
from burrscan.errors import InputError
from burrscan.files import written_whole
from burrscan.rig import Rig, View
from burrscan.scanner import Patterns

_NAMED = 5
"""Exposures or shots that a message lists: a line of it."""
_GROUPS = 4
"""Runs of shots that are read for the noise."""
_FEWEST_ALIKE = 4
"""Steps of a sine that leave something beside it; two pairs."""


class FolderScanner:
    """A :class:`burrscan.Scanner` that replays a capture folder (``burrscan/captures/README.md``).

    Parameters
    ----------
    folder
        The capture folder.
    rig
        In place of its ``rig.json``.
    sheets
        Data sheets of camera and projector, in place of those in ``capture.json``.

    Raises
    ------
    InputError
        When the folder's documents cannot be used; every error in them is listed.

    """

    def __init__(
        self,
        folder: Path,
        *,
        rig: Rig | None = None,
        sheets: tuple[CameraSheet, ProjectorSheet] | None = None,
    ) -> None:
        self._folder = folder
        self._document = read_capture(folder)
        self._rig = rig or read_rig(folder / "rig.json")
        self._asked: Counter[tuple[str, float]] = Counter()
        self._read_png = read_colour if self._document.channels == "rgb" else read_grey
        self._camera, self._projector = sheets or (self._sheet(), self._document.projector.sheet())

    @property
    def rig(self) -> Rig:
        """The calibration."""
        return self._rig

    @property
    def camera(self) -> CameraSheet:
        """The camera's data sheet."""
        return self._camera

    @property
    def projector(self) -> ProjectorSheet:
        """The projector's data sheet."""
        return self._projector

    @property
    def scan(self) -> ScanDocument | None:
        """The strategy that chose the shots, where the folder says it."""
        return self._document.scan

    @property
    def shots(self) -> tuple[Shot, ...]:
        """Everything that was recorded, in order."""
        return self._document.shots

    @property
    def replayed(self) -> int:
        """How many shots have been asked for so far."""
        return sum(self._asked.values())

    def image(self, shot: Shot) -> Image:
        """What the camera saw in a shot, (h, w) DN; (h, w, 3) in colour.

        Raises
        ------
        InputError
            When the file is missing, damaged, of the wrong size, or holds values beyond the bit depth.

        """
        image = self._read(shot.image, self._rig.camera)
        check_depth(image, self.camera.bit_depth, self._folder / shot.image)
        return image

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Find the pictures that were taken of ``patterns``, (F, h, w) DN; (F, h, w, 3) in colour.

        The n-th request for a name at an exposure gets the n-th shot of it.

        Raises
        ------
        InputError
            When the folder has no such shot, its pattern differs from what is asked, or a file is damaged.

        """
        shots = [self._shot(name, exposure_ms) for name in patterns.names]
        for shot, frame in zip(shots, patterns.frames, strict=True):
            if not np.array_equal(self._read(shot.pattern, self._rig.projector), frame):
                raise InputError(
                    f"{self._folder / shot.pattern}: the recorded pattern '{shot.name}' is not the one this "
                    "scan would show; scan with the strategy and the parameters of the recording"
                    + self._recorded_by()
                )
        return np.stack([self.image(shot) for shot in shots])

    def _sheet(self) -> CameraSheet:
        """The camera's sheet; the noise that ``capture.json`` does not state is that of the pictures."""
        stated = self._document.camera
        if stated.complete:
            return stated.sheet()
        where = f"{self._folder / 'capture.json'}: camera.full_well_e and camera.read_noise_e"
        if stated.response or self._document.channels == "rgb":
            raise InputError(f"{where}: state them; they are estimated for linear grey cameras only")
        top = (1 << stated.bit_depth) - 1
        groups = [self._samples(kind, shots, top) for kind, shots in _alike(self._document.shots)[:_GROUPS]]
        if not groups:
            raise InputError(
                f"{where}: state them; they can be estimated from patterns with inverses, or from sines of "
                "four steps or more, and there are none"
            )
        full_well_e, read_noise_e = noise_of(joined(groups), top=top, black_level_dn=stated.black_level_dn)
        return stated.sheet(full_well_e=full_well_e, read_noise_e=read_noise_e)

    def _samples(self, kind: str, shots: list[Shot], top: int) -> Samples:
        images = np.stack([self._read(shot.image, self._rig.camera) for shot in shots])
        return (of_pairs if kind == "pairs" else of_steps)(images, top=top)

    def _recorded_by(self) -> str:
        scan = self.scan
        return f" ('{scan.method}' of burrscan {scan.version})" if scan is not None else ""

    def _shot(self, name: str, exposure_ms: float) -> Shot:
        taken = [s for s in self._document.shots if s.name == name]
        same = [s for s in taken if math.isclose(s.exposure_ms, exposure_ms, rel_tol=1e-6)]
        place = self._asked[name, round(exposure_ms, 9)]
        if place >= len(same):
            raise InputError(self._missing(name, exposure_ms, taken))
        self._asked[name, round(exposure_ms, 9)] += 1
        return same[place]

    def _missing(self, name: str, exposure_ms: float, taken: list[Shot]) -> str:
        if taken:
            known = ", ".join(f"{s.exposure_ms:g}" for s in taken[:_NAMED])
            return f"{self._folder}: no shot '{name}' at {exposure_ms:g} ms; it was taken at {known} ms"
        names = ", ".join(s.name for s in self._document.shots[:_NAMED])
        return f"{self._folder}: no shot '{name}'{_meant(name)}; the capture begins with {names}, ..."

    def _read(self, relative: str, view: View) -> Image:
        image = self._read_png(self._folder / relative)
        if image.shape[:2] != view.shape:
            raise InputError(
                f"{self._folder / relative}: {image.shape[1]}×{image.shape[0]} pixels, but rig.json says "
                f"{view.width}×{view.height}"
            )
        return image


def _meant(name: str) -> str:
    """What an even shot is, for those who record captures themselves."""
    if not name.startswith("even-"):
        return ""
    return (
        f", the whole projector at level {int(name.removeprefix('even-'))} of 255, taken at the exposure of "
        "the code (burrscan/captures/README.md lists the shots of each strategy)"
    )


def _alike(shots: Sequence[Shot]) -> list[tuple[str, list[Shot]]]:
    """Runs of shots that tell the noise: ``pairs`` of a pattern and its inverse, ``steps`` of one sine."""
    found: list[tuple[str, list[Shot]]] = []
    pairs: list[Shot] = []
    steps: list[Shot] = []
    for one, other in zip(shots, [*shots[1:], None], strict=True):
        same = other is not None and other.exposure_ms == one.exposure_ms
        if other is not None and same and other.name == f"{one.name}-inverse":
            if pairs and pairs[-1].exposure_ms != one.exposure_ms:
                found, pairs = [*found, ("pairs", pairs)], []
            pairs += [one, other]
        stem = one.name.rpartition("-")[0]
        if stem.startswith("sine-"):
            steps.append(one)
            if not (other is not None and same and other.name.rpartition("-")[0] == stem):
                found, steps = [*found, ("steps", steps)], []
    runs = [*found, ("pairs", pairs)]
    return [(kind, run) for kind, run in runs if len(run) >= _FEWEST_ALIKE]


def read_capture(folder: Path) -> CaptureDocument:
    """What ``capture.json`` says; :class:`InputError` with every error in it."""
    path = folder / "capture.json"
    return build(CaptureDocument, read_json(path), source=str(path))


def rasters_of(folder: Path) -> Rig:
    """A rig of the right rasters and of nothing else, for captures of what the rig is to be known from.

    Raises
    ------
    InputError
        When ``capture.json`` cannot be used, or its first pictures are missing.

    """
    shot = read_capture(folder).shots[0]
    return Rig(_raster(folder / shot.image), _raster(folder / shot.pattern), np.eye(4))


def _raster(path: Path) -> View:
    height, width = read_grey(path).shape
    return View(width, height, float(width), float(width), 0.5 * (width - 1), 0.5 * (height - 1))


def read_rig(path: Path) -> Rig:
    """A calibration from a JSON file.

    Raises
    ------
    InputError
        With every error in the file.

    """
    return build(RigDocument, read_json(path), source=str(path)).rig(source=str(path))


def write_rig(path: Path, rig: Rig) -> None:
    """Write a calibration as JSON, whole or not at all."""
    document = {
        "unit": "mm",
        "camera": vars(rig.camera),
        "projector": vars(rig.projector),
        "T_projector_camera": rig.T_projector_camera.tolist(),
    }
    with written_whole(path) as beside:
        beside.write_text(json.dumps(document, indent=2) + "\n", "utf-8")
