"""The scenes of the page."""

from __future__ import annotations

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
}
"""Name on the page to scene of the catalogue (:data:`PLANE` where empty) and what its pose is changed to."""


def paper_scene(name: str, *, scale: float, spin_deg: float = 0.0) -> dict[str, Any]:
    """The tables of a scene, its rig scaled, its part turned about its own axis."""
    base, change = SCENES[name]
    document = scene_document(base) if base else PLANE
    pose = {**document.get("pose", {}), **change, **({"spin_deg": spin_deg} if spin_deg else {})}
    return document | {"rig": {**document.get("rig", {}), "scale": scale}, "pose": pose}
