"""Finding the axis of a surface of revolution."""
