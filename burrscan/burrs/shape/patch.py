"""The vertices around one burr, in its own frame."""

from __future__ import annotations

from dataclasses import dataclass

from burrscan.arrays import Floats


@dataclass(frozen=True)
class Patch:
    """Vertices around a burr in its own frame.

    Parameters
    ----------
    u_mm, v_mm
        (N,) along the burr and across it.
    lift_mm
        (N,) deviation, positive on the burr.
    sigma_mm
        (N,) noise.

    """

    u_mm: Floats
    v_mm: Floats
    lift_mm: Floats
    sigma_mm: Floats
