"""The store of traced light against damage: what cannot be used is made again, and never used."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from scenes.transport.matrix import LightTransport
from scenes.transport.rows import empty_rows
from scenes.transport.store import stored


def transport(ambient: float) -> LightTransport:
    image = np.full((2, 3), ambient, np.float32)
    return LightTransport(
        camera_shape=(2, 3), projector_shape=(2, 2), direct=empty_rows(6), indirect=empty_rows(6),
        ambient=image, u_px=image, v_px=image, spread_px=image, indirect_sigma=image,
    )  # fmt: skip


def kept(folder: Path, key: str, ambient: float) -> Path:
    stored(folder, key, lambda: transport(ambient))
    return next(folder.glob(f"*-{key}.npz"))


@pytest.mark.parametrize("damage", [b"", b"PK", b"\x93NUMPY\x01\x00v\x00{", b"PK\x03\x04" + bytes(80)])
def test_a_damaged_entry_is_made_again_with_a_line(
    damage: bytes, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    path = kept(tmp_path, "one", 1.0)
    path.write_bytes(damage)
    again = stored(tmp_path, "one", lambda: transport(2.0))
    assert again.ambient[0, 0] == 2.0
    assert "traced again" in caplog.text
    assert stored(tmp_path, "one", lambda: transport(3.0)).ambient[0, 0] == 2.0


def test_an_entry_cut_anywhere_is_made_again(tmp_path: Path) -> None:
    path = kept(tmp_path, "one", 1.0)
    whole = path.read_bytes()
    for length in range(0, len(whole), 97):
        path.write_bytes(whole[:length])
        assert stored(tmp_path, "one", lambda: transport(2.0)).ambient[0, 0] == 2.0


def test_an_entry_under_another_name_is_not_used(tmp_path: Path) -> None:
    one, two = kept(tmp_path, "one", 1.0), kept(tmp_path, "two", 2.0)
    content = one.read_bytes()
    one.write_bytes(two.read_bytes())
    two.write_bytes(content)
    assert stored(tmp_path, "one", lambda: transport(1.0)).ambient[0, 0] == 1.0
    assert stored(tmp_path, "two", lambda: transport(2.0)).ambient[0, 0] == 2.0
