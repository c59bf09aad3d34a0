"""Code families over the projector's columns: what to project, and how to read it."""

METHODS = {
    "binary": "burrscan.codes.rivals.binary:binary",
    "complementary": "burrscan.codes.rivals.complementary:complementary",
    "gray": "burrscan.codes.gray:gray",
    "gray_phase": "burrscan.codes.gray_phase:gray_phase",
    "heterodyne": "burrscan.codes.rivals.heterodyne:heterodyne",
    "ladder": "burrscan.codes.rivals.multifrequency:ladder",
    "micro_phase": "burrscan.codes.rivals.micro_phase:micro_phase",
    "modulated": "burrscan.codes.rivals.modulated:modulated",
    "xor_phase": "burrscan.codes.rivals.xor:xor_phase",
}
"""Short name to a function ``(*, width, ...) -> Code``."""
