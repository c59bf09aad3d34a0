"""Stores: a folder and an address of fsspec behave alike, and light kept there is found again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from burrscan.errors import InputError
from scenes.stores import Store
from scenes.transport.store import stored
from tests.scenes.test_store import transport


@pytest.fixture(params=["folder", "file", "memory"])
def store(request: pytest.FixtureRequest, tmp_path: Path) -> Store:
    addresses = {
        "folder": str(tmp_path / "a folder"),
        "file": f"file://{tmp_path}/b",
        "memory": f"memory://{tmp_path.name}",
    }
    return Store(addresses[request.param])


def test_what_is_written_is_read(store: Store) -> None:
    store.under("a/b").write("c.npz", b"one")
    store.write("a/b/c.npz", b"two")
    assert store.read("a/b/c.npz") == b"two"
    assert store.checked() == store
    with pytest.raises(FileNotFoundError):
        store.read("a/b/d.npz")


def test_light_is_traced_once(store: Store) -> None:
    first = stored(store, "one", lambda: transport(1.0))
    again = stored(store, "one", lambda: transport(2.0))
    np.testing.assert_array_equal(first.ambient, again.ambient)
    assert stored(store, "two", lambda: transport(3.0)).ambient[0, 0] == 3.0


def test_damaged_light_is_traced_again_with_a_line(store: Store, caplog: pytest.LogCaptureFixture) -> None:
    stored(store, "one", lambda: transport(1.0))
    name = next(n for n in [f"transport-{v}-one.npz" for v in range(1, 99)] if _has(store, n))
    store.write(name, b"PK")
    assert stored(store, "one", lambda: transport(2.0)).ambient[0, 0] == 2.0
    assert "traced again" in caplog.text
    assert stored(store, "one", lambda: transport(3.0)).ambient[0, 0] == 2.0


def _has(store: Store, name: str) -> bool:
    try:
        store.read(name)
    except FileNotFoundError:
        return False
    return True


def test_what_is_no_store_is_said_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    for address in ("nothing://here", str(tmp_path / "file")):
        with pytest.raises(InputError, match=f"^{address}: "):
            Store(address).checked()


def test_no_bucket_is_made_for_a_misspelt_address(monkeypatch: pytest.MonkeyPatch) -> None:
    """On S3, to make an object's folders is to make its bucket."""

    def made(*_: object, **__: object) -> None:
        raise AssertionError("folders were made")

    monkeypatch.setattr("fsspec.implementations.memory.MemoryFileSystem.makedirs", made)
    Store("memory://bucket").write("a/b", b"content")
    assert Store("memory://bucket").read("a/b") == b"content"
