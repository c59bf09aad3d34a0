"""Building the page: measure what is missing, draw everything, write one self-contained file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import jinja2

from bench.reproduction.lab import Lab
from bench.reproduction.parts import Claim, Section
from bench.reproduction.sections import NAMES, module_of
from bench.run.provenance import git_state, machine
from burrscan.files import written_whole

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
    with written_whole(page) as beside:
        beside.write_text(_rendered(placed, lab), "utf-8")
    return page


def _rendered(placed: Sequence[Placed], lab: Lab) -> str:
    claims = [(item, claim) for item in placed for claim in item.section.claims]
    return _template().render(
        placed=placed,
        claims=claims,
        counts={verdict: _count(claims, verdict) for verdict in ("yes", "partly", "no")},
        quick=lab.quick,
        when=datetime.now(UTC).strftime("%Y-%m-%d"),
        machine=machine(),
        git=git_state(Path(__file__).parent),
    )


def _count(claims: Sequence[tuple[Placed, Claim]], verdict: str) -> int:
    return sum(claim.agrees == verdict for _, claim in claims)


def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader(
            [jinja2.PackageLoader("bench.reproduction"), jinja2.PackageLoader("bench.plotting")]
        ),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("paper.html.jinja")
