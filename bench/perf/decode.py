"""Decoding 24 frames (3 frequencies of 8 steps) at 1280×1024, ours beside ``fringes`` 2.1.0.

    pip install fringes==2.1.0          # GPL, optional
    python -m bench.perf.decode [--rounds N]

``fringes`` brings opencv-contrib, which cannot share an environment with the opencv that burrscan depends on:
use a throw-away one.

Both decode the same noisy 10-bit pictures of the same sines, in turn in one process, on one thread and on
two. Printed: wall and processor milliseconds (median over the rounds), the ratio of each pair of calls, and
each side's error against the true columns beside our stated sigma. On a machine that others use too the
processor's time is the one to read; at two threads it holds the work of both.
"""

from __future__ import annotations

import argparse
import importlib
import time
from collections.abc import Callable
from typing import Any

import numba
import numpy as np

from burrscan.arrays import Floats, Floats32, Image
from burrscan.codes.rivals.heterodyne import beats_px, heterodyne
from burrscan.devices import CameraSheet

_HEIGHT, _WIDTH, _STEPS, _FINEST_PX = 1024, 1280, 8, 16.0
"""The pictures of the module's first line; both decoders are given the same."""
_CAMERA = CameraSheet()
Decoder = Callable[[Image, int], Floats32]


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--rounds", type=int, default=7)
    given = parser.parse_args()
    code = heterodyne(width=_WIDTH, finest_px=_FINEST_PX, steps=_STEPS)
    images = pictures(code.light)
    sigma = code.decode(images, _CAMERA).sigma_u_px
    print(f"stated sigma {np.nanmedian(sigma):.4f} px, 24 frames of {images[0].nbytes / 2**20:.1f} MiB")
    theirs = fringes_decoder()
    _say_errors("ours", ours(images, 1))
    if theirs is None:
        print("fringes is not installed: only our side is timed")
        theirs = _nothing
    else:
        _say_errors("fringes", theirs(images, 1))
    for threads in (1, 2):
        pairs = np.array(
            [(_timed(ours, images, threads), _timed(theirs, images, threads)) for _ in range(given.rounds)]
        )
        for kind, (a, b) in zip(("wall", "processor"), pairs.transpose(2, 1, 0), strict=True):
            print(
                f"{threads} thread(s), {kind:9}: ours {1e3 * np.median(a):.0f} ms, fringes "
                f"{1e3 * np.median(b):.0f} ms, ratio {np.median(b / a):.1f} "
                f"({(b / a).min():.1f} to {(b / a).max():.1f})"
            )


def pictures(light: Floats) -> Image:
    """Frames (F, h, w) at nine tenths of full well, with shot and read noise."""
    rng = np.random.default_rng(0)
    electrons = 0.9 * _CAMERA.full_well_e * np.broadcast_to(light[:, None, :], (len(light), _HEIGHT, _WIDTH))
    noise = np.sqrt(electrons + _CAMERA.read_noise_e**2) * rng.standard_normal(electrons.shape)
    values = _CAMERA.black_level_dn + _CAMERA.gain_dn_per_e * (electrons + noise)
    return np.clip(np.rint(values), 0, _CAMERA.saturation_dn).astype(np.uint16)


def ours(images: Image, threads: int) -> Floats32:
    """Columns by :func:`burrscan.codes.rivals.heterodyne.decode_beats`."""
    numba.set_num_threads(min(threads, numba.config.NUMBA_NUM_THREADS))
    code = heterodyne(width=_WIDTH, finest_px=_FINEST_PX, steps=_STEPS)
    return code.decode(images, _CAMERA).u_px


def fringes_decoder() -> Decoder | None:
    """``fringes`` set to the same sines, or None where it is not installed."""
    try:
        module: Any = importlib.import_module("fringes")
    except ModuleNotFoundError:
        return None
    side = module.Fringes()
    side.X, side.Y, side.D, side.K, side.N, side.p0 = _WIDTH, _HEIGHT, 1, 3, _STEPS, 0.0
    side.v = [_WIDTH / period for period in beats_px(width=_WIDTH, finest_px=_FINEST_PX)]

    def decode(images: Image, threads: int) -> Floats32:
        numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
        found = side.decode(images[..., None], threads=threads)[2]
        return np.asarray(found, np.float32).reshape(_HEIGHT, _WIDTH)

    return decode


def _nothing(_images: Image, _threads: int) -> Floats32:
    return np.full((1, _WIDTH), np.nan, np.float32)


def _say_errors(name: str, u_px: Floats32) -> None:
    error = u_px - np.arange(_WIDTH)
    near = np.abs(error) < 1.0  # a NaN compares False
    print(f"{name}: RMS error {np.sqrt(np.mean(error[near] ** 2)):.4f} px, {near.mean():.3%} within 1 px")


def _timed(work: Decoder, images: Image, threads: int) -> tuple[float, float]:
    wall, processor = time.perf_counter(), time.process_time()
    work(images, threads)
    return time.perf_counter() - wall, time.process_time() - processor


if __name__ == "__main__":
    main()
