"""Metrics: one definition each, and what a case without a result counts as."""

from bench.score.evidence import Evidence
from bench.score.metric import Metric
from bench.score.metrics import HEADLINE, METRICS, failed_metrics, measure, metric_named

__all__ = ["HEADLINE", "METRICS", "Evidence", "Metric", "failed_metrics", "measure", "metric_named"]
