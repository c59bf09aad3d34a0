"""The cell: looking at a part from several sides, going to its burrs, and looking again after their removal."""
