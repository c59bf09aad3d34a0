"""A/B comparison of two runs, or of two variants of one run, case by case.

:func:`compare_runs` makes a :class:`Comparison`; README.md says how, and what it was measured to be worth.
"""

from bench.compare.comparison import compare_runs
from bench.compare.joined import joined
from bench.compare.result import (
    ArmComparison,
    BurrChange,
    CaseChange,
    Comparison,
    FoundOrMissed,
    GateOutcome,
    Row,
    Verdict,
)

__all__ = [
    "ArmComparison",
    "BurrChange",
    "CaseChange",
    "Comparison",
    "FoundOrMissed",
    "GateOutcome",
    "Row",
    "Verdict",
    "compare_runs",
    "joined",
]
