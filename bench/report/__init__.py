"""The report: one self-contained HTML page per run."""

from bench.report.page import build_report

__all__ = ["build_report"]
