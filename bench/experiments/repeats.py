"""Real A/A records: every case of a suite scanned four times under the same light with other noise.

They tell how much a metric varies from scene to scene and from one look to the next, which is what the other
experiments draw their records from. Writes ``repeats.csv`` beside this file:

    python -m bench.experiments.repeats [SUITE [VARIANT]]

One process; about six minutes for ``quick``.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from bench.score.burrs import burr_tables
from bench.score.evidence import Evidence
from bench.score.metrics import METRICS, measure
from bench.suites.case import Case
from bench.suites.cases import expand
from bench.suites.catalogue import load_suite
from bench.suites.identity import content_hash, entropy
from bench.suites.suite import Suite, Variant
from bench.suites.variants import pipeline_of
from burrscan.files import written_whole
from burrscan.pipeline import run
from scenes.scene import scene_from
from scenes.simulate import Simulation, simulate

REPEATS = Path(__file__).with_name("repeats.csv")
"""What :func:`main` writes: one row per scene, seed and look; ``found`` has a 1 or 0 for each true burr."""

LOOKS = 4
"""Scans of each case: six pairs of like with like."""


def main() -> None:
    """Scan, and write the table."""
    suite = load_suite(sys.argv[1] if len(sys.argv) > 1 else "quick")
    name = sys.argv[2] if len(sys.argv) > 2 else "adaptive"
    variant = next(variant for variant in suite.variant if variant.name == name)
    rows = list(_rows(suite, variant))
    with written_whole(REPEATS) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["scene", "seed", "look", "found", *METRICS])
        writer.writerows(rows)


def _rows(suite: Suite, variant: Variant) -> Iterator[list[str]]:
    for case in expand(suite):
        print(case.id, flush=True)
        simulation = simulate(scene_from(case.document, source=case.id))
        for look in range(LOOKS):
            identity = entropy(content_hash({"case": case.identity, "repeat": look}))
            yield _row(case, variant, look, replace(simulation, identity=identity))


def _row(case: Case, variant: Variant, look: int, simulation: Simulation) -> list[str]:
    scene = ",".join(f"{key}={value}" for key, value in case.parameters.items() if key != "seed")
    evidence = Evidence(simulation.truth, run(simulation.scanner(), pipeline_of(variant)))
    found = "".join(str(int(burr["found"])) for burr in burr_tables(evidence))
    cells = [f"{value:.6g}" if math.isfinite(value) else "" for value in measure(evidence).values()]
    return [scene, str(case.seed), str(look), found, *cells]


if __name__ == "__main__":
    main()
