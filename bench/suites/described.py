"""A suite in words."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

from bench.suites.cases import label
from bench.suites.design import Draw
from bench.suites.suite import Suite


def described(suite: Suite) -> Iterator[str]:
    """A suite line by line: what is varied, and what looks at it."""
    yield f"{suite.name}: {suite.title}\n"
    if suite.description:
        yield suite.description.strip() + "\n"
    for name, paths in suite.condition.items():
        told = ", ".join(f"{path} = {value}" for path, value in paths.items())
        yield f"  condition  {name}: {told or 'as the scene has it'}"
    for path, values in suite.sweep.items():
        yield f"  sweep      {path} = {', '.join(str(label(value)) for value in values)}"
    if suite.random:
        yield f"  random     {suite.random.points} points of a {suite.random.method} design"
        yield from (f"             {path} {_drawn(draw)}" for path, draw in suite.random.draw.items())
    for path, (low, high) in suite.jitter.items():
        yield f"  jitter     {path} between {low:g} and {high:g}"
    yield f"  seeds      {', '.join(str(seed) for seed in suite.seeds)}"
    for variant in suite.variant:
        stages = ", ".join(f"{stage} = {choice}" for stage, choice in variant.stages.items())
        yield f"  variant    {variant.name}: {stages or 'every stage as usual'}"


def _drawn(draw: Draw) -> str:
    if not draw.choices:
        return str(draw)
    counts = Counter(label(choice) for choice in draw.choices)
    return "one of " + ", ".join(f"{name}{f' ({n} times)' if n > 1 else ''}" for name, n in counts.items())
