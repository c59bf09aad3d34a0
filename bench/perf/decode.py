"""Decoding 24 frames (3 frequencies of 8 steps) at 1280×1024, ours beside ``fringes`` 2.1.0.

    pip install fringes==2.1.0          # GPL, optional; a throw-away environment will do
    python -m bench.perf.decode [--rounds N]

Both sides run in turn in one process, on one thread and on two. Each decodes noisy 16-bit frames of its own
sines of the same three periods, and is held to the true columns. Printed: milliseconds (median over the
rounds), the ratio pair by pair, and each side's RMS error beside our stated sigma.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from burrscan.arrays import Floats, Image
from burrscan.codes.multifrequency import beats_px, heterodyne
from burrscan.devices import CameraSheet

_HEIGHT, _WIDTH, _STEPS, _FINEST_PX = 1024, 1280, 8, 16.0
_CAMERA = CameraSheet()


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=7)
    given = parser.parse_args()
    ours = _ours()
    theirs = _theirs()
    _say_errors("ours", ours())
    if theirs is not None:
        _say_errors("fringes", theirs())
    for threads in (1, 2):
        numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
        pairs = [(_timed(ours), _timed(theirs) if theirs else np.nan) for _ in range(given.rounds)]
        a, b = np.array(pairs).T
        print(
            f"{threads} thread(s): ours {1e3 * np.median(a):.0f} ms, fringes {1e3 * np.median(b):.0f} ms, "
            f"ratio {np.median(b / a):.1f} ({(b / a).min():.1f} to {(b / a).max():.1f})"
        )


def _ours() -> Callable[[], Floats]:
    code = heterodyne(width=_WIDTH, finest_px=_FINEST_PX, steps=_STEPS)
    images = _noisy(np.broadcast_to(code.light[:, None, :], (len(code.light), _HEIGHT, _WIDTH)))
    sigma = code.decode(images, _CAMERA).sigma_u_px
    print(f"ours: stated sigma {np.nanmedian(sigma):.4f} px, 24 frames of {images[0].nbytes / 2**20:.1f} MiB")
    return lambda: code.decode(images, _CAMERA).u_px.astype(float)


def _theirs() -> Callable[[], Floats] | None:
    """``fringes`` with the same periods, or None where it is not installed."""
    try:
        fringes: Any = importlib.import_module("fringes")
    except ModuleNotFoundError:
        print("fringes is not installed: only our side is timed")
        return None
    side = fringes.Fringes()
    side.X, side.Y, side.D, side.K, side.N = _WIDTH, _HEIGHT, 1, 3, _STEPS
    side.v = [_WIDTH / period for period in beats_px(width=_WIDTH, finest_px=_FINEST_PX)]
    light = np.asarray(side.encode(), float)[..., 0] / 255.0
    images = _noisy(light)[..., None]
    return lambda: np.asarray(side.decode(images)[2], float).reshape(-1, _HEIGHT, _WIDTH)[0]


def _noisy(light: Floats) -> Image:
    """Frames at nine tenths of full well, with shot and read noise."""
    rng = np.random.default_rng(0)
    electrons = 0.9 * _CAMERA.full_well_e * light
    noise = np.sqrt(electrons + _CAMERA.read_noise_e**2) * rng.standard_normal(light.shape)
    values = _CAMERA.black_level_dn + _CAMERA.gain_dn_per_e * (electrons + noise)
    return np.clip(np.rint(values), 0, _CAMERA.saturation_dn).astype(np.uint16)


def _say_errors(name: str, u_px: Floats) -> None:
    error = u_px - np.arange(_WIDTH)
    near = np.abs(error) < 1.0  # a NaN compares False
    print(f"{name}: RMS error {np.sqrt(np.mean(error[near] ** 2)):.4f} px, {near.mean():.2%} within 1 px")


def _timed(work: Callable[[], object]) -> float:
    start = time.perf_counter()
    work()
    return time.perf_counter() - start


if __name__ == "__main__":
    main()
