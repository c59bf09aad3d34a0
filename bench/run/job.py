"""What a worker is told once."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from bench.suites.suite import Variant


@dataclass(frozen=True)
class Job:
    """What is the same for all cases of a run."""

    variants: tuple[Variant, ...]
    out_dir: Path
