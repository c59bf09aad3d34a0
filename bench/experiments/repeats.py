"""Real A/A records: every case of a suite scanned twice under the same light with other noise.

They tell how much a metric varies from scene to scene, from seed to seed and from one look to the next,
which is what the other experiments draw their records from. Writes ``repeats.csv`` beside this file:

    python -m bench.experiments.repeats [SUITE]

One process; about 15 minutes for ``quick``.
"""

from __future__ import annotations

import csv
import math
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

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
"""What :func:`main` writes: one row per scene, seed, variant and repeat."""


def main() -> None:
    """Scan, and write the table."""
    suite = load_suite(sys.argv[1] if len(sys.argv) > 1 else "quick")
    rows = list(_rows(suite))
    with written_whole(REPEATS) as beside, beside.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["scene", "seed", "variant", "repeat", *METRICS])
        writer.writerows(rows)


def _rows(suite: Suite) -> Iterator[list[str]]:
    for case in expand(suite):
        print(case.id, flush=True)
        simulation = simulate(scene_from(case.document, source=case.id))
        for repeat in range(2):
            noisy = replace(
                simulation, identity=entropy(content_hash({"case": case.identity, "repeat": repeat}))
            )
            yield from (_row(case, variant, repeat, noisy) for variant in suite.variant)


def _row(case: Case, variant: Variant, repeat: int, simulation: Simulation) -> list[str]:
    scene = ",".join(f"{key}={value}" for key, value in case.parameters.items() if key != "seed")
    outcome = run(simulation.scanner(), pipeline_of(variant))
    values = measure(Evidence(simulation.truth, outcome))
    cells = [f"{value:.6g}" if math.isfinite(value) else "" for value in values.values()]
    return [scene, str(case.seed), variant.name, str(repeat), *cells]


if __name__ == "__main__":
    main()
