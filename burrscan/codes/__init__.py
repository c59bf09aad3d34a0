"""Code families over the projector's columns: what to project, and how to read it."""

METHODS = {
    "binary": "burrscan.codes.binary:binary",
    "complementary": "burrscan.codes.complementary:complementary",
    "gray": "burrscan.codes.gray:gray",
    "gray_phase": "burrscan.codes.gray_phase:gray_phase",
    "heterodyne": "burrscan.codes.heterodyne:heterodyne",
    "ladder": "burrscan.codes.multifrequency:ladder",
    "micro_phase": "burrscan.codes.micro_phase:micro_phase",
    "modulated": "burrscan.codes.modulated:modulated",
    "xor_phase": "burrscan.codes.xor:xor_phase",
}
"""Short name to a function ``(*, width, ...) -> Code``."""
