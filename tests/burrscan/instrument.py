"""A small linear scanner over analytic geometry, for tests: truth is a formula, light a sparse matrix."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy import sparse

from burrscan.arrays import Floats, Image
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.rig import NO_DISTORTION, Rig, View
from burrscan.scanner import Patterns

_TAPS = 4


def small_rig(
    *, width: int = 160, distortion: tuple[float, float, float, float, float] = NO_DISTORTION
) -> Rig:
    """Camera 5:4, projector 4:3, 600 mm from the scene, baseline 200 mm, looking at the same place."""
    height, columns = width * 4 // 5, width * 4 // 5
    camera = View(width, height, 2.0 * width, 2.0 * width, (width - 1) / 2, (height - 1) / 2, distortion)
    rows = columns * 3 // 4
    projector = View(
        columns, rows, 2.0 * columns, 2.0 * columns, (columns - 1) / 2, (rows - 1) / 2, distortion
    )
    angle = np.arctan2(200.0, 600.0)
    turn = np.array(
        [[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]], dtype=float
    )
    pose = np.eye(4)
    pose[:3, :3] = turn
    pose[:3, 3] = -turn @ [200.0, 0.0, 0.0]
    return Rig(camera, projector, pose)


def plane_depth(rays: Floats, *, tilt: float = 0.2) -> Floats:
    """Depth z of the plane z = 600 + tilt (x - y)."""
    return 600.0 / (1.0 - tilt * (rays[..., 0] - rays[..., 1]))


def cylinder_depth(rays: Floats, *, radius_mm: float = 90.0) -> Floats:
    """Depth of an upright cylinder that stands 600 mm away at its nearest; NaN beside it."""
    centre = np.array([40.0, 600.0 + radius_mm])
    a = rays[..., 0] ** 2 + 1.0
    b = -2.0 * (rays[..., 0] * centre[0] + centre[1])
    c = centre @ centre - radius_mm**2
    with np.errstate(invalid="ignore"):
        return np.asarray((-b - np.sqrt(b * b - 4.0 * a * c)) / (2.0 * a))


@dataclass
class Instrument:
    """A simulated scanner; ``depth`` maps rays (..., 3) to z (mm), ``response`` rays to electrons per ms."""

    rig: Rig
    depth: object = cylinder_depth
    decades: float = 4.0
    peak_e_per_ms: float = 4000.0
    indirect: float = 0.0
    ambient_e_per_ms: float = 0.02
    camera: CameraSheet = field(default_factory=CameraSheet)
    projector: ProjectorSheet = field(default_factory=ProjectorSheet.gamma)
    seed: int = 1
    frames: int = 0
    noise: bool = True

    def __post_init__(self) -> None:
        shape = self.rig.camera.shape
        spots = (np.arange(_TAPS) + 0.5) / _TAPS - 0.5
        grid = self.rig.camera.pixel_grid()
        taps = [self._seen(grid + np.array([dx, dy])) for dx in spots for dy in spots]
        points, gains = np.stack([t[0] for t in taps]), np.stack([t[1] for t in taps])
        uv = self.rig.correspond(points)
        self.depth_mm = self._seen(grid)[0][..., 2]
        inside = (uv > -0.5) & (uv < np.array(self.rig.projector.shape[::-1]) - 0.5)
        gains = np.where(inside.all(axis=-1), gains, 0.0)
        uv = np.where(inside, uv, 0.0)
        self.response = gains.mean(axis=0)
        with np.errstate(invalid="ignore", divide="ignore"):
            self.truth_u = np.nan_to_num((uv[..., 0] * gains).mean(axis=0) / self.response, nan=-1.0)
        self.truth_u[self.response == 0.0] = np.nan
        self._matrix = self._footprints(
            uv.reshape(len(taps), -1, 2), gains.reshape(len(taps), -1) / len(taps)
        )
        self._rng = np.random.default_rng(self.seed)
        self._shape = shape

    def _seen(self, pixels: Floats) -> tuple[Floats, Floats]:
        rays = self.rig.camera.rays(pixels)
        z = self.depth(rays)  # type: ignore[operator]
        points = rays * z[..., None]
        # a highlight that falls off smoothly over the stated decades
        distance = np.hypot(points[..., 0] - 30.0, 0.6 * points[..., 1]) / 110.0
        gain = self.peak_e_per_ms * 10.0 ** (-self.decades * np.minimum(distance, 1.0))
        gain = np.where(np.isfinite(z), gain, 0.0)
        return points, gain

    def _footprints(self, uv: Floats, gains: Floats) -> sparse.csr_matrix:
        height, width = self.rig.projector.shape
        pixel = np.broadcast_to(np.arange(uv.shape[1]), gains.shape)
        low = np.floor(uv).astype(int)
        part = uv - low
        rows, cols, values = [], [], []
        for du in (0, 1):
            for dv in (0, 1):
                weight = np.abs(1 - du - part[..., 0]) * np.abs(1 - dv - part[..., 1]) * gains
                u, v = np.clip(low[..., 0] + du, 0, width - 1), np.clip(low[..., 1] + dv, 0, height - 1)
                keep = weight > 0.0
                rows.append(pixel[keep])
                cols.append((v * width + u)[keep])
                values.append(weight[keep])
        shape = (uv.shape[1], height * width)
        matrix = sparse.coo_matrix(
            (np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape
        )
        return matrix.tocsr()

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        low, high = self.camera.exposure_range_ms
        assert low <= exposure_ms <= high
        self.frames += len(patterns)
        images = np.stack([self._picture(frame, exposure_ms) for frame in patterns.frames])
        return images.reshape(len(patterns), *self._shape)

    def _picture(self, frame: object, exposure_ms: float) -> Image:
        light = self.projector.light[np.asarray(frame)]
        height = light.shape[0]
        electrons = self._matrix @ light.ravel()
        if self.indirect:
            # light from the mirrored half of the projector, blurred over 48 columns, onto every pixel
            kernel = np.ones(48) / 48
            blurred = np.convolve(light[height // 2, ::-1], kernel, mode="same")
            u = np.clip(np.nan_to_num(self.truth_u).astype(int), 0, light.shape[1] - 1).ravel()
            electrons = electrons + self.indirect * self.response.ravel() * blurred[u]
        mean = exposure_ms * (electrons + self.ambient_e_per_ms)
        if self.noise:
            held = np.minimum(
                self._rng.poisson(mean), self.camera.full_well_e
            )  # a full well is read with noise
            mean = held + self._rng.normal(0.0, self.camera.read_noise_e, mean.shape)
        dn = self.camera.black_level_dn + self.camera.gain_dn_per_e * mean
        if self.camera.response:
            light = np.asarray(self.camera.response[0])
            dn = np.interp(mean / self.camera.full_well_e, light, np.arange(len(light)))
        image: Image = np.clip(np.rint(dn), 0, self.camera.saturation_dn).astype(np.uint16)
        return image
