"""What a section's numbers depend on of the page's own code."""

from __future__ import annotations

import re
from pathlib import Path

_IMPORT = re.compile(r"^from bench\.reproduction(?:\.(\w+))? import (\w+)", re.MULTILINE)


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
