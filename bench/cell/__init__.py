"""Cases in which a cell looks at a part from all sides, goes to its burrs and removes them."""
