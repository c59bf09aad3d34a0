"""Other scanning strategies than the default, to compare with; one also captures calibration boards."""
