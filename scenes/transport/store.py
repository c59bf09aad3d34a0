"""Traced transports kept on disk by content, so that the same scene is traced once."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import numpy as np

from burrscan.files import written_whole
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows

TRANSPORT_VERSION = 8
"""Raised whenever the traced numbers change; stored transports of another version are not used."""

FOLDER_VARIABLE = "BURRSCAN_TRANSPORTS"
"""Names the folder of stored transports; ``off`` keeps none."""

_LOG = logging.getLogger("burrscan.transports")
_LIMIT_BYTES = 4 << 30
"""Of the folder of stored transports, 4 GiB: then the oldest go."""
_PARTS = ("direct", "indirect")
_NAMES = ("starts", "columns", "values")
_IMAGES = ("ambient", "u_px", "v_px", "spread_px", "indirect_sigma")


def default_folder() -> Path | None:
    """Where runs keep transports: ``$BURRSCAN_TRANSPORTS`` or the user's cache; None for ``off``."""
    named = os.environ.get(FOLDER_VARIABLE, "")
    if named:
        return None if named == "off" else Path(named)
    cache = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(cache) if Path(cache).is_absolute() else Path.home() / ".cache"
    return base / "burrscan" / "transports"


def stored(
    folder: Path | None, key: str, make: Callable[[], LightTransport], *, limit_bytes: int = _LIMIT_BYTES
) -> LightTransport:
    """The transport of content ``key`` from ``folder``, or made and left there.

    Several processes may share a folder: files appear whole, and each names its own key. One that is damaged,
    or another's, is made again, and a line says so. When the folder grows beyond ``limit_bytes``, what was
    used longest ago goes. A folder that cannot be written costs time, not the run.
    """
    if folder is None:
        return make()
    path = folder / f"transport-{TRANSPORT_VERSION}-{key}.npz"
    try:
        transport = _read(path, key)
    except Exception as error:  # noqa: BLE001 (a damaged archive raises a dozen kinds)
        if not isinstance(error, FileNotFoundError):
            _LOG.warning("note: %s cannot be used, its light is traced again: %s", path, repr(error))
        transport = make()
        with suppress(OSError):
            _write(path, key, transport)
            _forget_oldest(folder, limit_bytes)
    else:
        with suppress(OSError):
            os.utime(path)
    return transport


def _forget_oldest(folder: Path, limit_bytes: int) -> None:
    """Remove stored transports, longest unused first, until they fit."""
    files = []
    for path in folder.glob("transport-*.npz"):
        with suppress(FileNotFoundError):  # another process was faster
            status = path.stat()
            files.append((status.st_mtime, status.st_size, path))
    total = sum(size for _, size, _ in files)
    for _, size, path in sorted(files)[:-1]:
        if total <= limit_bytes:
            break
        path.unlink(missing_ok=True)
        total -= size


def _read(path: Path, key: str) -> LightTransport:
    with path.open("rb") as opened, np.load(opened, allow_pickle=False) as file:
        if str(file["key"]) != key:
            raise ValueError(f"it is the entry of another scene, {file['key']}")
        rows = {part: SparseRows(*(file[f"{part}_{name}"] for name in _NAMES)) for part in _PARTS}
        camera, projector = (tuple(int(n) for n in file[f"{name}_shape"]) for name in ("camera", "projector"))
        images = {name: file[name] for name in _IMAGES}
        return LightTransport(
            camera_shape=(camera[0], camera[1]),
            projector_shape=(projector[0], projector[1]),
            direct=rows["direct"],
            indirect=rows["indirect"],
            **images,
        )


def _write(path: Path, key: str, transport: LightTransport) -> None:
    arrays = {name: getattr(transport, name) for name in _IMAGES}
    for part in _PARTS:
        arrays |= {f"{part}_{name}": getattr(getattr(transport, part), name) for name in _NAMES}
    with written_whole(path) as beside:
        np.savez(
            beside,
            key=np.array(key),
            camera_shape=transport.camera_shape,
            projector_shape=transport.projector_shape,
            **arrays,
        )
