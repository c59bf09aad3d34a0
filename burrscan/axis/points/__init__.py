"""What the axis is fitted to: points in the canonical frame, smoothed, thinned, with normals."""
