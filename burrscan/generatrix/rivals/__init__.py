"""Other ways to find a generatrix than the default, to compare with."""
