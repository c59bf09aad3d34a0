"""A hook of MkDocs: pages include files of the repository, whole or by section: each text stands once.

``<!-- include FILE -->`` takes a file without its title, ``<!-- include FILE # HEADING -->`` the section
under that heading. Links are turned to the page that includes their target; a file without a page is named.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
_INCLUDE = re.compile(r"^<!-- include (\S+)(?: # (.+?))? -->$", re.MULTILINE)
_LINK = re.compile(r"\[([^\]\n]*)\]\((?!https?:|#)([^)#\s]+)(#[^)]*)?\)")
_FENCE = re.compile(r"^```.*?^```[^\n]*$", re.MULTILINE | re.DOTALL)
PAGES = {
    "CHANGELOG.md": "changelog.md",
    "CONTRIBUTING.md": "contributing.md",
    "bench/compare/README.md": "methods/compare.md",
    "bench/detection/README.md": "methods/detection.md",
    "bench/suites/README.md": "formats/suites.md",
    "burrscan/calibration/README.md": "methods/calibration.md",
    "burrscan/registration/README.md": "methods/registration.md",
    "burrscan/captures/README.md": "formats/captures.md",
    "burrscan/colour/README.md": "methods/colour.md",
    "scenes/README.md": "formats/scenes.md",
    "scenes/wheel/README.md": "formats/wheels.md",
}
"""File to the page that includes it."""


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Fill in what a page includes."""
    here = posixpath.dirname(page.file.src_uri)
    return _INCLUDE.sub(lambda found: included(found[1], found[2], here), markdown)


def included(name: str, heading: str | None, here: str) -> str:
    """Text of a file or of one of its sections, for a page in folder ``here`` of the site."""
    text = (ROOT / name).read_text("utf-8")
    part = section(text, heading, name) if heading else re.sub(r"\A# .*\n", "", text)
    return _LINK.sub(lambda link: _turned(link, name, here), part)


def section(text: str, heading: str, name: str) -> str:
    """What stands under a heading, down to the next of its level or above; headings in code are none."""
    bare = _FENCE.sub(lambda code: re.sub(r"[^\n]", " ", code[0]), text)
    start = re.search(rf"^(#+) {re.escape(heading)}\n", bare, re.MULTILINE)
    if not start:
        msg = f"{name} has no heading {heading!r}"
        raise ValueError(msg)
    end = re.search(rf"^#{{1,{len(start[1])}}} ", bare[start.end() :], re.MULTILINE)
    return text[start.end() : start.end() + end.start() if end else None]


def _turned(link: re.Match[str], name: str, here: str) -> str:
    """A link of an included file, as it leads from a page in folder ``here``."""
    path = posixpath.normpath(posixpath.join(posixpath.dirname(name), link[2]))
    target = PAGES.get(path) or (path.removeprefix("docs/") if path.startswith("docs/") else None)
    if target:
        return f"[{link[1]}]({posixpath.relpath(target, here or '.')}{link[3] or ''})"
    return f"{link[1]} (`{path}`)" if link[1] != path else f"`{path}`"
