"""Accepted runs: small copies of runs that later ones are compared with, kept in git."""

from bench.baselines.history import Point, history
from bench.baselines.store import BASELINES, accept, accepted, newest

__all__ = ["BASELINES", "Point", "accept", "accepted", "history", "newest"]
