"""Runs: workers, records that survive anything, provenance, pictures for the report."""

from bench.run.directory import Run, RunDirectory, load_run
from bench.run.records import Failure, Record

__all__ = ["Failure", "Record", "Run", "RunDirectory", "load_run"]
