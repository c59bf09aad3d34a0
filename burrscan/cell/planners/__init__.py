"""Where to look next. ``expected`` is the default; the others are its baselines."""

METHODS = {
    "expected": "burrscan.cell.planners.expected:expected",
    "greedy": "burrscan.cell.planners.baselines:greedy",
    "random": "burrscan.cell.planners.baselines:random",
    "ring": "burrscan.cell.planners.baselines:ring",
}
"""Short names of the ways to choose the next look; anyone's own as ``"module:function"``."""
