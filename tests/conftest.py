"""Settings of all tests, the order they run in, and which of them `make test-fast` leaves out.

Order and choice go by the processor time of each file, which `pytest --measure` writes to `seconds.json`.
Whole files, for a file shares its scenes and its compiled kernels.
"""

from __future__ import annotations

import json
import os
from collections import defaultdict
from collections.abc import Generator
from pathlib import Path

import pytest
from hypothesis import settings

from bench.memory import keep_freed

if "PYTEST_XDIST_WORKER" in os.environ:  # every core has a process of its own; read when numpy is loaded
    for _name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(_name, "1")

keep_freed()  # as every command does
settings.register_profile("compiled", deadline=None)  # the first call of a kernel compiles it
settings.load_profile("compiled")


def folder(name: str) -> str:
    """The folder of a test file."""
    return name.rpartition("/")[0]


TABLE = Path(__file__).parent / "seconds.json"
SECONDS: dict[str, float] = json.loads(TABLE.read_text("utf-8"))
"""Test file to the processor time of its tests, kernels compiled; a file that is not in it is a quick one."""
SLOW_S = 1.5
"""Files above it are left out of `make test-fast`, but for the quickest of each folder."""
_QUICKEST = {folder(name): name for name in sorted(SECONDS, key=lambda name: -SECONDS[name])}
SLOW = {name for name, s in SECONDS.items() if s > SLOW_S} - set(_QUICKEST.values())
_STARTED = pytest.StashKey[float]()
_SPENT = "processor_s"
_measured: defaultdict[str, float] = defaultdict(float)


def pytest_addoption(parser: pytest.Parser) -> None:
    """Measuring is asked for: figures of a busy machine, or of kernels not yet compiled, are none to keep."""
    parser.addoption(
        "--measure",
        action="store_true",
        help="write the processor time of each file that runs to tests/seconds.json; run it twice, the first "
        "time compiles",
    )


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark every test of a slow file; and where processes share the files, the longest begin."""
    for item in items:
        if _file(item.nodeid) in SLOW:
            item.add_marker(pytest.mark.slow)
    if hasattr(config, "workerinput"):
        items.sort(key=lambda item: -SECONDS.get(_file(item.nodeid), 0.0))


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, None, None]:
    """Note when a test began."""
    item.stash[_STARTED] = _processor_s()
    return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Tell, at its end, what a test cost: the report also comes back from other processes."""
    report = yield
    if call.when == "teardown":
        report.user_properties.append((_SPENT, _processor_s() - item.stash[_STARTED]))
    return report


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add it up by file."""
    _measured[_file(report.nodeid)] += sum(
        float(str(value)) for name, value in report.user_properties if name == _SPENT
    )


def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Keep what was measured, if all went well."""
    if session.config.option.measure and exitstatus == 0 and not hasattr(session.config, "workerinput"):
        known = {name: s for name, s in SECONDS.items() if (session.config.rootpath / name).exists()}
        measured = known | {name: round(s, 1) for name, s in _measured.items()}
        TABLE.write_text(json.dumps(measured, indent=1, sort_keys=True) + "\n", "utf-8")


def _file(nodeid: str) -> str:
    return nodeid.partition("::")[0]


def _processor_s() -> float:
    """Processor time of this process and of those that it started and waited for."""
    return sum(os.times()[:4])
