"""What was shown to the scanner, and the light of it a few frames at a time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Floats32, Image
from burrscan.devices import ProjectorSheet
from burrscan.scanner import PassThrough, Patterns, Scanner

_FRAMES_AT_ONCE = 12
"""Bounds memory: frames of a megapixel take 4 MB each."""


@dataclass(frozen=True)
class Shot:
    """One call of :meth:`burrscan.scanner.Scanner.capture`."""

    patterns: Patterns
    exposure_ms: float


class WatchedScanner(PassThrough):
    """Pass pictures through and remember what was shown and for how long, in ``shots``."""

    def __init__(self, scanner: Scanner) -> None:
        super().__init__(scanner)
        self.shots: list[Shot] = []

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture, and remember."""
        self.shots.append(Shot(patterns, exposure_ms))
        return self._scanner.capture(patterns, exposure_ms)


def shone(shots: Sequence[Shot], sheet: ProjectorSheet) -> Iterator[tuple[Floats32, float]]:
    """Light of a few frames at a time, (f, height or 1, width), and their exposure, ms.

    Frames of even columns have one row, to be broadcast.
    """
    table = sheet.light.astype(np.float32)
    for shot in shots:
        frames = shot.patterns.frames
        rows = slice(1) if frames.strides[1] == 0 else slice(None)
        for first in range(0, len(frames), _FRAMES_AT_ONCE):
            yield table[frames[first : first + _FRAMES_AT_ONCE, rows]], shot.exposure_ms
