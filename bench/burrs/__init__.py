"""Burr detection against synthetic truth, with no rendering: scans, the information bound, the table."""
