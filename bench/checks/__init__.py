"""Comparisons with other programs that tests cannot make: each needs an environment of its own."""
