"""Scanning strategies: loops over :meth:`burrscan.scanner.Scanner.capture`."""

METHODS = {
    "fixed": "burrscan.scan.rivals.fixed:scan_fixed",
    "adaptive": "burrscan.scan.adaptive:scan_adaptive",
    "multi_exposure": "burrscan.scan.rivals.multi_exposure:scan_multi_exposure",
    "both": "burrscan.scan.rivals.rows_and_columns:scan_rows_and_columns",
    "seed": "burrscan.scan.rivals.seed:scan_seed",
    "single_shot": "burrscan.scan.rivals.single_shot:scan_single_shot",
    "colour": "burrscan.colour.scan:scan_colour",
}
"""Short name to a function ``(scanner, *, ...) -> Scan``."""
