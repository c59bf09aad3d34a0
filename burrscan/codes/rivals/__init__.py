"""Other code families than the default's, to compare with."""
