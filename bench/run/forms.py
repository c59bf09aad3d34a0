"""What ``run.json`` and ``records.jsonl`` must hold, as dataclasses that documents are read into."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal

import pydantic
from pydantic import Field

from burrscan.documents import STRICT

FORMAT = 1
"""Version of the run directory's layout."""

Scalar = str | float | int | bool
Numbers = Mapping[str, float | None]
Folder = Annotated[str, Field(pattern=r"^[^/\\.][^/\\]*$", max_length=255)]
"""A case's name is a folder's as well: no separators, and no dot before it."""

_OPEN = pydantic.ConfigDict(extra="ignore", allow_inf_nan=False)
"""For tables that are shown and decide nothing: what is needed is checked, more may stand there."""


@dataclass(frozen=True)
class GitForm:
    """The state of the checkout that a sitting ran from."""

    __pydantic_config__ = _OPEN

    commit: str
    modified: bool


@dataclass(frozen=True)
class MachineForm:
    """What a sitting ran on."""

    __pydantic_config__ = _OPEN

    processor: str
    cores: int | None
    system: str
    release: str
    architecture: str


@dataclass(frozen=True)
class SessionForm:
    """One sitting of a run."""

    __pydantic_config__ = _OPEN

    started: str
    workers: int
    threads_per_worker: int
    renderer: str
    python: str
    versions: Mapping[str, str]
    machine: MachineForm
    git: GitForm | None = None
    command: tuple[str, ...] | str = ()


@dataclass(frozen=True)
class MetricForm:
    """What makes a metric's values comparable."""

    __pydantic_config__ = _OPEN

    unit: str
    better: Literal["higher", "lower"]
    version: int
    title: str = ""
    source: str = ""


@dataclass(frozen=True)
class CaseForm:
    """One case of a run."""

    __pydantic_config__ = _OPEN

    id: Folder
    parameters: Mapping[str, Scalar]
    scene_hash: str
    identity: str


@dataclass(frozen=True)
class AcceptedForm:
    """When and why a run was made a baseline."""

    __pydantic_config__ = _OPEN

    at: str
    run: str
    note: str = ""


@dataclass(frozen=True)
class ManifestForm:
    """``run.json``."""

    __pydantic_config__ = STRICT

    format: Literal[1]
    suite: Mapping[str, Any]
    suite_hash: str
    seed: Annotated[int, Field(ge=0)]
    only: str
    metrics: Mapping[str, MetricForm]
    cases: tuple[CaseForm, ...]
    sessions: tuple[SessionForm, ...]
    accepted: AcceptedForm | None = None
    shard: Annotated[str, Field(pattern=r"^[1-9]\d*/[1-9]\d*$")] | None = None
    store: str | None = None


@dataclass(frozen=True)
class FailureForm:
    """Why a record has no result."""

    __pydantic_config__ = STRICT

    stage: str
    error: Annotated[str, Field(min_length=1)]
    traceback: str


@dataclass(frozen=True)
class BurrForm:
    """What every true burr's table holds; errors are there where it was found."""

    __pydantic_config__ = _OPEN

    found: bool
    height_mm: float
    kind: str = ""
    side: str = ""
    section: str = ""
    width_mm: float | None = None
    visible_mm: float | None = None
    measurable_mm: float | None = None
    covered_mm: float | None = None
    angle_error_deg: float | None = None
    height_error_mm: float | None = None
    start_error_mm: float | None = None
    end_error_mm: float | None = None


@dataclass(frozen=True)
class RecordForm:
    """One line of ``records.jsonl``."""

    __pydantic_config__ = STRICT

    case: Folder
    variant: str
    parameters: Mapping[str, Scalar]
    scene_hash: str
    identity: str
    metrics: Numbers
    burrs: tuple[BurrForm, ...]
    failure: FailureForm | None
    timings_s: Mapping[str, float] = field(default_factory=dict)
    budget: Mapping[str, Numbers] = field(default_factory=dict)
