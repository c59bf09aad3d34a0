"""What a run costs: seconds per megapixel and stage as the last run on this machine had them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from bench.cell.spec import cell_from
from bench.suites.case import Case
from bench.suites.identity import content_hash
from bench.suites.suite import Suite, Variant
from bench.suites.variants import stages_of
from bench.synthetic.spec import mesh_from
from burrscan.documents import build, read_json
from burrscan.errors import InputError
from scenes.scene import scene_from

START_S = 15.0  # spawning workers, loading Mitsuba, and compiled kernels


@dataclass(frozen=True)
class Costs:
    """What things cost on a machine.

    Parameters
    ----------
    seconds
        Processor time of a worker, seconds per million camera pixels (or vertices, of a mesh): of making a
        case, by source, and of a pipeline, by :func:`pipeline_key`, its scan's method, or ``"any"``.
    overhead
        Wall time times workers over the sum of those: scoring, keeping pictures, waiting for the last case.
    record_bytes, light_bytes
        Of a record's pictures and maps; of a case's traced light, per million camera pixels.
    measured
        When, on this machine; empty for the figures that come along.

    """

    seconds: Mapping[str, float]
    overhead: float
    record_bytes: float
    light_bytes: float
    measured: str = ""

    def making(self, source: str) -> float:
        """Seconds per megapixel of making a case; figures older than a source know it by those shipped."""
        return self.seconds.get(source, SHIPPED.seconds[source])


SHIPPED = Costs(
    seconds={"scene": 4.6, "mesh": 1.0, "cell": 45.0, "adaptive": 6.4, "fixed": 4.0, "any": 7.0},
    overhead=1.4,
    record_bytes=2.5e5,
    light_bytes=4.0e7,
)
"""One worker with both cores of an AMD EPYC virtual machine, LLVM; 2026-11-21."""


@dataclass(frozen=True)
class Estimate:
    """What a run will take, roughly.

    Parameters
    ----------
    seconds
        Wall time when nothing else runs on the machine and no light has been traced before.
    run_bytes, light_bytes
        In the run's folder; in the folder of traced light, whose size is limited.
    workers
        Processes.
    worker_seconds
        What they spend on the cases together; a cluster's bill.
    basis
        Where the figures come from.

    """

    seconds: float
    run_bytes: float
    light_bytes: float
    workers: int
    worker_seconds: float
    basis: str

    @property
    def takes(self) -> str:
        """The time in words."""
        return _duration(self.seconds)

    def __str__(self) -> str:
        """One line for people."""
        disk = f"{_size(self.run_bytes)} on disk"
        light = f", up to {_size(self.light_bytes)} of traced light in the cache" if self.light_bytes else ""
        cores = f"{self.workers} core{'s' if self.workers > 1 else ''}"
        bill = f"{self.worker_seconds / 3600.0:.2g} worker-hours"
        return f"an estimate: {self.takes} on {cores}, {bill}, {disk}{light} ({self.basis})"


def estimate(suite: Suite, cases: Sequence[Case], costs: Costs, *, workers: int) -> Estimate:
    """What it takes to run ``cases`` of a suite. O(cases)."""
    workers = max(1, min(workers, len(cases)))
    size = sum(megapixels(suite, case) for case in cases)
    each = sum(_seconds(variant, costs) for variant in suite.variant)
    work_s = size * (costs.making(suite.source) + each) * costs.overhead
    return Estimate(
        seconds=(START_S + work_s / workers) if cases else 0.0,
        run_bytes=len(cases) * len(suite.variant) * costs.record_bytes,
        light_bytes=size * costs.light_bytes if suite.source == "scene" else 0.0,
        workers=workers,
        worker_seconds=work_s,
        basis=f"from the run of {costs.measured} here" if costs.measured else "figures of another machine",
    )


def known_costs(folder: Path | None) -> Costs:
    """The figures in ``folder``, or those that come along where there are none that can be read."""
    if folder is None:
        return SHIPPED
    with suppress(InputError):
        return build(Costs, read_json(costs_file(folder)), source=str(costs_file(folder)))
    return SHIPPED


def pipeline_key(variant: Variant) -> str:
    """A pipeline by its content: two variants that do the same cost the same. Nothing is imported."""
    return "pipeline " + content_hash(asdict(stages_of(variant)))[:12]


def _seconds(variant: Variant, costs: Costs) -> float:
    """Seconds per megapixel of a variant: measured, else those of its way to scan, else any's."""
    known = costs.seconds
    return known.get(pipeline_key(variant), known.get(stages_of(variant).scan.method, known["any"]))


def megapixels(suite: Suite, case: Case) -> float:
    """Millions of camera pixels of a case, or of vertices."""
    if suite.source == "mesh":
        spec = mesh_from(case.document, source=case.id)
        return spec.around * spec.along * 1e-6
    if suite.source == "cell":
        cell = cell_from(case.document, source=case.id)
        rows, columns = cell.scene.rig.rig().camera.shape
        # each burr that is removed takes about three looks and one afterwards
        return rows * columns * (cell.task.looks + 4 * cell.task.remove) * 1e-6
    rows, columns = scene_from(case.document, source=case.id).rig.rig().camera.shape
    return rows * columns * 1e-6


def costs_file(folder: Path) -> Path:
    """Where a folder keeps its figures."""
    return folder / "costs.json"


def _duration(seconds: float) -> str:
    if seconds < 90.0:
        return f"about {10 * max(1, round(seconds / 10.0))} s"
    return f"about {seconds / 60.0:.0f} min" if seconds < 5400.0 else f"about {seconds / 3600.0:.1f} h"


def _size(size: Any) -> str:
    if size >= 1e12:
        return f"{size / 1e12:.1f} TB"
    return f"{size / 1e9:.1f} GB" if size >= 1e9 else f"{max(size, 1e6) / 1e6:.0f} MB"
