"""Damaged input of every kind against the command line: one clear line and 2, or a right answer."""
