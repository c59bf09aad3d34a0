"""Random numbers of the stages come from the case."""

from __future__ import annotations

from bench.run.draws import seeded
from burrscan.pipeline import Pipeline, Stage

SEED = Pipeline(scan=Stage("seed"), axis=Stage("seed"), generatrix=Stage("radius"), burrs=Stage("seed"))


def test_stages_draw_from_the_case_and_from_streams_of_their_own() -> None:
    one, again, other = (seeded(SEED, digits * 64) for digits in ("1", "1", "2"))
    drawn = [one.axis.parameters["seed"], one.burrs.parameters["seed"], other.axis.parameters["seed"]]
    assert one == again
    assert len(set(drawn)) == 3
    assert "seed" not in one.scan.parameters
    assert "seed" not in one.generatrix.parameters


def test_a_seed_that_was_given_stays() -> None:
    given = Pipeline(axis=Stage("seed", {"seed": 5, "planes": 12}))
    assert seeded(given, "3" * 64).axis == given.axis
