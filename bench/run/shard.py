"""A part of a suite's cases, for those who have a batch queue and no scheduler."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

from burrscan.errors import InputError

Item = TypeVar("Item")


@dataclass(frozen=True)
class Shard:
    """Every ``of``-th case, beginning with the ``number``-th: neighbours in a sweep cost alike, so shards do.

    Parameters
    ----------
    number
        From 1 to ``of``, as arrays of batch jobs count.
    of
        Shards in all.

    """

    number: int
    of: int

    @classmethod
    def parse(cls, text: str) -> Shard:
        """Read ``3/16``.

        Raises
        ------
        InputError
            When it is no such thing.

        """
        number, slash, of = text.partition("/")
        whole = slash and number.isdecimal() and of.isdecimal()
        if not whole or not 1 <= int(number) <= int(of):
            raise InputError(f"'{text}': a shard is such as 3/16, the third of sixteen")
        return cls(int(number), int(of))

    def __str__(self) -> str:
        """As it is written on the command line."""
        return f"{self.number}/{self.of}"

    def part(self, cases: Sequence[Item]) -> tuple[Item, ...]:
        """Its share of the cases.

        Raises
        ------
        InputError
            When there are more shards than cases, and this one has none.

        """
        mine = tuple(cases[self.number - 1 :: self.of])
        if not mine:
            raise InputError(f"shard {self} of {len(cases)} cases is empty; make {len(cases)} shards at most")
        return mine
