"""Full-range patterns at several exposures, the brightest unsaturated one per pixel (Zhang & Yau 2009)."""

from __future__ import annotations

from typing import Any

import numpy as np

from burrscan.codes import METHODS as CODES
from burrscan.codes.code import patterns
from burrscan.correspondence import Correspondence, Scan
from burrscan.linear import linear
from burrscan.scan.exposure import Response, bracket, even, usable_at
from burrscan.scanner import Scanner
from burrscan.variants import check_parameters, resolve

_CANDIDATES = 120
"""Exposures over the camera's range, even in ratio: 7 % apart on the default camera."""


def scan_multi_exposure(
    scanner: Scanner,
    *,
    exposures: int = 2,
    code: str = "gray_phase",
    parameters: dict[str, Any] | None = None,
) -> Scan:
    """Scan with full-range patterns at several exposures; each pixel keeps its finest accepted column.

    Parameters
    ----------
    scanner
        The instrument.
    exposures
        How many; each costs the code's frames. They are chosen one by one from a bracket, each to serve most
        of the pixels that those before it do not.
    code, parameters
        A family of :data:`burrscan.codes.METHODS`, or ``"module:function"``, and its parameters.

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
    times, response = choose_exposures_ms(scanner, count=exposures)
    shown = patterns(chosen.light, chosen.names, view=scanner.rig.projector, sheet=scanner.projector)
    saturated = np.ones(scanner.rig.camera.shape, bool)
    found: list[Correspondence] = []
    for time in times:
        images = scanner.capture(shown, time)
        saturated &= (images >= scanner.camera.clipped_dn).any(axis=0)
        found.append(chosen.decode(images, scanner.camera))
    return Scan(
        correspondence=finest(found),
        frames=response.frames + len(times) * len(shown) + 1,
        exposures_ms=times,
        white=scanner.capture(even(scanner, levels=(255,)), times[0])[0],
        saturated=saturated,
        pattern=shown.frames[-1],
        image=images[-1],
        radiance=response.radiance,
    )


def choose_exposures_ms(scanner: Scanner, *, count: int) -> tuple[tuple[float, ...], Response]:
    """Exposures that together serve most pixels, greedily, and the bracket that told them."""
    response = bracket(scanner, black_rungs=2)
    camera = scanner.camera
    exposures = np.geomspace(*camera.exposure_range_ms, _CANDIDATES)
    served = np.stack([usable_at(response, t, camera=camera) for t in exposures])
    chosen: list[float] = []
    for _ in range(count):
        # of equals the longest: it is the least noisy
        best = _CANDIDATES - 1 - int(np.argmax(served.sum(axis=1)[::-1]))
        chosen.append(float(exposures[best]))
        served &= ~served[best]
    return tuple(chosen), response


def finest(found: list[Correspondence]) -> Correspondence:
    """Per pixel the accepted column with the smallest sigma."""
    sigma = np.stack([np.where(one.mask, one.sigma_u_px, np.inf) for one in found])
    best = np.argmin(sigma, axis=0)[None]
    mask = np.isfinite(np.take_along_axis(sigma, best, axis=0)[0])
    u_px = np.take_along_axis(np.stack([one.u_px for one in found]), best, axis=0)[0]
    stated = np.take_along_axis(sigma, best, axis=0)[0]
    return Correspondence(u_px, np.where(mask, stated, np.nan).astype(np.float32), mask)
