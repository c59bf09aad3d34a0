"""A lab whose scans are made-up wheels of some thousand triangles: sections run, and nothing is rendered."""

from __future__ import annotations

import zlib
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from bench.reproduction.lab import Lab
from bench.reproduction.scanned import Scanned
from bench.synthetic.revolution import RidgeBurr, profile_of, revolution_scan

SHAPE = 70, 48
FULL_DN = 1023.0


class MadeUpLab(Lab):
    """Scans of a stepped wheel (a flat ring for the plane) with known truth."""

    def repeats(self, full: int) -> int:
        """A quarter of a quick run's: nothing is concluded from made-up scans."""
        return max(super().repeats(full) // 4, 2)

    def scan(self, scene: str, method: str, /, *, spin_deg: float = 0.0, **parameters: Any) -> Scanned:
        seed = zlib.crc32(f"{scene} {method} {spin_deg} {parameters}".encode())
        profile = profile_of("plane" if scene == "plane" else "stepped_wheel")
        made = revolution_scan(profile, shape=SHAPE, sigma_mm=0.05, seed=seed, burrs=(RidgeBurr(),))
        pose = made.T_mesh_part @ _spun(-spin_deg)
        points = made.vertices_mm.reshape(*SHAPE, 3)
        rows, columns = np.indices(SHAPE)
        bright = (np.abs(rows - 35) < 15) & (np.abs(columns - 24) < 20)
        white = np.where(bright, FULL_DN, 400.0)
        return Scanned(
            {
                "vertices_mm": made.vertices_mm,
                "faces": made.faces,
                "sigma_mm": np.full(len(made.vertices_mm), 0.05),
                "points_mm": points,
                "true_points_mm": points + 0.01,
                "white": white,
                "image": white / 2,
                "u_error_px": 0.1 * np.sin(columns),
                "u_response_px": 3.0 * columns,
                "measurable": np.ones(SHAPE, bool),
                "on_burr": rows == 35,
                "T_part_camera": np.linalg.inv(pose),
                "outline_zr_mm": profile,
                "frames": np.asarray(30.0),
                "exposure_ms": np.asarray(5.0),
                "shown_ms": np.asarray(800.0),
                "computed_s": np.asarray(0.5),
                "full_dn": np.asarray(FULL_DN),
            }
        )

    def glance(self, scene: str, method: str, /, **given: Any) -> Scanned:
        return self.scan(scene, method, **given)


def _spun(angle_deg: float) -> np.ndarray[Any, np.dtype[np.float64]]:
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_euler("z", angle_deg, degrees=True).as_matrix()
    return turn
