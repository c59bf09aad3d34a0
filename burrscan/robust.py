"""The numbers of robust statistics that several places need."""

from __future__ import annotations

TUKEY = 4.685
"""Residuals beyond this many sigma weigh nothing: 95 % efficient on normal noise (Holland & Welsch 1977)."""
MEDIAN_SIZE = 0.6745
"""Median of the size of a normal variable, in its standard deviations."""
MEDIAN_OVER_MEAN = 1.2533
"""Standard error of a median over that of a mean, for normal errors."""
SIGMA_PER_MEDIAN = 1.4826
"""Standard deviation of a normal variable over the median of its size, rounded as the literature does."""
