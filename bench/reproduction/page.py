"""Building the page: measure what is missing, draw everything, write one self-contained file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.plotting.page import write_page
from bench.reproduction.lab import Lab
from bench.reproduction.parts import Section
from bench.reproduction.sections import NAMES, module_of
from bench.run.provenance import git_state, machine

Tell = Callable[[str], None]


@dataclass(frozen=True)
class Placed:
    """A section under its short name."""

    name: str
    section: Section


def build_paper(lab: Lab, page: Path, *, only: Sequence[str] = (), tell: Tell = lambda _: None) -> Path:
    """Write the page; what an interrupted run measured is taken from the lab's work folder.

    Parameters
    ----------
    lab
        Makes the measurements.
    page
        The file to write; it loads nothing from anywhere.
    only
        Short names of sections; all of them where empty.
    tell
        Is told which section is being measured.

    Raises
    ------
    burrscan.errors.InputError
        For a section that does not exist.

    """
    modules = {name: module_of(name) for name in only or NAMES}
    placed = []
    for name, module in modules.items():
        tell(name)
        placed.append(Placed(name, module.draw(lab.of_section(name, module))))
    return write_page(page, "paper.html.jinja", _content(placed, lab), package="bench.reproduction")


def _content(placed: Sequence[Placed], lab: Lab) -> dict[str, Any]:
    claims = [(item, claim) for item in placed for claim in item.section.claims]
    verdicts = [claim.agrees for _, claim in claims]
    return {
        "placed": placed,
        "claims": claims,
        "counts": {verdict: verdicts.count(verdict) for verdict in ("yes", "partly", "no")},
        "quick": lab.quick,
        "when": datetime.now(UTC).strftime("%Y-%m-%d"),
        "machine": machine(),
        "git": git_state(Path(__file__).parent),
    }
