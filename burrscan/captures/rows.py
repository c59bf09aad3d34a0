"""Rigs whose baseline runs along the projector's columns: depth is then in the rows it lights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from burrscan.correspondence import Correspondence
from burrscan.rig import Rig

_SWAP = np.array([[0.0, 1.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]])
"""Exchanges the projector's x and y; a rig after it is mirrored, which columns and depths do not notice."""


def along_baseline(correspondence: Correspondence, rig: Rig) -> tuple[Correspondence, Rig]:
    """Columns as they are where the baseline runs across them, else the projector's two axes exchanged.

    Triangulation reads columns. Where the projector stands above or below its camera, depth moves light from
    row to row, and columns say nothing; naming rows columns, in a rig whose projector frame has x and y
    exchanged, is the same geometry.
    """
    x, y = np.abs(rig.T_projector_camera[:2, 3])
    if x >= y or correspondence.v_px is None or correspondence.sigma_v_px is None:
        return correspondence, rig
    swapped = replace(
        correspondence,
        u_px=correspondence.v_px,
        sigma_u_px=correspondence.sigma_v_px,
        v_px=correspondence.u_px,
        sigma_v_px=correspondence.sigma_u_px,
    )
    return swapped, exchanged(rig)


def exchanged(rig: Rig) -> Rig:
    """The same rig with the projector's columns called rows and its rows columns."""
    p = rig.projector
    k1, k2, p1, p2, k3 = p.distortion
    view = replace(
        p,
        width=p.height,
        height=p.width,
        fx=p.fy,
        fy=p.fx,
        cx=p.cy,
        cy=p.cx,
        distortion=(k1, k2, p2, p1, k3),
    )
    return Rig(rig.camera, view, _SWAP @ rig.T_projector_camera)
