"""Scanning strategies: loops over :meth:`burrscan.scanner.Scanner.capture`."""

METHODS = {
    "fixed": "burrscan.scan.fixed:scan_fixed",
    "adaptive": "burrscan.scan.adaptive:scan_adaptive",
}
"""Short name to a function ``(scanner, *, ...) -> Scan``."""
