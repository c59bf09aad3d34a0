"""Calibration: the geometry of camera and projector from boards, their photometry from ramps."""
