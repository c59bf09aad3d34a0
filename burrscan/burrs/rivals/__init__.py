"""Other ways to find burrs: the seed paper's, to compare with."""
