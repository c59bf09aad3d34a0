"""An axis searched again and again, each time in a random frame: the paper's own is not known."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from bench.synthetic.revolution import axis_angle_deg
from burrscan.arrays import Floats, Ints32
from burrscan.errors import InputError
from burrscan.inspection import Axis

DRAW = 1_000_003
"""Between the seeds of frames: neighbours start the same stream of random samples."""
_NONE_DEG = 90.0
"""Off by so much is an axis that was not found."""
Mesh = tuple[Floats, Ints32]
Method = Callable[..., Axis]


@dataclass(frozen=True)
class Search:
    """One search.

    Parameters
    ----------
    turned_mm
        (V, 3) the vertices in its frame.
    axis
        What was found there; None where the method has no answer.
    turn
        (3, 3) into the frame.
    seconds
        Processor time.

    """

    turned_mm: Floats
    axis: Axis | None
    turn: Floats
    seconds: float

    @property
    def direction(self) -> Floats:
        """(3,) of the axis, turned back into the mesh's own frame; NaN where there is none."""
        return np.full(3, np.nan) if self.axis is None else np.asarray(self.turn.T @ self.axis.direction)

    def error_deg(self, true: Floats) -> float:
        """Angle to the true direction (3,) in the mesh's own frame."""
        return _NONE_DEG if self.axis is None else axis_angle_deg(self.direction, true)


def searches(
    method: Method, mesh_of: Mesh | Callable[[int], Mesh], count: int, *, stream: int
) -> Iterator[Search]:
    """Searches in ``count`` frames of a random stream, each with samples of its own.

    ``mesh_of`` is the mesh, or gives the mesh of a frame's number, such as one with noise of its own.
    """
    for k, turn in enumerate(Rotation.random(count, random_state=stream).as_matrix()):
        vertices, faces = mesh_of if isinstance(mesh_of, tuple) else mesh_of(k)
        turned = np.ascontiguousarray((vertices - vertices.mean(axis=0)) @ turn.T)
        start = time.process_time()
        try:
            axis = method(turned, faces, seed=DRAW * k)
        except InputError:
            axis = None
        yield Search(turned, axis, turn, time.process_time() - start)
