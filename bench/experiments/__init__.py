"""Experiments that prove what the statistics claim: ``python -m bench.experiments.NAME``."""
