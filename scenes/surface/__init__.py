"""What the surface of a wheel looks like where it is no burr: finish zones, blemishes, and their truth."""

from scenes.surface.spec import Blemish, BrightSpot, Chatter, Scratch, Stain, Zone
from scenes.surface.truth import TrueBlemish, blemish_at, true_blemishes

__all__ = [
    "Blemish",
    "BrightSpot",
    "Chatter",
    "Scratch",
    "Stain",
    "TrueBlemish",
    "Zone",
    "blemish_at",
    "true_blemishes",
]
