"""Whether freed memory stays with the process."""

from __future__ import annotations

import subprocess
import sys

import pytest

_STAYS = """
from pathlib import Path
import numpy as np
from bench.memory import keep_freed

def held():
    return int(Path("/proc/self/statm").read_text().split()[1]) * 4096

{first}
before = held()
np.ones((4_000_000, 3))
print(held() - before)
"""


def _stays(first: str) -> int:
    """Bytes that the process still holds of an array of 96 MB that is gone."""
    done = subprocess.run(  # noqa: S603 (our own Python)
        [sys.executable, "-c", _STAYS.format(first=first)], capture_output=True, text=True, check=True
    )
    return int(done.stdout)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only glibc has the setting")
def test_an_array_s_memory_stays_for_the_next_one() -> None:
    assert _stays("") < 20e6
    assert _stays("keep_freed()") > 90e6
