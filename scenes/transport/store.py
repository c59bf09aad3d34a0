"""Traced transports kept on disk by content, so that the same scene is traced once."""

from __future__ import annotations

import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from burrscan.files import written_whole
from scenes.transport.matrix import LightTransport, SparseRows

TRANSPORT_VERSION = 5
"""Raised whenever the traced numbers change; stored transports of another version are not used."""

_PARTS = ("direct", "indirect")
_IMAGES = ("ambient", "u_px", "v_px", "spread_px")


def stored(folder: Path | None, key: str, make: Callable[[], LightTransport]) -> LightTransport:
    """The transport of content ``key`` from ``folder``, or made and left there.

    Several processes may share a folder: files appear whole, and a damaged one is made again.
    """
    if folder is None:
        return make()
    path = folder / f"transport-{TRANSPORT_VERSION}-{key}.npz"
    try:
        return _read(path)
    except (OSError, ValueError, KeyError, zipfile.BadZipFile):
        transport = make()
        _write(path, transport)
        return transport


def _read(path: Path) -> LightTransport:
    with np.load(path) as file:
        rows = [SparseRows(*(file[f"{part}_{name}"] for name in _names())) for part in _PARTS]
        camera, projector = (tuple(int(n) for n in file[f"{name}_shape"]) for name in ("camera", "projector"))
        images = {name: file[name] for name in _IMAGES}
        return LightTransport(
            camera_shape=(camera[0], camera[1]),
            projector_shape=(projector[0], projector[1]),
            direct=rows[0],
            indirect=rows[1],
            **images,
        )


def _write(path: Path, transport: LightTransport) -> None:
    arrays = {name: getattr(transport, name) for name in _IMAGES}
    for part in _PARTS:
        arrays |= {f"{part}_{name}": getattr(getattr(transport, part), name) for name in _names()}
    with written_whole(path) as beside:
        np.savez(
            beside,
            camera_shape=transport.camera_shape,
            projector_shape=transport.projector_shape,
            **arrays,
        )


def _names() -> tuple[str, str, str]:
    return "starts", "columns", "values"
