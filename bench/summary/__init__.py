"""Summaries of a run's records: the score table, the goals, the error budget."""
