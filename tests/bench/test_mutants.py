"""Planted faults: which there are, that each is one, and which of them a test sees."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from bench.checks.mutants import CORE, ROOT, mutants_of, trials


@pytest.mark.parametrize(
    ("source", "after"),
    [
        ("a = b + c", {"b - c"}),
        ("a = b / c", {"b * c"}),
        ("a = b ** c", {"b * c"}),
        ("a = b < c", {"b >= c"}),
        ("a = abs(b)", {"b"}),
        ("a = np.clip(b, c, d)", {"b"}),
        ("a = np.minimum(b, c)", {"np.maximum(b, c)"}),
        ("a = max(b, c)", {"min(b, c)"}),
        ("a = 2.0", {"1.4", "2.6"}),
        ("a: Field[0.5] = b[2.0]", set()),
        ("raise ValueError(f'{a + b}')", set()),
        ("'''A text.'''", set()),
    ],
)
def test_the_faults_of_a_statement(source: str, after: set[str]) -> None:
    assert {mutant.after for mutant in mutants_of(source)} == after


def test_a_fault_changes_its_own_expression_alone() -> None:
    start = "def f(a, b):\n    # μ: more bytes than characters\n    return 'σ', "
    source = f"{start}(a - b) * (\n        c + d\n    )\n"
    for mutant in mutants_of(source):
        assert ast.dump(ast.parse(mutant.source)) != ast.dump(ast.parse(source))
        mended = mutant.source.replace(f"({mutant.after})", f"({mutant.before})")
        assert ast.dump(ast.parse(mended)) == ast.dump(ast.parse(source))
        assert mutant.source.startswith(start)
    assert [(mutant.line, mutant.after) for mutant in mutants_of(source)] == [
        (3, "(a - b) / (c + d)"), (3, "a + b"), (4, "c - d"),
    ]  # fmt: skip


@pytest.mark.study
def test_a_fault_that_a_test_sees_is_told_from_one_that_none_sees(tmp_path: Path) -> None:
    """Those that only a slow test sees, in a folder where all are slow, too."""
    for name, mark in (("quick", ""), ("thorough", "@pytest.mark.slow\n")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text("")
        unseen = "\n\ndef unseen(a, b):\n    return a - b\n" if name == "quick" else ""
        (tmp_path / name / "sums.py").write_text(f"def seen(a, b):\n    return a + b\n{unseen}")
        (tmp_path / "tests" / name).mkdir(parents=True)
        (tmp_path / "tests" / name / f"test_{name}.py").write_text(
            f"import pytest\n\nfrom {name}.sums import seen\n\n\n"
            f"{mark}def test_seen():\n    assert seen(2, 1) == 3\n"
        )
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers = slow\n")
    core = {name: f"tests/{name}/test_*.py" for name in ("quick", "thorough")}
    told = {
        (trial.path, trial.mutant.line): trial.outcome
        for trial in trials(tmp_path, core, count=9, seed=0, limit_s=60.0)
    }
    assert told == {
        ("quick/sums.py", 2): "killed",
        ("quick/sums.py", 6): "survived",
        ("thorough/sums.py", 2): "killed",
    }
    assert "a + b" in (tmp_path / "quick/sums.py").read_text()


def test_tests_that_fail_anyway_tell_nothing(tmp_path: Path) -> None:
    (tmp_path / "core").mkdir()
    (tmp_path / "core/one.py").write_text("ONE = 1.0\n")
    (tmp_path / "test_one.py").write_text("def test_one():\n    assert False\n")
    with pytest.raises(RuntimeError, match="without any fault"):
        list(trials(tmp_path, {"core": "test_*.py"}, count=1, seed=0, limit_s=60.0))


def test_every_folder_of_the_core_has_tests() -> None:
    for folder, tests in CORE.items():
        assert any((ROOT / folder).rglob("*.py")), folder
        above, _, pattern = tests.rpartition("/")
        assert any((ROOT / above).glob(pattern)), tests
