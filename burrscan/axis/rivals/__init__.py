"""Other ways to find an axis: the seed paper's and the literature's, to compare with."""
