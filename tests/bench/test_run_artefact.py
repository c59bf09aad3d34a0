"""Pictures that a run left elsewhere."""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.run.directory import Run, RunDirectory
from burrscan.variants import shipped_only
from scenes.stores import Store
from tests.bench.cluster_lab import small_suite


def test_an_address_that_nobody_vouches_for_is_not_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The run.json of a stranger names a server of theirs: reading the report would tell it who reads."""
    called: list[str] = []

    def read(_: Store, name: str) -> bytes:
        called.append(name)
        return b"picture"

    monkeypatch.setattr(Store, "read", read)
    run = Run(RunDirectory(tmp_path), small_suite(), 0, {"store": "s3://theirs/runs"}, ())
    with shipped_only("run.json"):
        assert not run.artefact("a", "white.png").exists()
    assert called == []
    assert "--trust" in caplog.text
    with shipped_only("run.json", trusted=True):
        assert run.artefact("a", "white.png").read_bytes() == b"picture"
    assert called == ["a/white.png"]
