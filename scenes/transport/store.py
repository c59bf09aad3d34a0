"""Traced transports kept on disk by content, so that the same scene is traced once."""

from __future__ import annotations

import io
import logging
import os
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO

import numpy as np

from burrscan.files import written_whole
from scenes.stores import Store
from scenes.transport.matrix import LightTransport
from scenes.transport.rows import SparseRows

TRANSPORT_VERSION = 15
"""Raised whenever the traced numbers change; stored transports of another version are not used."""

FOLDER_VARIABLE = "BURRSCAN_TRANSPORTS"
"""Names the folder of stored transports; ``off`` keeps none."""

NOWHERE = "off"
"""Said instead of a folder: keep none."""

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
        return None if named == NOWHERE else Path(named)
    cache = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(cache) if Path(cache).is_absolute() else Path.home() / ".cache"
    return base / "burrscan" / "transports"


def stored(
    folder: Path | Store | None,
    key: str,
    make: Callable[[], LightTransport],
    *,
    limit_bytes: int = _LIMIT_BYTES,
) -> LightTransport:
    """The transport of content ``key`` from ``folder``, or made and left there.

    Several processes may share a folder: files appear whole, and each names its own key. One that is damaged,
    or another's, is made again, and a line says so. When the folder grows beyond ``limit_bytes``, what was
    used longest ago goes; a store that many machines share is left to its owner's rules. A folder that cannot
    be written costs time, not the run.
    """
    if folder is None:
        return make()
    name = f"transport-{TRANSPORT_VERSION}-{key}.npz"
    if isinstance(folder, Store):
        return _stored_afar(folder, name, key, make)
    path = folder / name
    try:
        with path.open("rb") as opened:
            transport = _read(opened, key)
    except Exception as error:  # noqa: BLE001 (a damaged archive raises a dozen kinds)
        if not isinstance(error, FileNotFoundError):
            _LOG.warning("note: %s cannot be used, its light is traced again: %s", path, repr(error))
        transport = make()
        with suppress(OSError):
            with written_whole(path) as beside, beside.open("wb") as opened:
                _write(opened, key, transport)
            _forget_oldest(folder, limit_bytes)
    else:
        with suppress(OSError):
            os.utime(path)
    return transport


def _stored_afar(store: Store, name: str, key: str, make: Callable[[], LightTransport]) -> LightTransport:
    """As :func:`stored`; every kind of store has errors of its own, and none of them stops a run."""
    try:
        return _read(io.BytesIO(store.read(name)), key)
    except FileNotFoundError:
        pass
    except Exception as error:  # noqa: BLE001 (see above)
        _LOG.warning(
            "note: %s of %s cannot be used, its light is traced again: %r", name, store.address, error
        )
    transport = make()
    content = io.BytesIO()
    _write(content, key, transport)
    try:
        store.write(name, content.getvalue())
    except Exception as error:  # noqa: BLE001 (see above)
        _LOG.warning("note: %s cannot be kept in %s: %r", name, store.address, error)
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


def _read(opened: IO[bytes], key: str) -> LightTransport:
    with np.load(opened, allow_pickle=False) as file:
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


def _write(opened: IO[bytes], key: str, transport: LightTransport) -> None:
    arrays = {name: getattr(transport, name) for name in _IMAGES}
    for part in _PARTS:
        arrays |= {f"{part}_{name}": getattr(getattr(transport, part), name) for name in _NAMES}
    np.savez(
        opened,
        key=np.array(key),
        camera_shape=transport.camera_shape,
        projector_shape=transport.projector_shape,
        **arrays,
    )
