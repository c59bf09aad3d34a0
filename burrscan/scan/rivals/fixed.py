"""The classical scan: one full-range sequence at the one exposure that serves most pixels."""

from __future__ import annotations

from typing import Any

import numpy as np

from burrscan.codes import METHODS as CODES
from burrscan.codes.code import patterns
from burrscan.correspondence import Scan
from burrscan.linear import linear
from burrscan.scan.exposure import even, served
from burrscan.scanner import Scanner
from burrscan.variants import check_parameters, resolve


def scan_fixed(
    scanner: Scanner,
    *,
    code: str = "gray_phase",
    parameters: dict[str, Any] | None = None,
    exposure_ms: float | None = None,
) -> Scan:
    """Scan with full-range patterns at one exposure.

    Parameters
    ----------
    scanner
        The instrument.
    code
        A code family of :data:`burrscan.codes.METHODS`, or ``"module:function"``.
    parameters
        For the family, such as ``{"steps": 16}``.
    exposure_ms
        Fixed by hand; by default bracketing chooses the exposure at which most pixels are unclipped and
        fine (see :func:`burrscan.scan.exposure.served`).

    Notes
    -----
    Frames: the bracket (two per rung of the camera's exposure ladder), the code, one white.

    Raises
    ------
    burrscan.errors.InputError
        For an unknown family or parameter.

    """
    scanner = linear(scanner)
    family = resolve(code, CODES, stage="code")
    given = dict(parameters or {})
    check_parameters(family, given, stage=f"code '{code}'")
    chosen = family(width=scanner.rig.projector.width, **given)
    exposure_ms, spent, radiance = served(scanner, exposure_ms)
    shown = patterns(chosen.light, chosen.names, view=scanner.rig.projector, sheet=scanner.projector)
    images = scanner.capture(shown, exposure_ms)
    white = scanner.capture(even(scanner, levels=(255,)), exposure_ms)[0]
    return Scan(
        correspondence=chosen.decode(images, scanner.camera),
        frames=spent + len(shown) + 1,
        exposures_ms=(exposure_ms,),
        white=white,
        saturated=np.asarray((images >= scanner.camera.clipped_dn).any(axis=0)),
        pattern=shown.frames[-1],
        image=images[-1],
        radiance=radiance,
    )
