"""The seed paper, claim by claim: what it reports beside what we measure, on one page.

K. Claes, T. P. Koninckx, H. Bruyninckx, "Automatic burr detection on surfaces of revolution based on adaptive
3D scanning", 2005. Every section is a module with ``measure(lab)`` to plain numbers and ``draw(numbers)`` to
pictures, a caption and claims; :mod:`bench.reproduction.sections` puts them in order.
"""

from bench.reproduction.page import build_paper
from bench.reproduction.sections import NAMES

__all__ = ["NAMES", "build_paper"]
