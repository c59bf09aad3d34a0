"""What stands for the state of the code, so that what other code measured is never taken for this code's."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

_IMPORT = re.compile(r"^from bench\.reproduction(?:\.(\w+))? import (\w+)", re.MULTILINE)


def sources(*packages: Path) -> str:
    """A hash of every source of packages, given by the paths of their ``__init__.py``."""
    total = hashlib.sha256()
    for package in packages:
        for path in sorted(package.parent.rglob("*.py")) + sorted(package.parent.rglob("*.toml")):
            total.update(path.read_bytes())
    return total.hexdigest()[:12]


def source_of(section: Path) -> str:
    """The text of a section's file and of the files beside it that it imports, and that these import."""
    texts: dict[str, str] = {}
    todo = [section.stem]
    while todo:
        name = todo.pop()
        if name not in texts:
            texts[name] = section.with_name(f"{name}.py").read_text("utf-8")
            todo += [module or imported for module, imported in _IMPORT.findall(texts[name])]
    return "".join(texts[name] for name in sorted(texts))
