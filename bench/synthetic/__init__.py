"""Synthetic partial scans of surfaces of revolution, what bounds any method on them, and tables over them."""
