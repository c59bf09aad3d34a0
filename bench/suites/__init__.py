"""Suites: what a run measures. A TOML file names scenes, sweeps, seeds, variants and metrics."""
