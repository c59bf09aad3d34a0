"""Where the page's measurements are made and kept: scans of rendered wheels, results of sections."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any, cast

import numpy as np

from bench.reproduction.parts import Numbers
from bench.reproduction.scanned import Scanned, scanned
from bench.reproduction.scenery import paper_scene
from bench.reproduction.sources import source_of
from bench.run.provenance import code_digest
from burrscan.files import written_whole
from burrscan.pipeline import Pipeline, Stage
from scenes.scene import content_hash

SEED = Pipeline(scan=Stage("seed"), axis=Stage("seed"), generatrix=Stage("radius"), burrs=Stage("seed"))
"""The paper's method in every stage."""
DEFAULT = Pipeline()
PIPELINES: Mapping[str, Pipeline] = {"seed": SEED, "default": DEFAULT}
"""The two columns of the page."""
FULL_SCALE, QUICK_SCALE = 0.5, 0.2
"""Of the rasters: for the page, and for a look or a test."""
VIEWS = 20
"""Turns of the wheel that a verdict is told from."""


@dataclass(frozen=True)
class Lab:
    """Makes scans and keeps every result in a work folder, so that an interrupted run goes on.

    Parameters
    ----------
    work
        The folder; what other code measured is never taken for this code's.
    quick
        A fifth of the raster and few repeats, to see that everything works.
    code
        What stands for the state of the code; by default a hash of its sources.

    """

    work: Path
    quick: bool = False
    code: str = field(default_factory=lambda: code_digest("burrscan", "scenes"))

    @property
    def scale(self) -> float:
        """Of both rasters of the rig."""
        return QUICK_SCALE if self.quick else FULL_SCALE

    def repeats(self, full: int) -> int:
        """How many repeats stand for so many in a full run."""
        return max(full // 10, 3) if self.quick else full

    def kept(self, name: str, make: Callable[[], Numbers], *, also: str = "") -> Numbers:
        """Arrays by name: those of an earlier run, or made now and written for the next."""
        mark = hashlib.sha256(f"{self.code} {also} {self.quick}".encode()).hexdigest()[:12]
        path = self.work / f"{name}-{mark}.npz"
        if not path.exists():
            arrays: dict[str, Any] = {key: np.asarray(value) for key, value in make().items()}
            with written_whole(path) as beside:
                np.savez(beside, **arrays)
        with np.load(path, allow_pickle=False) as stored:
            return dict(stored)

    def of_section(self, name: str, module: ModuleType) -> Numbers:
        """What a section measured, kept as long as neither the code nor the section changes."""
        source = source_of(Path(str(module.__file__)))
        return self.kept(name, lambda: cast(Numbers, module.measure(self)), also=source)

    def scan(self, scene: str, method: str, /, *, spin_deg: float = 0.0, **parameters: Any) -> Scanned:
        """One scan of a scene of the page (:mod:`bench.reproduction.scenery`) by a strategy."""
        document = paper_scene(scene, scale=self.scale, spin_deg=spin_deg)
        key = f"scan-{scene}-{method}-{content_hash(document, parameters)}"
        return Scanned(self.kept(key, lambda: scanned(document, Stage(method, parameters))))

    def glance(
        self,
        scene: str,
        method: str,
        /,
        *,
        spin_deg: float = 0.0,
        changed: Mapping[str, Mapping[str, Any]] | None = None,
        **parameters: Any,
    ) -> Scanned:
        """A scan on half the raster that is not kept: one of many, from which the page tells a spread.

        ``changed`` are entries of the scene's tables. Scans of one scene in turn share its light.
        """
        scale = max(self.scale / 2.0, QUICK_SCALE)
        document = paper_scene(scene, scale=scale, spin_deg=spin_deg, changed=changed)
        return Scanned(scanned(document, Stage(method, parameters)))

    def turns_deg(self) -> list[float]:
        """Turns of the wheel, evenly all around: a verdict of one scan is a verdict of its noise."""
        count = self.repeats(VIEWS)
        return [360.0 * k / count for k in range(count)]

    def pair(self, scene: str) -> dict[str, Scanned]:
        """The scan of both variants."""
        return {name: self.scan(scene, pipeline.scan.method) for name, pipeline in PIPELINES.items()}
