"""The scenes of the page."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from scenes.scene import scene_document

PLANE: dict[str, Any] = {
    "finish": {"name": "polished", "metal": "steel", "alpha": 0.06, "diffuse_share": 0.6},
    # facing halfway between camera and projector, so that the mirror reflection meets the camera
    "pose": {"elevation_deg": 90.0, "yaw_deg": -9.2},
    "burr": [],
    "wheel": {"name": "disc", "generatrix": [[-5.0, 0.0], [-5.0, 150.0], [5.0, 150.0], [5.0, 0.0]]},
}
"""A glossy plane, as in figure 2: a flat disc as large as the picture."""
SCENES: dict[str, tuple[str, dict[str, float]]] = {
    "wheel": ("seam", {}),
    "oblique": ("seam", {"elevation_deg": 14.0}),
    "catalogue": ("paper", {"roll_deg": 9.0, "elevation_deg": 5.0}),
    "plane": ("", {}),
    "direct": ("seam", {}),
    "hub": ("seam", {}),
    "hub-direct": ("seam", {}),
    "curved": ("seam", {}),
    "copper": ("copper", {"roll_deg": 9.0, "elevation_deg": 5.0}),
}
"""Name on the page to scene of the catalogue (:data:`PLANE` where empty) and what its pose is changed to."""
_DIRECT = {"render": {"bounces": 1}}
"""Light of the first surface only."""
_HUB = {"wheel": "stepped_hub", "burr": []}
TABLES: dict[str, dict[str, Any]] = {
    "direct": _DIRECT,
    "hub": _HUB,
    "hub-direct": _HUB | _DIRECT,
    # the curve of ITU-R BT.709, as consumer cameras have it
    "curved": {"camera": {"response": {"gamma": 0.45}}},
}
"""Tables of a scene that take the place of the catalogue's."""


def paper_scene(
    name: str,
    *,
    scale: float,
    spin_deg: float = 0.0,
    changed: Mapping[str, Mapping[str, Any]] | None = None,
) -> dict[str, Any]:
    """The tables of a scene: its rig scaled, its part turned about its own axis, some entries changed."""
    base, change = SCENES[name]
    document = (scene_document(base) if base else PLANE) | TABLES.get(name, {})
    pose = {**document.get("pose", {}), **change, **({"spin_deg": spin_deg} if spin_deg else {})}
    document |= {"rig": {**document.get("rig", {}), "scale": scale}, "pose": pose}
    return document | {table: {**document[table], **entries} for table, entries in (changed or {}).items()}
