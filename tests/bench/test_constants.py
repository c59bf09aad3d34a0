"""Every number of a module has a word that says why it is what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.checks.constants import PACKAGES, ROOT, constants_without_reason, main


@pytest.mark.parametrize("package", PACKAGES)
def test_every_number_of_a_module_has_a_reason(package: str) -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {name}"
        for path in sorted((ROOT / package).rglob("*.py"))
        for line, name in constants_without_reason(path.read_text("utf-8"))
    ]
    assert not found, "say in a string right below what the number guards:\n" + "\n".join(found)


@pytest.mark.parametrize(
    "source",
    [
        "_FEW = 5\n",
        "_FEW: int = 5\n",
        "_A, _B = 1.0, -2.0\n",
        "_COS = np.cos(np.radians(20.0))\n",
        "_TABLE = {'mm': 0.05}\n",
        "_FEW = 5\n\n_MANY = 50\n'''What both are.'''\n",
        "_FEW = 5\n\n\ndef few():\n    '''No word of the constant's.'''\n",
    ],
)
def test_a_bare_number_is_found(source: str) -> None:
    (line, name), *more = constants_without_reason(source)
    assert (line, name.strip("()")[:2] in {"_F", "_A", "_C", "_T"}, more) == (1, True, [])


@pytest.mark.parametrize(
    "source",
    [
        "_FEW = 5\n'''Why.'''\n",
        "_FEW = 5  # why\n",
        "# why\n_FEW = 5\n",
        "_NAME = 'five'\n",
        "_ON = True\n",
        "Share = Annotated[float, Field(ge=0.0)]\n",
        "SHAPES = {'drum': Wheel(5.0)}\n",
        "def few():\n    number = 5\n    return number\n",
    ],
)
def test_what_has_a_word_or_is_no_number_is_left_alone(source: str) -> None:
    assert constants_without_reason(source) == []


def test_the_command_prints_place_and_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bare.py").write_text("'''A module.'''\n\n_FEW = 5\n", "utf-8")
    assert main([tmp_path]) == 1
    assert capsys.readouterr().out == f"{tmp_path / 'bare.py'}:3: _FEW\n"
    (tmp_path / "bare.py").write_text("'''A module.'''\n\n_FEW = 5\n'''Why.'''\n", "utf-8")
    assert main([tmp_path]) == 0
