"""Pictures that workers leave in a store are not in the driver's folder, and a report finds them."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

from bench.cluster.parcel import work
from bench.run.crew import Obstructed
from bench.run.directory import load_run
from bench.run.job import Job
from bench.run.runner import run_suite
from bench.suites.cases import expand
from tests.bench.cluster_lab import FAKES, small_suite
from tests.tiers import some_of


@pytest.fixture(scope="module")
def fakes(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ModuleType]:
    folder = tmp_path_factory.mktemp("fakes")
    name = f"store_fakes_{os.getpid()}"
    (folder / f"{name}.py").write_text(FAKES)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(folder)
        yield __import__(name)


@some_of("scheme", ["folder", "memory"])
def test_pictures_stay_in_the_store_until_they_are_looked_at(
    scheme: str, fakes: ModuleType, tmp_path: Path
) -> None:
    suite, address = small_suite(2), {"folder": str(tmp_path / "s"), "memory": f"memory://{tmp_path.name}"}
    cases = expand(suite)
    job = Job(suite.variant, tmp_path / "nowhere", kept_at=address[scheme])
    parcels = [work(job, fakes.good, case) for case in cases]
    assert not any(parcel.files for parcel in parcels)
    assert not (tmp_path / "nowhere").exists()
    out = run_suite(suite, tmp_path / "r", workers=1, examine_case=fakes.good)
    manifest = json.loads((out / "run.json").read_text())
    (out / "run.json").write_text(json.dumps({**manifest, "store": address[scheme]}))
    run = load_run(out)
    for case in cases:
        path = run.directory.case(case.id) / "truth.npz"
        before = path.read_bytes()
        path.unlink()
        assert run.artefact(case.id, "truth.npz").read_bytes() == before
    assert not run.artefact(cases[0].id, "never.npz").exists()


def test_without_a_store_pictures_come_back(fakes: ModuleType, tmp_path: Path) -> None:
    suite = small_suite(1)
    (case,) = expand(suite)
    parcel = work(Job(suite.variant, tmp_path), fakes.good, case)
    parcel.unpack(tmp_path / "c")
    assert (tmp_path / "c" / "truth.npz").read_bytes() == case.identity.encode()


def test_a_store_that_takes_nothing_is_the_machines_fault(fakes: ModuleType, tmp_path: Path) -> None:
    suite = small_suite(1)
    (tmp_path / "file").touch()
    with pytest.raises(Obstructed, match="file"):
        work(Job(suite.variant, tmp_path, kept_at=str(tmp_path / "file")), fakes.good, expand(suite)[0])
