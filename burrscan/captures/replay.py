"""Scanning a capture folder: its strategy is run again over the recorded pictures."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from burrscan.captures.folder import FolderScanner
from burrscan.correspondence import Scan
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.errors import InputError
from burrscan.rig import Rig
from burrscan.scan import METHODS
from burrscan.sideways import along_baseline, by_columns, runs_along_columns
from burrscan.variants import check_parameters, resolve, shipped_only

_NOISES = 6.0
"""Deviations above black from which a pixel sees light: of a million dark ones, noise lifts none so far."""
_STRAY_SHARE = 1e-4
"""Hot pixels: a picture in which fewer than this share of the pixels are above the dark is a dark one."""


def replay(
    folder: Path,
    *,
    method: str | None = None,
    rig: Rig | None = None,
    sheets: tuple[CameraSheet, ProjectorSheet] | None = None,
    trusted: bool = False,
) -> tuple[Scan, FolderScanner]:
    """Scan a capture folder.

    Parameters
    ----------
    folder
        The capture folder (``burrscan/captures/README.md``).
    method
        A scanning strategy; by default the one that ``capture.json`` names. Where it names none, the first
        strategy whose shots are all there.
    rig, sheets
        In place of the folder's own.
    trusted
        Whether ``capture.json`` may name code of anyone's, ``"module:function"``, which is then imported.

    Returns
    -------
    The scan, in the raster of :func:`burrscan.sideways.across_columns` of the scanner's rig; the scanner.

    Raises
    ------
    InputError
        When the folder cannot be used, its shots do not fit the strategy, or nothing decodes.

    """
    fresh = partial(FolderScanner, folder, rig=rig, sheets=sheets)
    scanner = fresh()
    try:
        # a method named here is the caller's word; what the folder names is data
        with shipped_only(str(folder / "capture.json"), trusted=trusted or method is not None):
            ways = (_by_columns, _as_it_stands) if runs_along_columns(scanner.rig) else (_by_columns,)
            scan, scanner = _first(fresh, [*product(_strategies(scanner, method), ways)])
    except InputError:
        refuse_dark(scanner, folder)
        raise
    if not scan.correspondence.mask.any():
        refuse_dark(scanner, folder)
        raise InputError(
            f"{folder}: no pixel decodes, though the pictures are not dark; do patterns and pictures belong "
            "together, does the projector light what the camera sees, was everything still?"
        )
    return scan, scanner


def _strategies(scanner: FolderScanner, method: str | None) -> list[Callable[..., Scan]]:
    if method is not None:
        return [_bound(method, {})]
    if scanner.scan is not None:
        return [_bound(scanner.scan.method, dict(scanner.scan.parameters))]
    return [_bound(name, {}) for name in METHODS]


def _bound(method: str, parameters: dict[str, Any]) -> Callable[..., Scan]:
    function = resolve(method, METHODS, stage="scan method")
    check_parameters(function, parameters, stage=f"scan method '{method}'")
    return partial(function, **parameters)


def _first(
    fresh: Callable[[], FolderScanner], tried: list[tuple[Callable[..., Scan], Callable[..., Scan]]]
) -> tuple[Scan, FolderScanner]:
    """The first strategy that gets through; else the error of the one that got furthest."""
    furthest: tuple[int, InputError] | None = None
    for strategy, scan_with in tried:
        scanner = fresh()
        try:
            return scan_with(strategy, scanner), scanner
        except InputError as error:
            if furthest is None or scanner.replayed > furthest[0]:
                furthest = scanner.replayed, error
    assert furthest is not None
    raise furthest[1]


def _by_columns(strategy: Callable[..., Scan], scanner: FolderScanner) -> Scan:
    return strategy(by_columns(scanner))


def _as_it_stands(strategy: Callable[..., Scan], scanner: FolderScanner) -> Scan:
    """Where the projector must lie on its side for that: columns and rows recorded as it stands."""
    scan = strategy(scanner)
    if scan.correspondence.v_px is None:
        raise InputError(
            "these pictures tell the projector's columns alone, along which the baseline of this rig runs: "
            "depth is in the rows; record a strategy with this rig.json, or columns and rows ('both')"
        )
    return replace(scan, correspondence=along_baseline(scan.correspondence, scanner.rig)[0])


def refuse_dark(scanner: FolderScanner, folder: Path) -> None:
    """Say so where no recorded picture holds any light.

    Raises
    ------
    InputError
        When every picture is dark, or one of them cannot be read.

    """
    camera = scanner.camera
    noise = float(camera.noise_dn(np.array(camera.black_level_dn)))
    floor = camera.black_level_dn + _NOISES * (noise + 0.5)
    brightest = 0
    for shot in scanner.shots:
        image = scanner.image(shot)
        if (image > floor).mean() > _STRAY_SHARE:
            return
        brightest = max(brightest, int(image.max()))
    raise InputError(
        f"{folder}: nothing decodes, all {len(scanner.shots)} pictures are black: the brightest pixel shows "
        f"{brightest} of {camera.saturation_dn} DN and the dark is {camera.black_level_dn:g} DN; check the "
        "lens cap, that the projector was on, the exposure, and that bit_depth is the camera's"
    )
