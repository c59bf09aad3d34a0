"""Numbers of modules without a reason: ``python -m bench.checks.constants [FOLDER ...]`` lists them.

A constant of a module made of numbers needs a word that says why it is what it is: a string right below it,
or a comment in its lines or right above. Tables of named things, such as finishes or metrics, are no numbers.
"""

from __future__ import annotations

import ast
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGES = ("burrscan", "scenes", "bench")


def constants_without_reason(source: str) -> list[tuple[int, str]]:
    """Line and name of every number of a module that nothing is said about, in the order of the lines.

    Parameters
    ----------
    source
        Text of a Python module.

    """
    lines, body = source.splitlines(), ast.parse(source).body
    below = [*body[1:], None]
    found = []
    for statement, following in zip(body, below, strict=True):
        if not isinstance(statement, ast.Assign | ast.AnnAssign) or statement.value is None:
            continue
        if _is_number(statement.value) and not (_is_text(following) or _is_commented(statement, lines)):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            found.append((statement.lineno, ", ".join(ast.unparse(target) for target in targets)))
    return found


def _is_number(value: ast.expr) -> bool:
    """A number written out, or made of some: by operators, a collection, or a function such as ``np.cos``."""
    numbers = [
        node
        for node in ast.walk(value)
        if isinstance(node, ast.Constant) and type(node.value) in {int, float, complex}
    ]
    return bool(numbers) and not _names_things(value)


def _names_things(value: ast.expr) -> bool:
    """Strings that are no keys, and calls of classes: a table of things, which name themselves."""
    keys = {id(key) for node in ast.walk(value) if isinstance(node, ast.Dict) for key in node.keys}
    for node in ast.walk(value):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in keys:
            return True
        if isinstance(node, ast.Subscript) and ast.unparse(node.value).endswith(("Annotated", "tuple")):
            return True
        if isinstance(node, ast.Call) and ast.unparse(node.func).rsplit(".", 1)[-1][:1].isupper():
            return True
    return False


def _is_text(statement: ast.stmt | None) -> bool:
    return (
        isinstance(statement, ast.Expr)
        and isinstance(statement.value, ast.Constant)
        and isinstance(statement.value.value, str)
    )


def _is_commented(statement: ast.stmt, lines: list[str]) -> bool:
    last = statement.end_lineno or statement.lineno
    inside = any("#" in line for line in lines[statement.lineno - 1 : last])
    return inside or (statement.lineno > 1 and lines[statement.lineno - 2].lstrip().startswith("#"))


def main(folders: list[Path]) -> int:
    """Print every constant without a reason; 1 where there is any."""
    count = 0
    for folder in folders:
        for path in sorted(folder.rglob("*.py")):
            for line, name in constants_without_reason(path.read_text("utf-8")):
                print(f"{path}:{line}: {name}")
                count += 1
    return int(count > 0)


if __name__ == "__main__":
    raise SystemExit(main([Path(name) for name in sys.argv[1:]] or [ROOT / package for package in PACKAGES]))
