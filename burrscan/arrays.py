"""Array aliases and the one helper that makes a dataclass's arrays read-only."""

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Floats: TypeAlias = NDArray[np.float64]
Floats32: TypeAlias = NDArray[np.float32]
Complexes: TypeAlias = NDArray[np.complex128]
Bools: TypeAlias = NDArray[np.bool_]
Ints: TypeAlias = NDArray[np.int64]
Ints32: TypeAlias = NDArray[np.int32]
Ints16: TypeAlias = NDArray[np.int16]
Levels: TypeAlias = NDArray[np.uint8]
"""Projector levels, 0 to 255."""
Image: TypeAlias = NDArray[np.uint16]
"""Camera values in DN (digital numbers)."""


def freeze(owner: object, **arrays: NDArray[np.generic] | None) -> None:
    """Store ``arrays`` on a frozen dataclass as read-only views (from its ``__post_init__``)."""
    for name, array in arrays.items():
        view = None if array is None else array.view()
        if view is not None:
            view.flags.writeable = False
        object.__setattr__(owner, name, view)
