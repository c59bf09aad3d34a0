"""What a case's tables describe: a scene to be rendered, a synthetic mesh, or a cell. One table, no more."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Literal

from bench.cell.spec import cell_hash
from bench.synthetic.spec import mesh_hash
from scenes.scene import scene_from, scene_hash

Source = Literal["scene", "mesh", "cell"]
"""``scene``: rendered, scanned and inspected (:mod:`scenes.scene`). ``mesh``: only inspected
(:mod:`bench.synthetic.spec`); the metrics of a scan do not apply. ``cell``: a scene in a cell, seen
from all sides (:mod:`bench.cell.spec`)."""


def _scene_hash(document: Mapping[str, Any]) -> str:
    return scene_hash(scene_from(document, source="scene"))


HASHES: dict[Source, Callable[[Mapping[str, Any]], str]] = {
    "scene": _scene_hash,
    "mesh": mesh_hash,
    "cell": cell_hash,
}
"""By source, the content hash of a case's tables; raises InputError with every error in them."""
