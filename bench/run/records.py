"""Records: one line of JSON per case and variant, appended as each case ends."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from bench.run.forms import RecordForm
from burrscan.documents import build, finite
from burrscan.errors import InputError
from burrscan.files import write_text


@dataclass(frozen=True)
class Failure:
    """Why a case has no result: where it stopped, the error and its traceback."""

    stage: str
    error: str
    traceback: str


@dataclass(frozen=True)
class Record:
    """What one variant made of one case.

    Parameters
    ----------
    case, variant
        Which.
    parameters, scene_hash, identity
        As in :class:`bench.suites.Case`.
    metrics
        Name to value; NaN where the metric does not apply, such as the angle error of a burr that was missed.
    burrs
        One table per true burr: what it was and what was found of it.
    failure
        Why there is no result, or None.
    timings_s
        Wall time per stage: the only part that differs between two runs of one seed.
    budget
        Substitution to metric to value (:mod:`bench.budget`); empty where none was asked for.

    """

    case: str
    variant: str
    parameters: Mapping[str, Any]
    scene_hash: str
    identity: str
    metrics: Mapping[str, float]
    burrs: tuple[Mapping[str, Any], ...] = ()
    failure: Failure | None = None
    timings_s: Mapping[str, float] = field(default_factory=dict)
    budget: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def key(self) -> tuple[str, str]:
        """Case and variant."""
        return self.case, self.variant

    def line(self) -> str:
        """The record as one line of JSON; what is not finite becomes null."""
        return json.dumps(finite(asdict(self)), separators=(",", ":"), allow_nan=False) + "\n"


def append(path: Path, records: Iterable[Record]) -> None:
    """Add records to a file in one write, and see them to the disk."""
    data = "".join(record.line() for record in records).encode()
    with path.open("ab") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())


def write(path: Path, records: Iterable[Record]) -> None:
    """Write a file of these records alone."""
    write_text(path, "".join(record.line() for record in records))


def count_failed(records: Iterable[Record]) -> int:
    """How many have no result."""
    return sum(record.failure is not None for record in records)


def read(path: Path) -> list[Record]:
    """The whole lines of a records file, in file order; a line torn off by a crash is left out.

    Raises
    ------
    InputError
        When a line is not a record.

    """
    try:
        text = path.read_bytes().rpartition(b"\n")[0].decode()  # what follows it was never finished
    except FileNotFoundError:
        return []
    except ValueError as error:
        raise InputError(f"{path}: not UTF-8 ({error}); was the file edited?") from error
    lines = text.split("\n") if text else []
    return [_record(line, f"{path}, line {number}") for number, line in enumerate(lines, 1)]


def _record(line: str, where: str) -> Record:
    try:
        table = json.loads(line)
        if not isinstance(table, dict):
            raise InputError(f"{where}: not a record; was the file edited?")
        build(RecordForm, table, source=where)
        failure = table.pop("failure")
        metrics = _numbers(table.pop("metrics"))
        burrs = tuple(table.pop("burrs"))
        budget = {name: _numbers(values) for name, values in table.pop("budget", {}).items()}
        why = Failure(**failure) if failure else None
        return Record(**table, metrics=metrics, burrs=burrs, failure=why, budget=budget)
    except (ValueError, RecursionError, KeyError, TypeError, AttributeError) as error:
        raise InputError(f"{where}: not a record ({error}); was the file edited?") from error


def _numbers(table: Mapping[str, Any]) -> dict[str, float]:
    return {name: math.nan if value is None else value for name, value in table.items()}
