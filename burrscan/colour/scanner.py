"""A grey scanner made of one in colour: three frames in each picture."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Image, Levels
from burrscan.codes.code import bayer
from burrscan.colour.mixing import CHANNELS, Mixing, linear_electrons
from burrscan.colour.packing import packed
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.linear import linear_camera
from burrscan.scanner import PassThrough, Patterns, Scanner

_TOP = 65_535
"""Of the unmixed camera's 16 bits; it stands for clipped."""
_BLACK_DN = 2000.0
"""Black level of the unmixed camera: unmixing makes dark pixels negative, and this many DN of noise must
fit below 0."""
_ADDS = 1e-3
"""Weight of a channel in an unmixed picture, under which its clipping moves that by less than noise."""


class MonoScanner(PassThrough):
    """A scanner whose every frame has a primary to itself.

    The primaries are dimmed to the balance of ``mixing``, so that the frames of all channels have the same
    unit, and the pictures are multiplied by the inverse of the mixing matrix.

    Parameters
    ----------
    scanner
        The scanner in colour.
    mixing
        What to undo; the identity undoes nothing.
    frames
        Pictures that were taken to know ``mixing``; they count.

    Attributes
    ----------
    frames
        Pictures taken so far.

    """

    def __init__(self, scanner: Scanner, mixing: Mixing, *, frames: int = 0) -> None:
        super().__init__(scanner)
        self.frames = frames
        self._mixing = mixing
        self._camera = unmixed_camera(scanner.camera, mixing)
        self._projector, self._tables = balanced_projector(scanner.projector, mixing)

    @property
    def camera(self) -> CameraSheet:
        """The data sheet of one unmixed channel."""
        return self._camera

    @property
    def projector(self) -> ProjectorSheet:
        """The data sheet of one balanced primary."""
        return self._projector

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Show the frames three at a time and return a grey image of each, (F, h, w) DN.

        Frames that have no other group beside them are shown by all primaries at once; their image is the
        mean of the three.
        """
        places = packed(patterns)
        shown = self._shown(patterns, places)
        images = self._scanner.capture(shown, exposure_ms)
        self.frames += len(shown)
        grey = np.empty((len(patterns), *images.shape[1:3]), np.uint16)
        alike = places[0] == places[1]
        for number, image in enumerate(images):
            light, clipped = self._unmixed(image)
            if alike:
                grey[number] = self._dn(light.mean(axis=-1), clipped.max(axis=-1))
                continue
            for k in range(CHANNELS):
                if number < len(places[k]):
                    grey[places[k][number]] = self._dn(light[..., k], clipped[..., k])
        return grey

    def _shown(self, patterns: Patterns, places: tuple[tuple[int, ...], ...]) -> Patterns:
        """Frames in colour, (pictures, H, W, 3); columns that do not vary stay broadcast."""
        frames = patterns.frames
        columns = frames.strides[1] == 0
        pictures = max(map(len, places))
        rows = 1 if columns else frames.shape[1]
        levels = np.empty((pictures, rows, frames.shape[2], CHANNELS), np.uint8)
        levels[:] = [table[0] for table in self._rounded]
        for k, numbers in enumerate(places):
            for number, frame in enumerate(numbers):
                levels[number, ..., k] = self._levels(frames[frame, :rows], k, dithered=not columns)
        shape = (pictures, *frames.shape[1:], CHANNELS)
        return Patterns(np.broadcast_to(levels, shape), _names(patterns.names, places))

    @property
    def _rounded(self) -> Levels:
        return np.rint(self._tables).astype(np.uint8)

    def _levels(self, frame: Levels, primary: int, *, dithered: bool) -> Levels:
        """A frame in the levels of a primary; dithered where it was: a level there is a mean of two."""
        if not dithered or np.array_equal(self._tables[primary], np.arange(256.0)):
            return np.asarray(self._rounded[primary][frame])
        levels = self._tables[primary].astype(np.float32)[frame] + bayer(frame.shape)
        return np.asarray(np.minimum(levels, 255.0), np.uint8)

    def _unmixed(self, image: Image) -> tuple[Floats32, Bools]:
        """(h, w, primary) electrons of each primary's picture, and where a channel that adds to it clips."""
        raw, unmix = self._scanner.camera, self._mixing.unmix
        light = linear_electrons(image, raw) @ unmix.T.astype(np.float32)
        adds = (np.abs(unmix) > _ADDS).astype(np.float32)
        return light, np.asarray((image >= raw.clipped_dn).astype(np.float32) @ adds.T > 0.0)

    def _dn(self, electrons: Floats32, clipped: Bools) -> Image:
        """DN of the unmixed camera."""
        gain = np.float32((_TOP - _BLACK_DN) / linear_camera(self._scanner.camera).full_well_e)
        dn = np.clip(electrons * gain + np.float32(_BLACK_DN + 0.5), 0.0, _TOP)
        return np.where(clipped, _TOP, dn).astype(np.uint16)


def unmixed_camera(raw: CameraSheet, mixing: Mixing) -> CameraSheet:
    """The sheet of a channel after unmixing: shot noise of all that it was mixed of.

    With U the inverse of the mixing matrix N, the variance of an unmixed value is ``Σ_c U_kc² (x_c + r²)``
    for channels of x electrons and dark noise r. Where the primaries' frames are equally bright in the mean,
    as sines and bits are, ``x_c = y Σ_j N_cj``: the variance is ``b y + a`` with ``b = Σ_c U_kc² Σ_j N_cj``
    and ``a = r² Σ_c U_kc²``, averaged over the channels. A camera of b times fewer electrons has that noise.
    """
    sheet = linear_camera(replace(raw, response=raw.response[:1], crosstalk=()))
    squares = mixing.unmix**2
    b = float((squares @ mixing.mixed.sum(axis=1)).mean())
    dark = sheet.read_noise_e**2 + 1.0 / (12.0 * sheet.gain_dn_per_e**2)
    a = dark * float(squares.sum(axis=1).mean())
    return CameraSheet(
        bit_depth=16,
        full_well_e=sheet.full_well_e / b,
        read_noise_e=float(np.sqrt(a)) / b,
        black_level_dn=_BLACK_DN,
        exposure_range_ms=raw.exposure_range_ms,
    )


def balanced_projector(raw: ProjectorSheet, mixing: Mixing) -> tuple[ProjectorSheet, Floats]:
    """The sheet of a balanced primary, and (primaries, 256) the levels of each primary that show its levels.

    It has the first primary's curve over the highest black level of the balanced primaries; where nothing
    has to be balanced, levels stay as they are.
    """
    balance = mixing.balance
    first = raw.primary(0).light
    black = max(raw.primary(k).light[0] / balance[k] for k in range(CHANNELS))
    light = black + (1.0 - black) * (first - first[0]) / (1.0 - first[0])
    tables = [raw.primary(k).levels(balance[k] * light) for k in range(CHANNELS)]
    same = np.allclose(light, first) and np.allclose(balance, 1.0) and raw.light.ndim == 1
    return ProjectorSheet(light), np.tile(np.arange(256.0), (CHANNELS, 1)) if same else np.stack(tables)


def _names(names: tuple[str, ...], places: tuple[tuple[int, ...], ...]) -> tuple[str, ...]:
    """A picture's name: those of its frames."""
    if places[0] == places[1]:
        return names
    pictures = max(map(len, places))
    return tuple("+".join(names[one[n]] for one in places if n < len(one)) for n in range(pictures))
