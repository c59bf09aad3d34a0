"""Columns and rows: the classical scan twice, for whoever has no calibration yet to tell rows by."""

from __future__ import annotations

from typing import Any

import numpy as np

from burrscan.codes import METHODS as CODES
from burrscan.codes.code import Code, patterns
from burrscan.correspondence import Correspondence, Scan
from burrscan.devices import ProjectorSheet
from burrscan.linear import linear
from burrscan.rig import View
from burrscan.scan.exposure import even, served
from burrscan.scanner import Patterns, Scanner
from burrscan.variants import check_parameters, resolve


def scan_rows_and_columns(
    scanner: Scanner,
    *,
    code: str = "gray_phase",
    parameters: dict[str, Any] | None = None,
    exposure_ms: float | None = None,
) -> Scan:
    """Scan with a code over the columns and then with the same over the rows, at full light.

    It uses nothing of the rig but both rasters: captures of a calibration board are made with it.

    Parameters
    ----------
    scanner
        The instrument.
    code, parameters
        A code family of :data:`burrscan.codes.METHODS`, or ``"module:function"``, and its parameters.
    exposure_ms
        Fixed by hand; by default bracketing chooses the exposure at which most pixels are unclipped and
        fine (see :func:`burrscan.scan.exposure.served`).

    Notes
    -----
    Frames: the bracket, both codes, one white; 53 with the defaults. A pixel is accepted where both decode.

    Raises
    ------
    burrscan.errors.InputError
        For an unknown family or parameter.

    """
    scanner = linear(scanner)
    family = resolve(code, CODES, stage="code")
    given = dict(parameters or {})
    check_parameters(family, given, stage=f"code '{code}'")
    exposure_ms, spent, radiance = served(scanner, exposure_ms)
    view = scanner.rig.projector
    columns, rows = family(width=view.width, **given), family(width=view.height, **given)
    across = patterns(columns.light, columns.names, view=view, sheet=scanner.projector)
    down = _along_rows(rows, view, scanner.projector)
    of_columns = scanner.capture(across, exposure_ms)
    of_rows = scanner.capture(down, exposure_ms)
    white = scanner.capture(even(scanner, levels=(255,)), exposure_ms)[0]
    full = scanner.camera.clipped_dn
    return Scan(
        correspondence=_joined(
            columns.decode(of_columns, scanner.camera), rows.decode(of_rows, scanner.camera)
        ),
        frames=spent + len(across) + len(down) + 1,
        exposures_ms=(exposure_ms,),
        white=white,
        saturated=np.asarray((of_columns >= full).any(axis=0) | (of_rows >= full).any(axis=0)),
        pattern=across.frames[-1],
        image=of_columns[-1],
        radiance=radiance,
    )


def _along_rows(code: Code, view: View, sheet: ProjectorSheet) -> Patterns:
    """A code's frames with its columns laid along the rows; ``-u-`` in its names becomes ``-v-``."""
    levels = np.rint(sheet.levels(code.light)).astype(np.uint8)
    frames = np.broadcast_to(levels[:, :, None], (len(levels), *view.shape))
    return Patterns(frames, tuple(name.replace("-u-", "-v-") for name in code.names))


def _joined(columns: Correspondence, rows: Correspondence) -> Correspondence:
    mask = columns.mask & rows.mask
    nan = np.float32(np.nan)
    return Correspondence(
        u_px=np.where(mask, columns.u_px, nan),
        sigma_u_px=np.where(mask, columns.sigma_u_px, nan),
        mask=mask,
        v_px=np.where(mask, rows.u_px, nan),
        sigma_v_px=np.where(mask, rows.sigma_u_px, nan),
    )
