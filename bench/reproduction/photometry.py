"""Section 2: response curves and crosstalk, modelled and not."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bench.reproduction.lab import Lab
from bench.reproduction.parts import MOST, Claim, Numbers, Section, Table, verdict
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats, Image
from burrscan.correspondence import Scan
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.scan.rivals.seed import scan_seed
from burrscan.scanner import PassThrough, Patterns, Scanner

UNKNOWN = f"{__name__}:scan_unknown"
SCANS: Mapping[str, tuple[str, str, Mapping[str, Any]]] = {
    "both curves known": ("curved", "seed", {}),
    "the camera's unknown": ("curved", UNKNOWN, {"camera": True}),
    "the projector's unknown": ("curved", UNKNOWN, {"projector": True}),
    "both unknown": ("curved", UNKNOWN, {"camera": True, "projector": True}),
    "colour, crosstalk undone": ("copper", "colour", {"method": "seed"}),
    "colour, crosstalk left": ("copper", "colour", {"method": "seed", "unmix": "none"}),
}
"""Scene, strategy and parameters."""


class Unknown(PassThrough):
    """A scanner whose data sheets say that camera or projector is linear, which it is not."""

    def __init__(self, scanner: Scanner, *, camera: bool, projector: bool) -> None:
        super().__init__(scanner)
        self._camera, self._projector = camera, projector

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        """Capture what the real devices show and see."""
        return self._scanner.capture(patterns, exposure_ms)

    @property
    def camera(self) -> CameraSheet:
        """The sheet, without the response curve where that is not known."""
        sheet = self._scanner.camera
        return replace(sheet, response=()) if self._camera else sheet

    @property
    def projector(self) -> ProjectorSheet:
        """The sheet, with light in proportion to the level where the curve is not known."""
        return ProjectorSheet(np.linspace(0.0, 1.0, 256)) if self._projector else self._scanner.projector


def scan_unknown(scanner: Scanner, *, camera: bool = False, projector: bool = False) -> Scan:
    """The seed's scan by a scanner whose response curves are not known."""
    return scan_seed(Unknown(scanner, camera=camera, projector=projector))


def figures(scan: Scanned) -> tuple[float, float, float]:
    """Coverage, share of wrong pixels, and RMS of the others' columns, projector pixels."""
    return scan.coverage(), scan.wrong(), scan.u_rms_px()


def measure(lab: Lab) -> Numbers:
    """Every scan in every view; scans of one scene in one view share its light."""
    turns = lab.turns_deg()
    rows = np.empty((len(SCANS), len(turns), 3))
    for wanted in dict.fromkeys(scene for scene, _, _ in SCANS.values()):
        for view, turn in enumerate(turns):
            for row, (scene, method, given) in zip(rows, SCANS.values(), strict=True):
                if scene == wanted:
                    row[view] = figures(lab.glance(scene, method, spin_deg=turn, **given))
    return {"rows": rows}


def draw(n: Numbers) -> Section:
    """Errors with the models and without."""
    rows = dict(zip(SCANS, n["rows"], strict=True))
    errors = {name: float(np.median(of[:, 2])) for name, of in rows.items()}
    known, camera, projector, neither, undone, left = errors.values()
    first, *others = (of[:, 2] for of in list(rows.values())[:4])
    matters = [bool(np.mean(of > first) >= MOST) for of in others]
    table = tuple((name, *(_range(of[:, k], k) for k in range(3))) for name, of in rows.items())
    with_it, without = (list(rows.values())[k][:, 2] for k in (4, 5))
    mixed = bool(np.mean(without > with_it) >= MOST)
    return Section(
        title="Response curves and crosstalk",
        reports="Nonlinearities and crosstalk between the colour channels are modelled for both the camera "
        "and the projector (section 2).",
        measured=f"The seed's scan in {n['rows'].shape[1]} views all around, with a camera of the curve of "
        f"BT.709 and a projector of power 2.2. With both curves known the columns err by {known:.3f} px "
        f"RMS, without the camera's {camera:.3f} px, without the projector's {projector:.3f} px. In three "
        f"colours on copper, with crosstalk of up to 8 % on both sides, {undone:.3f} px where it "
        f"is undone and {left:.3f} px where it is left.",
        claims=(
            Claim("2", "nonlinearities of camera and projector are to be modelled", "modelled for both",
                  f"{known:.3f} px with both curves; {camera:.3f} without the camera's, {projector:.3f} "
                  f"without the projector's, {neither:.3f} without both", "–",
                  verdict(matters),
                  f"a larger error in {MOST:.0%} of the views counts. It is not much larger: eight steps of "
                  "a sine cancel harmonics up to the sixth; coverage and wrong pixels suffer too (table)"),
            Claim("2", "crosstalk between the colour channels is to be modelled", "modelled for both",
                  f"{undone:.3f} px undone, {left:.3f} px left", "–", "yes" if mixed else "partly",
                  "frames that are compared share a primary here, which alone keeps much of the crosstalk "
                  "out"),
        ),
        tables=(Table(("scan", "measured", "wrong by over a pixel", "RMS of the others"), table,
                      "Median (least to largest) of the views"),),
    )  # fmt: skip


def _range(values: Floats, column: int) -> str:
    low, middle, high = np.min(values), np.median(values), np.max(values)
    if column < 2:
        return f"{middle:.1%} ({low:.1%} to {high:.1%})"
    return f"{middle:.3f} px ({low:.3f} to {high:.3f})"
