"""Tests on trial: ``python -m bench.checks.mutants --count 5`` plants faults and says which are noticed.

A fault is an operator, a comparison, a constant (by 30 %), a lost ``abs`` or ``clip``, or a swapped minimum
somewhere in the numerical core. Each is planted in a temporary copy of the tree, and only the tests of its
module's folder are run there. A survivor is a line that no test sees, or a fault that makes no difference.
"""

from __future__ import annotations

import argparse
import ast
import copy
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

ROOT = Path(__file__).parents[2]
CORE: Mapping[str, str] = {
    **{
        f"burrscan/{stage}": f"tests/burrscan/{stage}"
        for stage in ("axis", "generatrix", "burrs", "scan", "codes")
    },
    "bench/score": "tests/bench/test_score_*.py",
    "bench/statistics": "tests/bench/test_compare_*.py",
    "bench/compare": "tests/bench/test_compare_*.py",
}
"""Folder of the core to the tests that are to see faults in it."""
_NO_TESTS = 5
"""Exit code of pytest where it was left nothing to run."""

_OPERATORS: Mapping[type[ast.operator], type[ast.operator]] = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Pow: ast.Mult,
}  # fmt: skip
_COMPARISONS: Mapping[type[ast.cmpop], type[ast.cmpop]] = {
    ast.Lt: ast.GtE, ast.LtE: ast.Gt, ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
}  # fmt: skip
_SWAPPED = {
    "min": "max",
    "max": "min",
    "minimum": "maximum",
    "maximum": "minimum",
    "fmin": "fmax",
    "fmax": "fmin",
}
_DROPPED = {"abs", "clip"}
_FACTORS = (0.7, 1.3)
"""On a constant: less passes for a choice of taste, more is noticed by anything."""


@dataclass(frozen=True)
class Mutant:
    """A planted fault: the line, the expression before and after, and the whole source with it."""

    line: int
    before: str
    after: str
    source: str


@dataclass(frozen=True)
class Trial:
    """What became of a mutant: ``killed``, ``survived`` or ``timed out``, which is noticed, too."""

    path: str
    mutant: Mutant
    outcome: str


def mutants_of(source: str) -> list[Mutant]:
    """Every fault that can be planted in a module, in the order of its lines.

    Annotations, decorators, messages of exceptions and indices are left alone.
    """
    encoded = source.encode()
    starts = [0]
    for line in encoded.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    found = []
    for node in _expressions(ast.parse(source)):
        first = starts[node.lineno - 1] + node.col_offset
        last = starts[(node.end_lineno or node.lineno) - 1] + (node.end_col_offset or 0)
        for changed in _changes(node):
            after = ast.unparse(changed)
            whole = encoded[:first] + f"({after})".encode() + encoded[last:]
            found.append(Mutant(node.lineno, ast.unparse(node), after, whole.decode()))
    return sorted(found, key=lambda mutant: mutant.line)


def _expressions(node: ast.AST) -> Iterator[ast.expr]:
    if isinstance(node, ast.expr):
        yield node
    for name, value in ast.iter_fields(node):
        if name in {"annotation", "returns", "decorator_list", "slice"} or isinstance(
            node, ast.Raise | ast.JoinedStr
        ):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST):
                yield from _expressions(child)


def _changes(node: ast.expr) -> Iterator[ast.expr]:
    changed = copy.deepcopy(node)
    if isinstance(changed, ast.BinOp) and type(changed.op) in _OPERATORS:
        changed.op = _OPERATORS[type(changed.op)]()
        yield changed
    elif isinstance(changed, ast.Compare) and type(changed.ops[0]) in _COMPARISONS:
        changed.ops[0] = _COMPARISONS[type(changed.ops[0])]()
        yield changed
    elif isinstance(changed, ast.Constant) and type(changed.value) is float and changed.value != 0.0:
        yield from (ast.Constant(changed.value * factor) for factor in _FACTORS)
    elif isinstance(changed, ast.Call) and changed.args:
        yield from _calls(changed)


def _calls(call: ast.Call) -> Iterator[ast.expr]:
    name = ast.unparse(call.func).rsplit(".", 1)[-1]
    if name in _DROPPED:
        yield call.args[0]
    elif name in _SWAPPED and isinstance(call.func, ast.Name):
        call.func.id = _SWAPPED[name]
        yield call
    elif name in _SWAPPED and isinstance(call.func, ast.Attribute):
        call.func.attr = _SWAPPED[name]
        yield call


def trials(root: Path, core: Mapping[str, str], *, count: int, seed: int, limit_s: float) -> Iterator[Trial]:
    """Plant ``count`` faults of the core, drawn by ``seed``, one at a time.

    Raises
    ------
    RuntimeError
        When tests fail without any fault: then they tell nothing.

    """
    sites = [
        (path.relative_to(root).as_posix(), tests, mutant)
        for folder, tests in core.items()
        for path in sorted((root / folder).rglob("*.py"))
        for mutant in mutants_of(path.read_text("utf-8"))
    ]
    drawn = random.Random(seed).sample(sites, min(count, len(sites)))  # noqa: S311 (no secret)
    with tempfile.TemporaryDirectory() as room:
        tree = Path(room) / "tree"
        shutil.copytree(root, tree, ignore=shutil.ignore_patterns(".*", "__pycache__", "runs", "site"))
        run = partial(_outcome, tree, limit_s=limit_s)
        for tests in dict.fromkeys(tests for _, tests, _ in drawn):
            if run(tests) != "survived":
                raise RuntimeError(f"{tests}: fails, or takes more than {limit_s:g} s, without any fault")
        for path, tests, mutant in drawn:
            right = (tree / path).read_text("utf-8")
            (tree / path).write_text(mutant.source, "utf-8")
            yield Trial(path, mutant, run(tests))
            (tree / path).write_text(right, "utf-8")


def _outcome(tree: Path, tests: str, *, limit_s: float) -> str:
    """Run tests in a tree. Kernels are compiled anew, for numba does not see that a callee has changed."""
    folder, _, pattern = tests.rpartition("/")
    chosen = sorted(str(path) for path in (tree / folder).glob(pattern))
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", "-m", "", *chosen]
    with tempfile.TemporaryDirectory() as cache:
        room = {"PYTHONPATH": str(tree), "NUMBA_CACHE_DIR": cache, "PYTHONDONTWRITEBYTECODE": "1"}
        run = partial(
            subprocess.run, cwd=tree, env=os.environ | room, capture_output=True, timeout=limit_s, check=False
        )
        try:
            done = run([*command, "-m", "not slow"])
            if done.returncode == _NO_TESTS:  # all of them are slow
                done = run(command)
        except subprocess.TimeoutExpired:
            return "timed out"
    return "survived" if done.returncode == 0 else "killed"


def main() -> None:
    """Print each fault and what became of it."""
    parser = argparse.ArgumentParser(prog="python -m bench.checks.mutants", description=__doc__)
    parser.add_argument("--count", type=int, default=5, help="faults (default: 5)")
    parser.add_argument("--seed", type=int, default=0, help="which faults are drawn (default: 0)")
    parser.add_argument(
        "--limit", type=float, default=600.0, help="seconds a fault's tests may take (default: 600)"
    )
    parser.add_argument("--in", dest="only", choices=sorted(CORE), help="of this folder alone")
    given = parser.parse_args()
    core = {given.only: CORE[given.only]} if given.only else CORE
    outcomes = []
    for trial in trials(ROOT, core, count=given.count, seed=given.seed, limit_s=given.limit):
        outcomes.append(trial.outcome)
        fault = trial.mutant
        print(f"{trial.outcome:9} {trial.path}:{fault.line}: {fault.before} -> {fault.after}", flush=True)
    print(f"{len(outcomes) - outcomes.count('survived')} of {len(outcomes)} noticed")


if __name__ == "__main__":
    main()
