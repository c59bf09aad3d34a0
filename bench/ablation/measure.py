"""A case seen by the default pipeline, and by it without each of its steps."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path

from bench.ablation.steps import Step
from bench.score.burrs import burr_tables
from bench.score.evidence import Evidence
from bench.score.metrics import failed_metrics, measure
from bench.suites.case import Case
from bench.suites.identity import entropy
from burrscan.documents import json_text
from burrscan.errors import InputError
from burrscan.files import write_text
from burrscan.pipeline import Outcome, Pipeline, inspect_surface, run
from burrscan.sight import sight_of
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate

WHOLE = ""
"""Name of the pipeline with all its steps."""


@dataclass(frozen=True)
class Seen:
    """What was made of a case without a step: metrics, and which of its true burrs were found."""

    case: str
    step: str
    metrics: dict[str, float]
    found: tuple[bool, ...]


def measured(
    cases: Iterable[Case], steps: Sequence[Step], kept: Path, *, progress: Callable[[str], None]
) -> list[Seen]:
    """Every case with the whole pipeline and without each step; those that ``kept`` holds are not run again.

    The file is written anew after every case. O(cases · steps) inspections, and a scan for each step of it.

    Raises
    ------
    InputError
        When ``kept`` holds something else.

    """
    seen = _kept(kept)
    done = {(one.case, one.step) for one in seen}
    for case in cases:
        wanted = [step for step in steps if (case.id, step.name) not in done]
        if wanted or (case.id, WHOLE) not in done:
            progress(case.id)
            seen += [one for one in _case(case, wanted) if (one.case, one.step) not in done]
            write_text(kept, json_text([asdict(one) for one in seen]))
    return seen


def _case(case: Case, steps: Sequence[Step]) -> list[Seen]:
    simulation = simulate(scene_from(case.document, source=case.id), identity=entropy(case.identity))
    whole = run(simulation.scanner(), Pipeline())
    found = [_seen(case, WHOLE, simulation, whole)]
    for step in steps:
        try:
            with step.left_out():
                found.append(_seen(case, step.name, simulation, _without(step, simulation, whole)))
        except (InputError, ValueError, ArithmeticError, IndexError):  # the next stage may need the step
            missed = tuple(False for _ in simulation.truth.wheel.burrs)
            found.append(Seen(case.id, step.name, failed_metrics(), missed))
    return found


def _without(step: Step, simulation: Simulation, whole: Outcome) -> Outcome:
    """The outcome from the step's stage on; what comes before it is as it was."""
    if step.stage == "scan":
        return run(simulation.scanner(), Pipeline())
    surface = whole.surface
    sight = sight_of(whole.scan.radiance, surface, simulation.truth.rig)
    inspection = inspect_surface(
        surface.vertices_mm, surface.faces, Pipeline(), sigma_mm=surface.vertex_sigma_mm, sight=sight
    )
    return replace(whole, inspection=inspection)


def _seen(case: Case, step: str, simulation: Simulation, outcome: Outcome) -> Seen:
    evidence = Evidence(simulation.truth, outcome)
    return Seen(case.id, step, measure(evidence), tuple(bool(one["found"]) for one in burr_tables(evidence)))


def _kept(path: Path) -> list[Seen]:
    if not path.exists():
        return []
    try:
        return [
            Seen(
                one["case"],
                one["step"],
                {name: math.nan if value is None else value for name, value in one["metrics"].items()},
                tuple(one["found"]),
            )
            for one in json.loads(path.read_text("utf-8"))
        ]
    except (ValueError, TypeError, KeyError) as error:
        raise InputError(f"{path} holds no ablation: name another file, or remove it") from error
