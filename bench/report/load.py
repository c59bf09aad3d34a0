"""Reading what a run kept of a case (:mod:`bench.run.artefacts`)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Arrays = Mapping[str, NDArray[Any]]


def load(path: Path) -> Arrays:
    """The arrays of a file; none when the file is missing or damaged, for a report shows what there is."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as arrays:
            return dict(arrays)
    except Exception:  # noqa: BLE001 (a damaged archive raises a dozen kinds, EOFError and KeyError among them)
        return {}
