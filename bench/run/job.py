"""What a worker is told once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bench.suites.suite import Variant


@dataclass(frozen=True)
class Job:
    """What is the same for all cases of a run: the variants, where to write, metrics of the user's own."""

    variants: tuple[Variant, ...]
    out_dir: Path
    own_metrics: tuple[str, ...] = ()
