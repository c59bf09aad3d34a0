"""Plain phase-shift folders as other people record them: numbered pictures, explained by a manifest.

N-step phase shifting at several frequencies, unwrapped in time: the lowest frequency has one period over the
projector or less, and each tells the stripe of the next higher (Huntley & Saldner 1993). The manifest is a
``capture.json`` of format ``burrscan-phase-steps``; ``README.md`` has its keys.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from burrscan.arrays import Image, freeze
from burrscan.captures.gray_folder import numbered_pictures
from burrscan.captures.noise import joined, noise_of, of_steps
from burrscan.captures.png import check_depth, read_grey
from burrscan.codes.phase import Phase, decode_phase
from burrscan.codes.unwrapping import climb
from burrscan.correspondence import Correspondence
from burrscan.devices import CameraSheet
from burrscan.documents import STRICT, build, read_json
from burrscan.errors import InputError
from burrscan.linear import linear_camera, linear_images

FORMAT = "burrscan-phase-steps"
_STEPS_WITH_NOISE = 4
"""Three steps are explained by any sine; the fourth tells noise."""
_Z = 4.0
"""Standard deviations within which a coarse phase must tell the period of the next: 1 of 16,000 errs."""


@dataclass(frozen=True)
class StepsDocument:
    """The pictures of one direction.

    Parameters
    ----------
    frequencies
        Periods over the projector's width (columns) or height (rows), rising; the first is 1 at most.
    steps
        Pictures of each frequency.
    shift
        Which way the stripes move: ``forward``, cos(phase - 2π n / steps) in picture n, or ``backward``.
    start_deg
        Phase of the first column or row in the first picture of a frequency.

    """

    __pydantic_config__ = STRICT

    frequencies: Annotated[tuple[Annotated[float, Field(gt=0.0)], ...], Field(min_length=1)]
    steps: Annotated[int, Field(ge=3)]
    shift: Literal["forward", "backward"] = "forward"
    start_deg: float = 0.0

    @property
    def pictures(self) -> int:
        """How many."""
        return len(self.frequencies) * self.steps


@dataclass(frozen=True)
class RasterDocument:
    """The projector's size."""

    __pydantic_config__ = STRICT

    width: Annotated[int, Field(gt=0)]
    height: Annotated[int, Field(gt=0)]


@dataclass(frozen=True)
class PhaseCameraDocument:
    """What is known of the camera; what is not is estimated, or nothing out of the ordinary."""

    __pydantic_config__ = STRICT

    bit_depth: Annotated[int, Field(ge=1, le=16)] = 8
    black_level_dn: Annotated[float, Field(ge=0.0)] = 0.0
    full_well_e: Annotated[float, Field(gt=0.0)] | None = None
    read_noise_e: Annotated[float, Field(ge=0.0)] | None = None


@dataclass(frozen=True)
class PhaseDocument:
    """``capture.json`` of a plain phase-shift folder; its fields are described in README.md."""

    __pydantic_config__ = STRICT

    format: Literal["burrscan-phase-steps"]
    version: Literal[1]
    projector: RasterDocument
    columns: StepsDocument
    rows: StepsDocument | None = None
    order: Literal["frequency", "step"] = "frequency"
    images: tuple[str, ...] | None = None
    camera: PhaseCameraDocument = PhaseCameraDocument()


@dataclass(frozen=True)
class PhaseCapture:
    """The pictures of a plain phase-shift folder.

    Parameters
    ----------
    columns, rows
        (frequencies, steps, h, w) DN, stripes moving forward; ``rows`` is None where only columns were coded.
    white
        (h, w) DN, twice the mean of the first frequency's pictures: what full light gives in a dark room.
    camera
        Its data sheet, noise as stated or as the pictures tell.
    document
        What the folder says of itself.

    """

    columns: Image
    rows: Image | None
    white: Image
    camera: CameraSheet
    document: PhaseDocument

    def __post_init__(self) -> None:
        freeze(self, columns=self.columns, rows=self.rows, white=self.white)


def is_phase_folder(folder: Path) -> bool:
    """Whether a folder's ``capture.json`` says that it holds phase steps."""
    try:
        document = json.loads((folder / "capture.json").read_text("utf-8"))
    except (OSError, ValueError, RecursionError):
        return False
    return isinstance(document, dict) and document.get("format") == FORMAT


def read_phase_folder(folder: Path, *, camera: CameraSheet | None = None) -> PhaseCapture:
    """Read a plain phase-shift folder.

    Parameters
    ----------
    folder
        The pictures and ``capture.json``.
    camera
        The camera's measured data sheet, in place of what the folder says or shows.

    Raises
    ------
    InputError
        With every error in the manifest; for pictures that are missing, too many, of different sizes or
        deeper than the camera; for noise that neither the manifest nor the pictures tell.

    """
    path = folder / "capture.json"
    document = build(PhaseDocument, read_json(path), source=str(path))
    for name, axis in (("columns", document.columns), ("rows", document.rows)):
        if axis is not None:
            _check_ladder(f"{path}: {name}.frequencies", axis)
    stack = _stack(folder, document)
    count = document.columns.pictures
    columns = _ordered(stack[:count], document.columns, document.order)
    rows = _ordered(stack[count:], document.rows, document.order) if document.rows else None
    depth = camera.bit_depth if camera else document.camera.bit_depth
    white = np.minimum(2.0 * columns[0].mean(axis=0), (1 << depth) - 1).astype(stack.dtype)
    return PhaseCapture(columns, rows, white, camera or _camera(path, document, columns, rows), document)


def decode_phase_capture(capture: PhaseCapture) -> Correspondence:
    """Projector columns, and rows where they were coded.

    As the code ``ladder`` decodes: a pixel is accepted where no step clips, no frequency's noise could name
    another stripe of the next, and the position is known to 0.4 of a column. O(pictures · pixels).
    """
    document, raster = capture.document, capture.document.projector
    u = _decoded(capture.columns, document.columns, raster.width, capture.camera)
    if capture.rows is None or document.rows is None:
        return u
    v = _decoded(capture.rows, document.rows, raster.height, capture.camera)
    mask, nan = u.mask & v.mask, np.float32(np.nan)
    return Correspondence(
        u_px=np.where(mask, u.u_px, nan),
        sigma_u_px=np.where(mask, u.sigma_u_px, nan),
        mask=mask,
        v_px=np.where(mask, v.u_px, nan),
        sigma_v_px=np.where(mask, v.sigma_u_px, nan),
    )


def _check_ladder(where: str, axis: StepsDocument) -> None:
    rising = all(low < high for low, high in pairwise(axis.frequencies))
    if not rising or axis.frequencies[0] > 1.0:
        raise InputError(
            f"{where}: periods over the projector's whole extent, rising, the first of them 1 or less, "
            "without which nothing tells the stripes apart; these are "
            f"{', '.join(f'{f:g}' for f in axis.frequencies)}"
        )


def _stack(folder: Path, document: PhaseDocument) -> Image:
    expected = document.columns.pictures + (document.rows.pictures if document.rows else 0)
    if document.images is None:
        series = numbered_pictures(folder)
        paths = [series[number] for number in sorted(series)]
    else:
        paths = [folder / name for name in document.images]
    if len(paths) != expected:
        raise InputError(
            f"{folder}: {len(paths)} pictures, but capture.json speaks of {expected}: frequencies times "
            "steps, of columns and then of rows"
        )
    images = [read_grey(path) for path in paths]
    for path, image in zip(paths, images, strict=True):
        check_depth(image, document.camera.bit_depth, path)
        if image.shape != images[0].shape:
            raise InputError(
                f"{path}: {image.shape[1]}×{image.shape[0]} pixels, but {paths[0].name} has "
                f"{images[0].shape[1]}×{images[0].shape[0]}"
            )
    stack: Image = np.stack(images)
    return stack


def _ordered(stack: Image, axis: StepsDocument, order: str) -> Image:
    """(frequencies, steps, h, w), stripes moving forward."""
    count, shape = len(axis.frequencies), stack.shape[1:]
    if order == "step":
        blocks = stack.reshape(axis.steps, count, *shape).swapaxes(0, 1)
    else:
        blocks = stack.reshape(count, axis.steps, *shape)
    if axis.shift == "backward":
        blocks = blocks[:, -np.arange(axis.steps)]
    return np.ascontiguousarray(blocks)


def _camera(path: Path, document: PhaseDocument, columns: Image, rows: Image | None) -> CameraSheet:
    stated = document.camera
    full_well_e, read_noise_e = stated.full_well_e, stated.read_noise_e
    if full_well_e is None or read_noise_e is None:
        blocks = [b for some in (columns, rows) if some is not None for b in some]
        telling = [block for block in blocks if len(block) >= _STEPS_WITH_NOISE]
        if not telling:
            raise InputError(
                f"{path}: camera.full_well_e and camera.read_noise_e: state them; three steps leave nothing "
                "beside the sine to estimate them from"
            )
        top = (1 << stated.bit_depth) - 1
        samples = joined([of_steps(block, top=top) for block in telling])
        found = noise_of(samples, top=top, black_level_dn=stated.black_level_dn)
        full_well_e = found[0] if full_well_e is None else full_well_e
        read_noise_e = found[1] if read_noise_e is None else read_noise_e
    return CameraSheet(stated.bit_depth, full_well_e, read_noise_e, stated.black_level_dn)


def _decoded(blocks: Image, axis: StepsDocument, extent: int, camera: CameraSheet) -> Correspondence:
    phases = tuple(
        _started(_phase(block, camera, extent / frequency), axis.start_deg)
        for block, frequency in zip(blocks, axis.frequencies, strict=True)
    )
    longest = phases[0]
    margin = 0.5 * (longest.period_px - extent) + 0.5
    place = (longest.offset_px.astype(float) + margin) % longest.period_px
    edge = np.minimum(place, longest.period_px - place)  # beyond it the other border begins
    return climb(phases, place - margin, edge < _Z * longest.sigma_px, width=extent, z=_Z)


def _phase(block: Image, camera: CameraSheet, period_px: float) -> Phase:
    return decode_phase(linear_images(block, camera), camera=linear_camera(camera), period_px=period_px)


def _started(phase: Phase, start_deg: float) -> Phase:
    """The phase counted from where the first column has none."""
    moved = (phase.offset_px - np.float32(start_deg / 360.0 * phase.period_px)) % np.float32(phase.period_px)
    return replace(phase, offset_px=moved.astype(np.float32))
