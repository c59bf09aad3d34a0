"""Axis estimators against synthetic truth, with no rendering: scans, the Cramér-Rao bound, the table."""
