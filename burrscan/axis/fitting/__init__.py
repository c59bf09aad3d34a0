"""Fitting a free generatrix about an axis: where to start, the fit, what it leaves uncertain or open."""
