"""Where the error comes from: every stage re-run with the truth of the stages before it."""

from bench.budget.budget import METRICS, SUBSTITUTIONS, mesh_budget, scan_budget

__all__ = ["METRICS", "SUBSTITUTIONS", "mesh_budget", "scan_budget"]
