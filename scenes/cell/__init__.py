"""A simulated cell: an arm that carries the scanner and a mill, a turntable that carries the part."""
