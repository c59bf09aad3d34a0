"""The cell: looking at a part from all sides, going to its burrs, and looking again after their removal."""
