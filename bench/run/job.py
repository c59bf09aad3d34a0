"""What a worker is told once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bench.suites.sources import Source
from bench.suites.suite import Variant


@dataclass(frozen=True)
class Job:
    """What is the same for all cases of a run.

    Parameters
    ----------
    variants
        The pipelines that look at every case.
    out_dir
        The run directory.
    own_metrics
        Metrics of the user's own, ``"module:attribute"``.
    source
        What cases are made of.
    budgeted
        Names of the variants of which is found out where their errors come from.
    detectability
        Whether scenes are traced without their burrs, too.
    transports
        Address of the store of traced light; empty for the worker's own folder, ``off`` for none.
    kept_at
        Address at which a cluster's workers leave pictures; empty where they come back with the records.

    """

    variants: tuple[Variant, ...]
    out_dir: Path
    own_metrics: tuple[str, ...] = ()
    source: Source = "scene"
    budgeted: tuple[str, ...] = ()
    detectability: bool = False
    transports: str = ""
    kept_at: str = ""
