"""Pages: each one self-contained file, of a package's template and the style that all pages share."""

from __future__ import annotations

import base64
import zlib
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from burrscan.documents import printable
from burrscan.files import write_text


def write_page(page: Path, template: str, content: Mapping[str, Any], *, package: str) -> Path:
    """Write a template of a package, filled in, and say where."""
    write_text(page, _environment(package).get_template(template).render(content))
    return page


def packed(data: bytes) -> str:
    """What a page unpacks when it is asked for (``page.js``, ``solid.js``)."""
    return base64.b64encode(zlib.compress(data, 9)).decode("ascii")


@cache
def _environment(package: str) -> jinja2.Environment:
    environment = jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(package), jinja2.PackageLoader("bench.plotting")]),
        autoescape=True,
        finalize=_shown,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["packed"] = lambda words: packed(words.encode("utf-8", "backslashreplace"))
    return environment


def _shown(value: Any) -> Any:
    """What a page shows of a value: no control characters, which no HTML may hold."""
    return printable(value) if type(value) is str else value
