"""The axis by other people's libraries, each with the settings that suit it best.

pyransac3d and scikit-spatial fit a cylinder and know nothing of the part. small_gicp registers the scan to
the exact surface, all round, from a start that is up to :data:`START_DEG` off: the mark "with the drawing".
A peer's settings are those of least median error, by the truth, on scans that are not measured later.
"""

from __future__ import annotations

import functools
import importlib
import random
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from itertools import product
from typing import Any, TypeAlias

import numpy as np
from scipy.spatial.transform import Rotation

from bench.synthetic.axis_bound import cramer_rao_deg
from bench.synthetic.revolution import RevolutionScan, revolution_scan
from burrscan.arrays import Floats
from burrscan.axis import find_axis

Setting: TypeAlias = Mapping[str, Any]
Finder: TypeAlias = Callable[[RevolutionScan, "Task", int, Setting], Floats]
START_DEG = 8.0
"""How far the start that small_gicp is given may be off; the turn is about the part's own origin."""
SAMPLE = 5000
"""Points given to the peers whose cost per point is high."""
TUNING_SEEDS = (901, 902, 903)
"""Scans that peers' settings are chosen on; none of them is measured on."""


@dataclass(frozen=True)
class Task:
    """A kind of scan: the shape, how much of it is seen, its noise along the normal."""

    profile: str
    arc_deg: float
    sigma_mm: float

    def scan(self, seed: int) -> RevolutionScan:
        """One of 122,682 triangles."""
        return revolution_scan(self.profile, arc_deg=self.arc_deg, sigma_mm=self.sigma_mm, seed=seed)


TASKS = (
    *(Task("stepped_wheel", 140.0, sigma_mm) for sigma_mm in (0.05, 0.2, 1.0)),
    Task("cylinder", 140.0, 0.2),
    Task("cylinder", 360.0, 0.2),
)
"""The wheel, and the shape that the peers without the drawing are made for."""


@dataclass(frozen=True)
class Peer:
    """A way to find an axis.

    Parameters
    ----------
    package
        Its distribution; its version is printed.
    find
        The direction (3,) in a scan.
    settings
        Those tried for the best.
    drawing
        Whether it is given the exact surface.

    """

    package: str
    find: Finder
    settings: tuple[Setting, ...] = ({},)
    drawing: bool = False

    @property
    def name(self) -> str:
        """With its version; raises PackageNotFoundError where it is not installed."""
        return f"{self.package} {version(self.package)}"


@dataclass(frozen=True)
class Result:
    """Errors of one peer in one task, in degrees; the Cramér-Rao bound of their rms; processor time."""

    median_deg: float
    worst_deg: float
    bound_deg: float
    seconds: float
    setting: Setting


def measured(peer: Peer, task: Task, *, seeds: int) -> Result:
    """A peer on ``seeds`` scans, after one that compiles or loads."""
    setting = best_setting(peer, task)
    errors, seconds = [], []
    for seed in range(seeds + 1):
        scan = task.scan(seed)
        start = time.process_time()
        direction = peer.find(scan, task, seed, setting)
        seconds.append(time.process_time() - start)
        errors.append(scan.angle_error_deg(direction))
    bound = cramer_rao_deg(
        task.profile, arc_deg=task.arc_deg, sigma_mm=task.sigma_mm, known_generatrix=peer.drawing
    )
    return Result(
        float(np.median(errors[1:])), max(errors[1:]), bound, float(np.median(seconds[1:])), setting
    )


def best_setting(peer: Peer, task: Task) -> Setting:
    """The setting of least median error on the scans for tuning."""
    if len(peer.settings) == 1:
        return peer.settings[0]
    scans = [task.scan(seed) for seed in TUNING_SEEDS]

    def error(setting: Setting) -> float:
        found = [peer.find(scan, task, seed, setting) for seed, scan in enumerate(scans)]
        return float(np.median([s.angle_error_deg(a) for s, a in zip(scans, found, strict=True)]))

    return min(peer.settings, key=error)


def _by_burrscan(scan: RevolutionScan, _task: Task, _seed: int, _setting: Setting) -> Floats:
    return find_axis(scan.vertices_mm, scan.faces).direction


def _by_pyransac3d(scan: RevolutionScan, _task: Task, seed: int, setting: Setting) -> Floats:
    """A cylinder by RANSAC."""
    random.seed(seed)  # pyransac3d draws from here
    cylinder = importlib.import_module("pyransac3d").Cylinder()
    return _unit(cylinder.fit(_sample(scan, seed), thresh=setting["threshold_mm"], maxIteration=1000)[1])


def _by_skspatial(scan: RevolutionScan, _task: Task, seed: int, _setting: Setting) -> Floats:
    """The least-squares cylinder; there is nothing to set."""
    objects = importlib.import_module("skspatial.objects")
    return _unit(objects.Cylinder.best_fit(objects.Points(_sample(scan, seed))).vector)


def _by_small_gicp(scan: RevolutionScan, task: Task, seed: int, setting: Setting) -> Floats:
    """Registration to the exact surface; its preparation counts, as it does for everyone."""
    gicp = importlib.import_module("small_gicp")
    clouds = [
        gicp.preprocess_points(points, setting["voxel_mm"], num_neighbors=setting["neighbours"])
        for points in (_drawing(task.profile), scan.vertices_mm)
    ]
    result = gicp.align(
        clouds[0][0],
        clouds[1][0],
        clouds[0][1],
        init_T_target_source=_start(scan, seed),
        registration_type=setting["kind"],
        max_correspondence_distance=20.0,
        max_iterations=100,
        rotation_epsilon=1e-6,
        translation_epsilon=1e-5,
    )
    return _unit(np.asarray(result.T_target_source)[:3, :3].T @ [0.0, 0.0, 1.0])


@functools.cache
def _drawing(profile: str) -> Floats:
    """(159232, 3) points of the exact surface, all round, in the part frame."""
    model = revolution_scan(profile, arc_deg=360.0, shape=(1244, 128))
    return (model.vertices_mm - model.point_mm) @ model.T_mesh_part[:3, :3]


def _start(scan: RevolutionScan, seed: int) -> Floats:
    """(4, 4) the true pose, turned by up to :data:`START_DEG` about a random direction."""
    rng = np.random.default_rng(seed)
    turn = rng.normal(size=3)
    turn *= np.radians(rng.uniform(0.0, START_DEG)) / np.linalg.norm(turn)
    start = np.linalg.inv(scan.T_mesh_part).astype(np.float64)
    start[:3] = Rotation.from_rotvec(turn).as_matrix() @ start[:3]
    return start


def _sample(scan: RevolutionScan, seed: int) -> Floats:
    rng = np.random.default_rng(seed)
    return scan.vertices_mm[rng.choice(len(scan.vertices_mm), SAMPLE, replace=False)]


def _unit(direction: Floats) -> Floats:
    vector = np.asarray(direction, dtype=np.float64).ravel()
    return np.asarray(vector / np.linalg.norm(vector))


PEERS = (
    Peer("burrscan", _by_burrscan),
    Peer("pyransac3d", _by_pyransac3d, tuple({"threshold_mm": mm} for mm in (0.2, 0.6, 2.0, 6.0))),
    Peer("scikit-spatial", _by_skspatial),
    Peer(
        "small_gicp",
        _by_small_gicp,
        tuple(
            {"kind": kind, "voxel_mm": voxel_mm, "neighbours": neighbours}
            for kind, voxel_mm, neighbours in product(("GICP", "PLANE_ICP"), (0.1, 0.5, 1.0), (10, 30))
        ),
        drawing=True,
    ),
)
"""burrscan, and those it is measured beside."""
