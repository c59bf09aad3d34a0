"""The classical scan: one full-range sequence at the one exposure that serves most pixels."""

from __future__ import annotations

from typing import Any

import numpy as np

from burrscan.codes import METHODS as CODES
from burrscan.codes.code import patterns
from burrscan.correspondence import Scan
from burrscan.linear import linear
from burrscan.scan.exposure import best_exposure_ms, bracket, even
from burrscan.scanner import Scanner
from burrscan.variants import check_parameters, resolve

_WELL_MEASURED_PX = 0.5
"""Standard deviation: the limit that coverage is counted by, half a projector column."""
_PLANNING_PERIOD_PX = 16.0
"""Of the sine that stands for the code when the exposure is chosen; all codes here end in stripes about as
fine."""
_PLANNING_STEPS = 8
"""Of that sine; the best exposure hardly depends on it, for it scales all pixels' noise alike."""


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
        fine (see :func:`burrscan.scan.exposure.best_exposure_ms`).

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
    spent, radiance = 0, None
    if exposure_ms is None:
        response = bracket(scanner)
        spent, radiance = response.frames, response.radiance
        exposure_ms = best_exposure_ms(
            response,
            camera=scanner.camera,
            period_px=_PLANNING_PERIOD_PX,
            steps=_PLANNING_STEPS,
            max_sigma_px=_WELL_MEASURED_PX,
        )
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
