"""The strategy ``colour``: any other strategy, on a scanner in colour, in a third of the pictures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal

import numpy as np

from burrscan.colour.mixing import CHANNELS, Mixing, measured_mixing, mixing_of
from burrscan.colour.scanner import MonoScanner
from burrscan.correspondence import Scan
from burrscan.errors import InputError
from burrscan.scan import METHODS
from burrscan.scanner import Scanner
from burrscan.variants import check_parameters, resolve

Unmix = Literal["part", "sheets", "none"]


def scan_colour(
    scanner: Scanner,
    *,
    method: str = "adaptive",
    parameters: Mapping[str, Any] | None = None,
    unmix: Unmix = "part",
) -> Scan:
    """Scan in colour.

    Parameters
    ----------
    scanner
        A scanner in colour (:mod:`burrscan.colour`).
    method, parameters
        The grey strategy; its ``frames`` are grey ones, up to three per picture.
    unmix
        ``part`` undoes what was measured on the part, ``sheets`` the crosstalk that the data sheets state
        (as ``burrscan calibrate`` measures it), ``none`` nothing but the colours' balance.

    Returns
    -------
    Scan
        ``frames`` are pictures in colour, those for the colours included.

    Raises
    ------
    burrscan.errors.InputError
        When the colours cannot be told apart, for an unknown strategy or parameter, or where ``sheets`` state
        no crosstalk.

    """
    chosen = resolve(method, METHODS, stage="scan method")
    given = dict(parameters or {})
    check_parameters(chosen, given, stage=f"scan method '{method}'")
    measured, frames = measured_mixing(scanner)
    mono = MonoScanner(scanner, _mixing(scanner, measured, unmix), frames=frames)
    scan = _run(chosen, mono, given)
    return replace(scan, frames=mono.frames)


def _run(method: Callable[..., Scan], scanner: Scanner, parameters: dict[str, Any]) -> Scan:
    return method(scanner, **parameters)


def _mixing(scanner: Scanner, measured: Mixing, unmix: Unmix) -> Mixing:
    own = np.diag(measured.matrix)
    if unmix == "part":
        return measured
    if unmix == "none":
        return Mixing(np.diag(own))
    if unmix != "sheets":
        raise InputError(f"unmix is 'part', 'sheets' or 'none', not '{unmix}'")
    for name, sheet in (("camera", scanner.camera), ("projector", scanner.projector)):
        if sheet.crosstalk and len(sheet.crosstalk) != CHANNELS:
            raise InputError(f"the {name}'s sheet has a crosstalk of {len(sheet.crosstalk)} rows, not three")
    if not (scanner.camera.crosstalk or scanner.projector.crosstalk):
        raise InputError("the data sheets state no crosstalk: calibrate them, or use unmix = 'part'")
    return mixing_of(scanner.camera, scanner.projector, own=own)
