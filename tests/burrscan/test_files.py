"""Writing whole: beside, synced, renamed; and into what is no file."""

from __future__ import annotations

import errno
import os
import stat
import threading
from pathlib import Path

import pytest

from burrscan.files import written_whole


def test_a_pipe_is_written_into_and_stays_a_pipe(tmp_path: Path) -> None:
    pipe, read = tmp_path / "pipe", list[bytes]()
    os.mkfifo(pipe)
    reader = threading.Thread(target=lambda: read.append(pipe.read_bytes()))
    reader.start()
    with written_whole(pipe) as beside:
        beside.write_bytes(b"all of it")
    reader.join()
    assert read == [b"all of it"]
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert [item.name for item in tmp_path.iterdir()] == ["pipe"]


def test_a_descriptor_is_written_into(tmp_path: Path) -> None:
    with (tmp_path / "shell").open("wb") as opened:
        with written_whole(Path(f"/dev/fd/{opened.fileno()}")) as beside:
            beside.write_bytes(b"text")
        opened.write(b" and more")
    assert (tmp_path / "shell").read_bytes() == b"text and more"


def test_a_link_stays_and_its_file_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("old")
    (tmp_path / "link").symlink_to("file")
    with written_whole(tmp_path / "link") as beside:
        beside.write_text("new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "file").read_text() == "new"


def test_the_file_is_synced_before_it_is_renamed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    done = list[str]()
    monkeypatch.setattr(os, "fsync", lambda _: done.append("sync"))
    replace = Path.replace

    def renamed(self: Path, target: Path) -> Path:
        done.append("rename")
        return replace(self, target)

    monkeypatch.setattr(Path, "replace", renamed)
    with written_whole(tmp_path / "file") as beside:
        beside.write_text("x")
    assert done[:2] == ["sync", "rename"]


def test_on_a_full_disk_the_old_file_stays_and_nothing_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    (tmp_path / "file").write_text("old")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"), written_whole(tmp_path / "file") as beside:
        beside.write_text("new")
    assert [item.name for item in tmp_path.iterdir()] == ["file"]
    assert (tmp_path / "file").read_text() == "old"


def test_a_folder_is_refused_and_a_long_name_is_not(tmp_path: Path) -> None:
    with pytest.raises(IsADirectoryError, match="name a file"), written_whole(tmp_path):
        pass
    long = tmp_path / ("ä" * 120 + ".json")
    with written_whole(long) as beside:
        beside.write_text("x")
    assert long.read_text() == "x"


def test_links_in_a_circle_are_an_error_of_the_system(tmp_path: Path) -> None:
    link = tmp_path / "link"
    link.symlink_to("link")
    with pytest.raises(OSError, match="Too many levels") as told, written_whole(link):
        pass
    assert told.value.errno == errno.ELOOP
    assert [path.name for path in tmp_path.iterdir()] == ["link"]
    (tmp_path / "dangling").symlink_to("made")
    with written_whole(tmp_path / "dangling") as beside:
        beside.write_text("x")
    assert (tmp_path / "made").read_text() == "x"
