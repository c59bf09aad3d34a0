"""Finding the axis of a surface of revolution."""

from burrscan.axis.api import METHODS, find_axis

__all__ = ["METHODS", "find_axis"]
