"""A place for files that many machines share: a folder, or any address that fsspec knows."""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from burrscan.errors import InputError
from burrscan.files import written_whole

_OF_FOLDERS = frozenset({"file", "ftp", "hdfs", "sftp", "smb", "ssh", "webhdfs"})
"""Schemes with folders that must be made. On others it is needless, and on S3 it would make a bucket."""

EXTRA = "pip install 'burrscan[cluster]'"
"""What a user without the optional packages is told."""


@dataclass(frozen=True)
class Store:
    """Files by name under one address.

    Parameters
    ----------
    address
        A folder's path, or an address with a scheme such as ``s3://bucket/folder`` or ``memory://folder``.

    """

    address: str

    def under(self, name: str) -> Store:
        """The store of everything below one of its folders."""
        return Store(f"{self.address.rstrip('/')}/{name}")

    def read(self, name: str) -> bytes:
        """A file's content.

        Raises
        ------
        FileNotFoundError
            When there is no such file.
        InputError
            When nothing here can read such an address.

        """
        if self._folder is not None:
            return (self._folder / name).read_bytes()
        system, root = self._system()
        return bytes(system.cat_file(f"{root}/{name}"))

    def write(self, name: str, content: bytes) -> None:
        """Put a file there, whole: object stores show what is complete, folders get it by renaming.

        Raises
        ------
        InputError
            When nothing here can write to such an address.

        """
        if self._folder is not None:
            with written_whole(self._folder / name) as beside:
                beside.write_bytes(content)
            return
        system, root = self._system()
        path = f"{root}/{name}"
        if _OF_FOLDERS.intersection(_protocols(system)):
            system.makedirs(path.rpartition("/")[0], exist_ok=True)
        system.pipe_file(path, content)

    def checked(self) -> Store:
        """Itself, once a file was written and read again.

        Raises
        ------
        InputError
            When that fails, with the reason.

        """
        name = ".burrscan"
        try:
            self.write(name, b"burrscan")
            self.read(name)
        except InputError:
            raise
        except Exception as error:  # every kind of store has errors of its own
            raise InputError(f"{self.address}: no store ({str(error) or repr(error)})") from error
        return self

    @property
    def _folder(self) -> Path | None:
        scheme, found, rest = self.address.partition("://")
        if not found:
            return Path(self.address)
        return Path(rest) if scheme in {"file", "local"} else None

    def _system(self) -> tuple[Any, str]:
        """The file system of an address, and the path in it."""
        try:
            core = importlib.import_module("fsspec.core")
            system, root = core.url_to_fs(self.address)
        except ImportError as error:  # of fsspec, or of what it needs for this scheme
            raise InputError(f"{self.address}: needs a package that is missing ({error}); {EXTRA}") from error
        except ValueError as error:
            raise InputError(f"{self.address}: no address of a store ({error})") from error
        return system, str(root).rstrip("/")


def _protocols(system: Any) -> tuple[str, ...]:
    named = system.protocol
    return (named,) if isinstance(named, str) else tuple(named)
