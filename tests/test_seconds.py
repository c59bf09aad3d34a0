"""`make test-fast` leaves files out by measured time, takes less than a minute, and reaches every package."""

from __future__ import annotations

from pathlib import Path

from tests.conftest import SECONDS, SLOW, folder

HERE = Path(__file__).parent
FILES = {path.relative_to(HERE.parent).as_posix() for path in HERE.rglob("test_*.py")}


def test_the_table_names_files_that_are_there() -> None:
    gone = set(SECONDS) - FILES
    assert not gone, "take them out of tests/seconds.json, or run `pytest --measure`"


def test_most_files_were_measured() -> None:
    new = FILES - set(SECONDS)
    assert len(new) < 0.1 * len(FILES), f"run `pytest --measure {' '.join(sorted(new))}` twice"


def test_the_fast_files_take_less_than_a_minute_on_two_cores() -> None:
    """Twice 60 s of processor time, less some 10 s that each process takes to import what it tests."""
    assert sum(seconds for name, seconds in SECONDS.items() if name not in SLOW) < 2.0 * (60.0 - 10.0)


def test_every_folder_of_tests_has_a_fast_file() -> None:
    assert {folder(name) for name in FILES} == {folder(name) for name in FILES - SLOW}
