"""Settings of all tests, and which of them `make test-fast` leaves out.

Whole files, for a file shares its scenes and its compiled kernels.
"""

from __future__ import annotations

import pytest
from hypothesis import settings

settings.register_profile("compiled", deadline=None)  # the first call of a kernel compiles it
settings.load_profile("compiled")

SLOW = ()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark every test of a slow file."""
    for item in items:
        if item.path.stem in SLOW:
            item.add_marker(pytest.mark.slow)
