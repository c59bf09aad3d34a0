"""A small folder of ramps for the photometric calibration; the board's light is drawn, not rendered."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.captures.png import write_grey
from burrscan.captures.ramps import NAME

_SHAPE = (48, 64)
"""Rows and columns: 192 tiles of 4 × 4 pixels."""
_BITS, _BLACK_DN, _FULL_WELL_E, _READ_NOISE_E = 10, 20.0, 10_000.0, 8.0
"""Of a usual camera."""
_GAMMA = 2.0
"""Of the projector."""
_DARKEST = 0.002
"""Light of level 0, of full light."""
_LONGEST_MS = 13.0
"""The lamp's brightest pixel fills the well in 10 ms."""


def write_ramps(folder: Path) -> None:
    """Write ``ramps.json`` and its pictures: a lamp's ramp, pictures in the dark, the projector's levels."""
    (folder / "images").mkdir(parents=True)
    rng, shots = np.random.default_rng(3), list[dict[str, object]]()

    def taken(light: float, exposure_ms: float) -> dict[str, object]:
        name = f"images/{len(shots):04d}.png"
        write_grey(folder / name, _picture(light, exposure_ms, rng))
        shots.append({"image": name, "exposure_ms": exposure_ms})
        return shots[-1]

    times = np.unique(
        np.concatenate([_LONGEST_MS * 2.0 ** -np.arange(0.5, 7.0), np.linspace(1.0, _LONGEST_MS, 14)])
    )
    lamps = [taken(1.0, float(t)) | {"lamp": 0} for t in times]
    lamps += [taken(0.0, float(t)) | {"lamp": 0, "lit": False} for t in times[[-1, -4, 2]]]
    levels = [
        taken(_DARKEST + (1.0 - _DARKEST) * (level / 255.0) ** _GAMMA, float(t)) | {"levels": [level]}
        for t in (4.0, 9.0)
        for level in range(0, 256, 17)
    ]
    levels += [taken(0.0, 4.0) | {"levels": [-1]}]
    document = {
        "format": "burrscan-ramps",
        "version": 1,
        "bit_depth": _BITS,
        "exposure_range_ms": [0.01, 100.0],
        "lamps": lamps,
        "levels": levels,
    }
    (folder / NAME).write_text(json.dumps(document), "utf-8")


def _picture(light: float, exposure_ms: float, rng: np.random.Generator) -> Image:
    """(h, w) DN of a board lit unevenly: by half as much at one end as at the other."""
    field: Floats = np.broadcast_to(np.linspace(0.5, 1.0, _SHAPE[1]), _SHAPE)
    electrons = rng.poisson(_FULL_WELL_E / 10.0 * exposure_ms * (light * field + 0.002))
    top = 2**_BITS - 1
    dn = electrons * (top - _BLACK_DN) / _FULL_WELL_E + _BLACK_DN
    noise = rng.normal(scale=_READ_NOISE_E * top / _FULL_WELL_E, size=_SHAPE)
    return np.asarray(np.clip(np.rint(dn + noise), 0, top), dtype=np.uint16)
