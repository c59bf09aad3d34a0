"""A scanner that writes down everything another scanner shows and sees."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from importlib import metadata
from pathlib import Path

from burrscan.arrays import Image
from burrscan.captures.document import ScanDocument, Shot
from burrscan.captures.folder import write_rig
from burrscan.captures.png import write_colour, write_grey
from burrscan.captures.sheets import sheet_tables
from burrscan.files import written_whole
from burrscan.scanner import PassThrough, Patterns, Scanner


class RecordingScanner(PassThrough):
    """Pass pictures through and keep them in a capture folder; :meth:`close` completes it.

    Parameters
    ----------
    scanner
        The scanner that does the work.
    folder
        Where the capture goes; made if it is not there.
    scan
        The strategy that is about to choose the shots, where it is known: the folder will say it.

    """

    def __init__(self, scanner: Scanner, folder: Path, *, scan: ScanDocument | None = None) -> None:
        super().__init__(scanner)
        self._folder = folder
        self._scan = scan
        self._shots: list[Shot] = []
        self._in_colour = False
        for part in ("patterns", "images"):
            (folder / part).mkdir(parents=True, exist_ok=True)

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture, and write patterns and images to the folder."""
        images = self._scanner.capture(patterns, exposure_ms)
        for name, frame, image in zip(patterns.names, patterns.frames, images, strict=True):
            file = f"{len(self._shots):04d}.png"
            shot = Shot(name, exposure_ms, f"patterns/{file}", f"images/{file}")
            write = write_grey if frame.ndim == 2 else write_colour
            self._in_colour = frame.ndim == 3
            write(self._folder / shot.pattern, frame)
            write(self._folder / shot.image, image)
            self._shots.append(shot)
        return images

    def close(self) -> None:
        """Write the documents; without them the folder is no capture."""
        write_rig(self._folder / "rig.json", self.rig)
        document = {
            "format": "burrscan-capture",
            "version": 1,
            **sheet_tables(self.camera, self.projector),
            "shots": [asdict(shot) for shot in self._shots],
        }
        if self._in_colour:
            document["channels"] = "rgb"
        if self._scan is not None:
            document["scan"] = asdict(replace(self._scan, version=metadata.version("burrscan")))
        with written_whole(self._folder / "capture.json") as beside:
            beside.write_text(json.dumps(document, indent=1) + "\n", "utf-8")
