"""The truth of a simulated scan. It lives here, where no algorithm can see it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burrscan.arrays import Bools, Floats, Floats32, Ints32, freeze
from burrscan.pose import placed
from burrscan.rig import Rig
from scenes.light import Light
from scenes.measurable import limit_sigma_px, measurable
from scenes.scene import SceneSpec
from scenes.surface import TrueBlemish, blemish_at, true_blemishes
from scenes.transport.hits import Hits
from scenes.wheel import Wheel


@dataclass(frozen=True)
class Truth:
    """Everything known of a scene; per-pixel arrays are (h, w) in the camera's raster.

    Parameters
    ----------
    wheel
        The part, with its generatrix and its burrs, in the part frame.
    rig
        The true rig, columns across the baseline (:mod:`burrscan.sideways`), as scans count them.
    T_part_camera
        (4, 4) camera to part coordinates.
    points_mm
        (h, w, 3) surface behind each pixel centre, camera frame, NaN where there is none.
    u_px, v_px
        Projector pixel that lights that point, in the raster of ``rig``; NaN where it is not lit.
    u_response_px, v_response_px
        The same weighted by the direct light of the pixel's whole footprint: what a perfect decoder reads.
    direct, indirect
        Light under full white; 1 is a white diffuser at the standoff.
    sigma_limit_px
        Smallest standard deviation of the projector column that permitted light allows.
    measurable
        Pixels that could be measured to 0.5 px.
    burr_index
        Which true burr the pixel's centre lies on, -1 for none.
    blemish_index
        Which true blemish covers the pixel's centre to more than half, -1 for none.
    blemishes
        What else is on the wheel: none of them is a burr.

    """

    wheel: Wheel
    rig: Rig
    T_part_camera: Floats
    points_mm: Floats
    u_px: Floats32
    v_px: Floats32
    u_response_px: Floats32
    v_response_px: Floats32
    direct: Floats32
    indirect: Floats32
    sigma_limit_px: Floats32
    measurable: Bools
    burr_index: Ints32
    blemish_index: Ints32
    blemishes: tuple[TrueBlemish, ...] = ()

    def __post_init__(self) -> None:
        freeze(self, T_part_camera=self.T_part_camera, points_mm=self.points_mm, u_px=self.u_px)
        freeze(self, v_px=self.v_px, u_response_px=self.u_response_px, v_response_px=self.v_response_px)
        freeze(self, direct=self.direct, indirect=self.indirect, sigma_limit_px=self.sigma_limit_px)
        freeze(self, measurable=self.measurable, burr_index=self.burr_index)
        freeze(self, blemish_index=self.blemish_index)

    @property
    def lit(self) -> Bools:
        """Pixels that direct light reaches."""
        lit: Bools = self.direct > 0.0
        return lit

    @property
    def points_part_mm(self) -> Floats:
        """The surface points in the part frame, (h, w, 3)."""
        return self.points_mm @ self.T_part_camera[:3, :3].T + self.T_part_camera[:3, 3]


def truth_of(
    scene: SceneSpec, *, wheel: Wheel, rig: Rig, T_camera_part: Floats, hits: Hits, light: Light
) -> Truth:
    """Gather the truth of a scene that was traced. O(pixels)."""
    lit = light.white_direct > 0.0
    centre = np.where(lit[..., None], rig.correspond(hits.points_mm), np.nan).astype(np.float32)
    limit = limit_sigma_px(light, camera=scene.camera, ambient=scene.light.ambient)
    burrs = np.where(hits.faces >= 0, wheel.face_burr[np.maximum(hits.faces, 0)], -1)
    T_part_camera = np.asarray(np.linalg.inv(T_camera_part), dtype=float)
    return Truth(
        wheel=wheel,
        rig=rig,
        T_part_camera=T_part_camera,
        points_mm=hits.points_mm,
        u_px=centre[..., 0],
        v_px=centre[..., 1],
        u_response_px=light.u_px,
        v_response_px=light.v_px,
        direct=light.white_direct,
        indirect=light.white_indirect,
        sigma_limit_px=limit,
        measurable=measurable(light, limit),
        burr_index=burrs.astype(np.int32),
        blemish_index=_blemish_index(scene, wheel, T_part_camera, hits, burrs < 0),
        blemishes=true_blemishes(scene.blemish, wheel.generatrix_zr_mm),
    )


def _blemish_index(
    scene: SceneSpec, wheel: Wheel, T_part_camera: Floats, hits: Hits, on_wheel: Bools
) -> Ints32:
    """(h, w) of the pixels that see the wheel itself."""
    index = np.full(hits.faces.shape, -1, np.int32)
    seen = (hits.faces >= 0) & on_wheel
    points = placed(T_part_camera, hits.points_mm[seen])
    index[seen] = blemish_at(points, scene.blemish, wheel.generatrix_zr_mm)
    return index
