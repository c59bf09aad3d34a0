"""The documentation site and the data of the tests, as far as no site has to be built for it."""

from __future__ import annotations

import re
import runpy
from pathlib import Path

import pytest

from tests.data import AXES, HERE

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs").rglob("*.md"))
MIB = 1 << 20


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT / "docs").as_posix())
def test_pages_include_and_link_to_what_is_there(page: Path) -> None:
    hook = runpy.run_path(str(ROOT / ".ci" / "docs.py"))
    folder = page.parent.relative_to(ROOT / "docs").as_posix()
    text = page.read_text("utf-8")
    for name, heading in re.findall(r"^<!-- include (\S+)(?: # (.+?))? -->$", text, re.MULTILINE):
        text += hook["included"](name, heading, "" if folder == "." else folder)
    links = re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", text)
    assert [link for link in links if not (page.parent / link).exists()] == []


def test_every_page_stands_in_the_navigation() -> None:
    site = (ROOT / "mkdocs.yml").read_text("utf-8")
    there = sorted(page.relative_to(ROOT / "docs").as_posix() for page in PAGES)
    assert sorted(re.findall(r": (\S+\.md)$", site, re.MULTILINE)) == there


def test_every_module_of_the_api_page_exists() -> None:
    text = "".join(page.read_text("utf-8") for page in PAGES)
    for name in re.findall(r"^::: (\S+)", text, re.MULTILINE):
        path = ROOT.joinpath(*name.split("."))
        assert path.is_dir() or path.with_suffix(".py").exists() or path.parent.with_suffix(".py").exists()


def test_a_section_ends_where_the_next_begins() -> None:
    section = runpy.run_path(str(ROOT / ".ci" / "docs.py"))["section"]
    text = "# A\n\n## B\n\n```sh\n## no heading\n```\n\n### C\n\n## D\n\nend\n"
    assert section(text, "B", "x").strip() == "```sh\n## no heading\n```\n\n### C"
    assert section(text, "D", "x").strip() == "end"
    with pytest.raises(ValueError, match="x has no heading 'no heading'"):
        section(text, "no heading", "x")


def test_the_data_are_small_and_say_where_they_are_from() -> None:
    files = [path for path in HERE.rglob("*") if path.is_file() and "__pycache__" not in path.parts]
    assert max(path.stat().st_size for path in files) < 2 * MIB
    assert sum(path.stat().st_size for path in files) < 4 * MIB
    told = (HERE / "README.md").read_text("utf-8")
    assert all(name in told for name in AXES)
    licences = re.findall(r"\]\((\S+)\)", told)
    assert len(licences) >= 6
    assert all((HERE / name).exists() for name in licences)
