"""What a mill takes off that gives way to what it cuts."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import manifold3d
import numpy as np

from burrscan.arrays import Floats
from scenes.cell.spec import MillSpec
from scenes.wheel import Cut, Wheel
from scenes.wheel.mill import mill

_TURN_COS = -0.5
"""Feeds that turn by more than 120 degrees begin a new pass."""
_STILL_MM = 0.2
"""Steps across its axis shorter than this are the arm's scatter, not a feed."""
_AROUND_MM = 6.0
"""Of the wheel beyond the mill that is looked at: what it may meet."""


def milled(wheel: Wheel, before: Sequence[Cut], tools: Floats, spec: MillSpec) -> list[Cut]:
    """The passes of a mill that was led through (N, 4, 4) poses in the part frame.

    Between two poses the mill is pushed back along its axis by thrust / stiffness, thrust being the section
    of metal in its way times ``spec.thrust_n_mm2``. O(N) booleans of a piece of the wheel.
    """
    body = _piece(wheel, tools[:, :3, 3], spec)
    for cut in before:
        body -= cut.swept()
    cuts = []
    for run in _runs(tools):
        cut = _given_way(body, tools[run], spec)
        body -= cut.swept()
        cuts.append(cut)
    return cuts


def _runs(tools: Floats) -> list[slice]:
    """Stretches in which the mill goes on: a pass ends where its feed turns back.

    The feed is the step across the mill's axis; going down or up is none.
    """
    steps = np.diff(tools[:, :3, 3], axis=0)
    axes = tools[1:, :3, 2]
    feeds = steps - (steps * axes).sum(axis=1, keepdims=True) * axes
    lengths = np.linalg.norm(feeds, axis=1)
    moving = np.flatnonzero(lengths > _STILL_MM)
    turns = [
        int(there)
        for here, there in itertools.pairwise(moving)
        if feeds[here] @ feeds[there] < _TURN_COS * lengths[here] * lengths[there]
    ]
    ends = [0, *turns, len(tools) - 1]
    return [slice(a, b + 1) for a, b in itertools.pairwise(ends) if b > a]


def _given_way(body: manifold3d.Manifold, tools: Floats, spec: MillSpec) -> Cut:
    """One pass, pushed back by what it cuts."""
    tips, axes = tools[:, :3, 3], tools[:, :3, 2]
    places = [mill(tip, axis, spec.radius_mm, spec.length_mm) for tip, axis in zip(tips, axes, strict=True)]
    back = np.zeros(len(tips))
    for number, (here, there) in enumerate(itertools.pairwise(places)):
        way = float(np.linalg.norm(tips[number + 1] - tips[number]))
        fresh = (body ^ manifold3d.Manifold.batch_hull([here, there])) - here
        section = fresh.volume() / max(way, 1e-9)
        back[number + 1] = spec.thrust_n_mm2 * section / spec.stiffness_n_mm
    back[0] = back[1]
    pushed = tips + back[:, None] * axes
    return Cut(
        tips_mm=tuple(map(tuple, pushed.tolist())),
        axes=tuple(map(tuple, axes.tolist())),
        radius_mm=spec.radius_mm,
        length_mm=spec.length_mm,
    )


def _piece(wheel: Wheel, tips: Floats, spec: MillSpec) -> manifold3d.Manifold:
    """The wheel around a path."""
    vertices, faces = wheel.welded()
    mesh = manifold3d.Mesh64(vert_properties=vertices, tri_verts=faces.astype(np.uint64))
    whole = manifold3d.Manifold(mesh)
    margin = spec.radius_mm + _AROUND_MM
    low, high = tips.min(axis=0) - margin, tips.max(axis=0) + margin
    return whole ^ manifold3d.Manifold.cube(tuple(high - low)).translate(tuple(low))
