"""The report: one self-contained HTML page per run, or per comparison."""

from bench.report.page import build_comparison, build_detection, build_report

__all__ = ["build_comparison", "build_detection", "build_report"]
