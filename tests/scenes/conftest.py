"""What tests of the renderer share."""

from __future__ import annotations

from typing import Any

import pytest

from scenes.renderer import activate


@pytest.fixture(scope="module")
def mi() -> Any:
    """Mitsuba in a vectorised variant; where there is none, the test is skipped."""
    module = activate()
    if module.variant().startswith("scalar"):
        pytest.skip("no vectorised Mitsuba variant on this machine; see 'burrscan doctor'")
    return module
