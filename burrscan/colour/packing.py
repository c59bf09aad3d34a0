"""Which frames go to which primary: those that a decoder compares with one another stay together."""

from __future__ import annotations

from collections.abc import Sequence

from burrscan.arrays import Levels
from burrscan.colour.mixing import CHANNELS
from burrscan.scanner import Patterns

_INVERSE = "-inverse"


def packed(shown: Patterns) -> tuple[tuple[int, ...], ...]:
    """Frame numbers of each primary, in order; the longest list is the number of pictures.

    A single group is shown by all primaries at once: three times the same list. Groups go to the primary with
    the fewest frames so far, the longest first (Graham 1969: within 4/3 of the fewest pictures).
    """
    groups: dict[str, list[int]] = {}
    for number, (name, frame) in enumerate(zip(shown.names, shown.frames, strict=True)):
        groups.setdefault(_group(name, frame, shown.names), []).append(number)
    if len(groups) == 1:
        return (tuple(range(len(shown))),) * CHANNELS
    bins: list[list[int]] = [[] for _ in range(CHANNELS)]
    for group in sorted(groups.values(), key=len, reverse=True):
        min(bins, key=len).extend(group)
    return tuple(tuple(one) for one in bins)


def _group(name: str, frame: Levels, names: Sequence[str]) -> str:
    """What a frame is read together with, by its name.

    A frame that has its inverse and two levels alone is a bit: the two are compared with each other. Steps of
    one sine differ in the last part of their names. Bits without inverses are held against white and black,
    which have the first part of the name in common with them.
    """
    plain = name.removesuffix(_INVERSE)
    bit = len(set(frame.reshape(-1)[:: max(1, frame.size // 4096)].tolist())) <= 2
    if bit and plain in names and plain + _INVERSE in names:
        return plain
    return plain.partition("-")[0] if bit else plain.rpartition("-")[0]
