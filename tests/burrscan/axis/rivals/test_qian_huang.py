"""The port of reference 14."""

from __future__ import annotations

from bench.synthetic.revolution import revolution_scan
from burrscan.axis.rivals.qian_huang import find_axis_qian_huang
from tests.tiers import some_of


@some_of("arc_deg", [140.0, 360.0])
def test_sections_need_not_be_open_arcs(arc_deg: float) -> None:
    """Ordered along its longest side, a full turn is folded over (17 degrees off here)."""
    scan = revolution_scan("cylinder", arc_deg=arc_deg, shape=(200, 60), sigma_mm=0.05, seed=3)
    axis = find_axis_qian_huang(scan.vertices_mm, scan.faces, directions=100, zooms=2)
    assert scan.angle_error_deg(axis.direction) < 8.0
