"""The error that a user of burrscan is meant to read, and one of its kinds that a caller can mend."""


class InputError(Exception):
    """Something the user handed over cannot be used.

    The message is one clear sentence or list: what is wrong, where, and what to do about it. The command line
    prints it without a traceback and exits with code 2.
    """


class NoLensError(InputError):
    """Distortion coefficients under which some pixels would look nowhere."""
