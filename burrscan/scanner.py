"""The one port: whatever can show patterns and take pictures is a scanner.

The simulator in ``scenes``, a folder of recorded images and real hardware stand behind the same protocol.
Adaptive scanning is a loop over :meth:`Scanner.capture`, nothing more.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from burrscan.arrays import Image, Levels, freeze
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import Rig


@dataclass(frozen=True)
class Patterns:
    """A stack of images to project.

    Parameters
    ----------
    frames
        (F, height, width) projector levels 0 .. 255. A broadcast view is welcome: columns that do not vary
        along the rows need no memory. A scanner in colour takes (F, height, width, 3), a level per primary,
        red first, and gives images (F, h, w, 3): see :mod:`burrscan.colour`.
    names
        One name per frame, unique within the stack, such as ``gray-u-03-inverse``.

    """

    frames: Levels
    names: tuple[str, ...]

    def __post_init__(self) -> None:
        freeze(self, frames=self.frames)
        if self.frames.ndim not in (3, 4) or len(self.names) != len(self.frames):
            msg = f"patterns of shape {self.frames.shape} do not fit {len(self.names)} names"
            raise ValueError(msg)

    def __len__(self) -> int:
        return len(self.names)


class Scanner(Protocol):
    """A projector that shows patterns and a camera that looks."""

    @property
    def rig(self) -> Rig:
        """The calibration as the algorithm is told it."""

    @property
    def camera(self) -> CameraSheet:
        """The camera's data sheet."""

    @property
    def projector(self) -> ProjectorSheet:
        """The projector's data sheet."""

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show each pattern, expose for ``exposure_ms`` and return the images, (F, height, width) DN.

        They are raw: a strategy begins with ``scanner = linear(scanner)`` (:mod:`burrscan.linear`), which
        takes the response curve off where the camera has one.

        Raises
        ------
        burrscan.errors.InputError
            When a recorded scanner lacks a frame, or the exposure is outside what the camera offers.

        """


class PassThrough:
    """A scanner in front of another, with the same devices; its heirs say what a capture does besides."""

    def __init__(self, scanner: Scanner) -> None:
        self._scanner = scanner

    @property
    def rig(self) -> Rig:
        """The calibration as the algorithm is told it."""
        return self._scanner.rig

    @property
    def camera(self) -> CameraSheet:
        """The camera's data sheet."""
        return self._scanner.camera

    @property
    def projector(self) -> ProjectorSheet:
        """The projector's data sheet."""
        return self._scanner.projector
