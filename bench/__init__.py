"""The laboratory: suites, runs, metrics, statistics, comparisons, reports, the command line."""
