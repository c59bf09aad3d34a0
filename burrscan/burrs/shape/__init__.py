"""The ridge that fits a patch of vertices: height, place, width and extent."""
