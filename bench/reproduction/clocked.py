"""A scanner with a clock: how long a scan's pictures take, and what the computer does between them."""

from __future__ import annotations

import time

from burrscan.arrays import Image
from burrscan.scanner import PassThrough, Patterns, Scanner

FRAME_MS = 1000.0 / 60.0
"""A projector shows sixty pictures a second; a shorter exposure waits for the next."""


class Clocked(PassThrough):
    """Adds up the time that pictures would take, and the processor time that making them here took."""

    def __init__(self, scanner: Scanner) -> None:
        super().__init__(scanner)
        self.shown_ms = 0.0
        self.rendering_s = 0.0

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture; a picture lasts its exposure, and as long as the projector shows one at least."""
        self.shown_ms += len(patterns) * max(exposure_ms, FRAME_MS)
        start = time.process_time()
        images = self._scanner.capture(patterns, exposure_ms)
        self.rendering_s += time.process_time() - start
        return images
