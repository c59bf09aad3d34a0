"""Where the error comes from: every stage re-run with the truth of the stages before it."""

from bench.budget.budget import METRICS, SUBSTITUTIONS, mesh_budget, scan_budget
from bench.budget.summary import BudgetRow, budget_rows

__all__ = ["METRICS", "SUBSTITUTIONS", "BudgetRow", "budget_rows", "mesh_budget", "scan_budget"]
