"""From a mesh and its axis to the curve that, turned about the axis, makes the part."""

from burrscan.generatrix.curve import fit_generatrix
from burrscan.generatrix.deviation import deviation_mm

METHODS = {
    "curve": "burrscan.generatrix.curve:fit_generatrix",
    "radius": "burrscan.generatrix.rivals.radius:fit_radius",
}
"""Short names of the ways to find the generatrix."""

__all__ = ["METHODS", "deviation_mm", "fit_generatrix"]
