"""What axis, generatrix and burrs cost and how good the axis is, against size and against peers.

    NUMBA_NUM_THREADS=1 OMP_NUM_THREADS=1 python -m bench.perf.geometry [--largest MILLIONS] [--seeds N]
        [--shape NAME]

First: processor time of ``inspect_mesh`` on one synthetic scan with a burr, from 0.1 to 10 million triangles,
beside reading the same mesh once from a binary PLY (the stages are wall time); ``--largest 0`` leaves it out.
Second: the axis on the same scans of 123,000 triangles by burrscan and its peers (:mod:`bench.perf.peers`),
as far as these are installed: ``pip install pyransac3d scikit-spatial small_gicp``. The bound is of the root
mean square; for small_gicp it is that of a known generatrix. Six minutes with ten scans each.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import numpy as np
import trimesh

from bench.perf.peers import PEERS, TASKS, Peer, Task, measured
from bench.synthetic.revolution import RevolutionScan, RidgeBurr, revolution_scan
from burrscan.api import inspect_mesh
from burrscan.meshio import read_mesh

SIZES = (0.1, 0.3, 1.0, 3.0, 10.0)
"""Millions of triangles."""
HEADS = (
    f"{'axis by':24s}{'shape':>14s}{'arc':>5s}{'sigma mm':>9s}{'median deg':>12s}{'worst deg':>11s}"
    f"{'bound deg':>11s}{'s':>8s}  best setting"
)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--largest", type=float, default=10.0)
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--shape", choices=sorted({task.profile for task in TASKS}), help="only this one")
    given = parser.parse_args()
    sizes = [millions for millions in SIZES if millions <= given.largest]
    if sizes:
        _say("triangles  read s  axis ms  generatrix ms  burrs ms  deviation ms  checks ms  all ms  ns each")
    for millions in sizes:
        _say(size_line(millions))
    peers = installed()
    _say("", HEADS)
    for task in TASKS if given.shape is None else [t for t in TASKS if t.profile == given.shape]:
        for name, peer in peers.items():
            _say(peer_line(name, peer, task, given.seeds))


def size_line(millions: float) -> str:
    """One mesh of so many million triangles: time to read it, and of every stage."""
    around = round(np.sqrt(millions * 1e6 / 2.0 * 484.0 / 128.0))
    shape = (around, round(around * 128 / 484))
    scan = revolution_scan(sigma_mm=0.05, shape=shape, burrs=(RidgeBurr(width_deg=1.5),))
    read_s = _reading_s(scan)
    runs = [_inspected(scan) for _ in range(3)]
    total, stages = min(runs, key=lambda run: run[0])
    triangles = len(scan.faces)
    names = ("axis", "generatrix", "burrs", "deviation", "checks")
    each = "".join(f"{1e3 * stages[name]:12.1f}" for name in names)
    return f"{triangles:9d} {read_s:7.3f}{each}{1e3 * total:9.1f}{1e9 * total / triangles:9.0f}"


def _inspected(scan: RevolutionScan) -> tuple[float, dict[str, float]]:
    start = time.process_time()
    inspection = inspect_mesh(scan.vertices_mm, scan.faces)
    return time.process_time() - start, dict(inspection.timings_s)


def _reading_s(scan: RevolutionScan) -> float:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "scan.ply"
        trimesh.Trimesh(scan.vertices_mm, scan.faces, process=False).export(path)
        read_mesh(path)
        start = time.process_time()
        read_mesh(path)
        return time.process_time() - start


def peer_line(name: str, peer: Peer, task: Task, seeds: int) -> str:
    """Errors and time of one way to find the axis."""
    found = measured(peer, task, seeds=seeds)
    setting = ", ".join(f"{key} {value}" for key, value in found.setting.items())
    return (
        f"{name:24s}{task.profile:>14s}{task.arc_deg:5.0f}{task.sigma_mm:9.2f}{found.median_deg:12.4f}"
        f"{found.worst_deg:11.4f}{found.bound_deg:11.4f}{found.seconds:8.3f}  {setting}"
    )


def installed() -> dict[str, Peer]:
    """The peers that can be tried here, by name and version."""
    found: dict[str, Peer] = {}
    for peer in PEERS:
        try:
            found[peer.name] = peer
        except PackageNotFoundError:
            _say(f"{peer.package} is not installed and left out")
    return found


def _say(*lines: str) -> None:
    print(*lines, sep="\n", flush=True)


if __name__ == "__main__":
    main()
