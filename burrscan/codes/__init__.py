"""Code families over the projector's columns: what to project, and how to read it."""

METHODS = {
    "gray": "burrscan.codes.gray:gray",
    "gray_phase": "burrscan.codes.gray_phase:gray_phase",
}
"""Short name to a function ``(*, width, ...) -> Code``."""
