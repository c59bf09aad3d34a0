"""Several views of one part: their poses from rough ones, and one mesh of all."""

from burrscan.registration.align import align
from burrscan.registration.alignment import Alignment, Free, PosedSurface
from burrscan.registration.judge import refuse_doubtful
from burrscan.registration.merge import Merged, merge

__all__ = ["Alignment", "Free", "Merged", "PosedSurface", "align", "merge", "refuse_doubtful"]
