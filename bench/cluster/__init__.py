"""Runs on a Dask cluster that somebody else started: the driver hands out cases and alone writes records."""
