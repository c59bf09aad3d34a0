"""From the deviations around the generatrix to burrs and nicks."""

from burrscan.burrs.residual import burrs_residual

METHODS = {
    "residual": "burrscan.burrs.residual:burrs_residual",
    "seed": "burrscan.burrs.rivals.seed:burrs_seed",
    "seed-literal": "burrscan.burrs.rivals.seed:burrs_seed_literal",
}
"""Short names of the ways to find burrs."""

__all__ = ["METHODS", "burrs_residual"]
