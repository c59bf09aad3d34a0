"""Sound input of every kind, small: what the fuzzer damages."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from bench.baselines import accept
from bench.checks.fuzz.boards import write_arm, write_boards, write_gray
from bench.checks.fuzz.ramps import write_ramps
from bench.run import Record, RunDirectory
from bench.run.directory import describe_run, load_run, write_manifest
from bench.run.provenance import session
from bench.run.records import append
from bench.run.shard import Shard
from bench.score import METRICS
from bench.suites.cases import expand
from bench.suites.suite import suite_from
from bench.synthetic.spec import MeshSpec, scanned
from burrscan.arrays import Image
from burrscan.captures import RecordingScanner
from burrscan.captures.document import ScanDocument
from burrscan.captures.sheets import write_sheets
from burrscan.devices import CameraSheet, ProjectorSheet
from burrscan.ply import write_ply
from burrscan.rig import Rig, View
from burrscan.scan.rivals.fixed import scan_fixed
from burrscan.scanner import Patterns

TRUTH = "truth.json"
"""The true direction of the meshes' axis."""
_SCENE = """\
wheel = "paper"
finish = "matte"
[rig]
scale = 0.1
standoff_mm = 600.0
[camera]
bit_depth = 10
[light]
ambient = 0.002
[render]
samples = 16
"""
_DONE = {"rig": {"scale": 0.03}, "render": {"samples": 2}}
"""Of the run that is whole: what a damaged record has rendered anew is small."""
RAN = "ran"
"""The file that the code which :data:`bench.checks.fuzz.mutate.ODD` names leaves when it runs."""
_HELPER = f"""\
from pathlib import Path
Path({RAN!r}).touch()
def go(*_, **__):
    Path({RAN!r}).touch()
"""
_SUITE = """\
name = "small"
title = "a small suite"
seeds = [0, 1]
[scene]
base = "scene.toml"
[sweep]
finish = ["matte", "turned"]
[jitter]
"light.ambient" = [0.0, 0.1]
[[variant]]
name = "usual"
[[variant]]
name = "other"
axis = "seed"
"""


def write_sound(folder: Path) -> None:
    """Write one of each into ``folder``.

    A scene, a suite, a capture, sheets, runs and parts of one, poses, meshes in every format, and what
    ``calibrate`` takes: boards, ramps, pictures of an arm. The true axis of the meshes is in ``truth.json``.
    """
    (folder / "scene.toml").write_text(_SCENE, "utf-8")
    (folder / "helper.py").write_text(_HELPER, "utf-8")
    (folder / "suite.toml").write_text(_SUITE, "utf-8")
    _write_capture(folder / "capture")
    wall = _Wall()
    write_sheets(folder / "sheets.json", wall.camera, wall.projector)
    _write_run(folder / "run")
    shutil.copytree(folder / "run", folder / "other")
    _write_run(folder / "done", scene=_DONE)
    for number in (1, 2):
        _write_run(folder / "parts" / str(number), shard=Shard(number, 2))
    write_boards(folder / "boards")
    write_gray(folder / "gray")
    write_arm(folder / "arm")
    write_ramps(folder / "ramps")
    accept(load_run(folder / "run"), baselines=folder / "baselines")
    scan = scanned(MeshSpec(around=60, along=24), identity=(1,))
    (folder / TRUTH).write_text(json.dumps(scan.direction.tolist()), "utf-8")
    write_ply(folder / "mesh.ply", scan.vertices_mm, scan.faces, scalars={})
    mesh = trimesh.Trimesh(scan.vertices_mm, scan.faces, process=False)
    for name in ("mesh.stl", "mesh.obj"):
        mesh.export(folder / name)
    mesh.export(folder / "ascii.stl", file_type="stl_ascii")
    mesh.export(folder / "ascii.ply", encoding="ascii")
    poses = {"sigma_mm": 0.5, "sigma_deg": 0.2, "T_world_camera": [np.eye(4).tolist()] * 2}
    (folder / "poses.json").write_text(json.dumps(poses), "utf-8")


class _Wall:
    """A scanner before a flat wall: every camera pixel sees the projector pixel four columns to its left."""

    def __init__(self) -> None:
        view = View(40, 24, 40.0, 40.0, 19.5, 11.5)
        pose = np.eye(4)
        pose[0, 3] = -60.0
        self.rig = Rig(view, view, pose)
        self.camera = CameraSheet(bit_depth=8, black_level_dn=4.0, exposure_range_ms=(1.0, 2.0))
        self.projector = ProjectorSheet(np.linspace(0.0, 1.0, 256))

    def capture(self, patterns: Patterns, exposure_ms: float) -> Image:
        seen = np.roll(patterns.frames.astype(np.float64), 4, axis=-1) * (0.4 * exposure_ms)
        return np.clip(seen + 4.0, 0.0, 255.0).round().astype(np.uint16)


def _write_capture(folder: Path) -> None:
    recorder = RecordingScanner(_Wall(), folder, scan=ScanDocument("fixed", {"exposure_ms": 2.0}))
    scan_fixed(recorder, exposure_ms=2.0)
    recorder.close()


def _write_run(folder: Path, *, scene: Mapping[str, Any] | None = None, shard: Shard | None = None) -> None:
    document = {
        "name": "tiny",
        "scene": {"wheel": "paper", "finish": "matte", **(scene or {})},
        "sweep": {"finish": ["matte", "turned"]},
        "variant": [{"name": "a"}, {"name": "b"}],
    }
    suite = suite_from(document, source="fuzz")
    cases = shard.part(expand(suite)) if shard else expand(suite)
    metrics = {
        name: {key: getattr(m, key) for key in ("title", "unit", "better", "version", "source")}
        for name, m in METRICS.items()
    }
    sitting = session(workers=1, threads=1, renderer="none")
    part = f"{shard.number}/{shard.of}" if shard else None
    asked = describe_run(suite, cases, seed=0, metrics=metrics, shard=part)
    write_manifest(RunDirectory(folder), {**asked, "sessions": [sitting]})
    burr = {"kind": "axial_ridge", "side": "protrusion", "height_mm": 1.0, "found": True}
    for number, case in enumerate(cases):
        append(
            folder / "records.jsonl",
            [
                Record(
                    case.id, variant.name, case.parameters, case.scene_hash, case.identity,
                    dict.fromkeys(METRICS, 0.1 * (number + 1)), (burr,), timings_s={"scan": 1.0},
                )
                for variant in suite.variant
            ],
        )  # fmt: skip
