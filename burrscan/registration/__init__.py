"""Several views of one part: their poses from rough ones, and one mesh of all."""

from burrscan.registration.align import align
from burrscan.registration.alignment import Alignment, PosedSurface
from burrscan.registration.merge import Merged, merge

__all__ = ["Alignment", "Merged", "PosedSurface", "align", "merge"]
