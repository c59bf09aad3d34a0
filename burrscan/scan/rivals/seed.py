"""Adapted structured light as the seed tells it (section 2 of Claes, Koninckx, Bruyninckx 2005).

A crude round first: Gray code of wide cells, and in the same sequence the white and black pictures that both
threshold it and measure each camera pixel's reflectance. Uncertain data are filtered out, missing geometry is
a thin-plate spline. The path from camera to projector carries the reflectance to the projector's pixels, and
their light is dimmed until what comes back fits the camera's range. Then Gray code and shifted sines in that
light.

The seed does not say how its camera's one exposure was chosen, nor how the crude round survives four decades
of reflectance: here it is taken at three exposures, and each pixel reads the longest that does not clip it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from burrscan.arrays import Bools, Floats, Floats32, Image
from burrscan.codes.code import patterns
from burrscan.codes.gray import decode_gray, gray_bits
from burrscan.codes.gray_phase import gray_phase
from burrscan.correspondence import Scan
from burrscan.devices import CameraSheet
from burrscan.linear import linear
from burrscan.scan.exposure import Response, even, sine_sigma_px
from burrscan.scan.fill_columns import fill_columns
from burrscan.scanner import Scanner
from burrscan.shifted import shifted
from burrscan.triangulation import epipolar_v

_CANDIDATES = 80
"""Exposures over the camera's range, even in ratio: 11 % apart on the default camera."""
_WELL_MEASURED_PX = 0.5
"""Standard deviation: the limit that coverage is counted by, half a projector column."""
_DOUBT_Z = 5.0
"""Noise deviations between a bit's picture and its stand-in inverse: that is made of three pictures and
noisier than one."""


@dataclass(frozen=True)
class _Crude:
    """The crude round: columns (h, w) that are trusted, NaN elsewhere, and each pixel's response."""

    u_px: Floats32
    response: Response


def scan_seed(
    scanner: Scanner,
    *,
    adapt: bool = True,
    mask_clipped: bool = True,
    crude_cell_px: int = 8,
    crude_exposures: int = 3,
    period_px: int = 16,
    steps: int = 8,
    fill_share: float = 0.8,
    least_intensity: float = 0.01,
    exposure_ms: float | None = None,
) -> Scan:
    """Scan in two steps: crude geometry and reflectance, then Gray code and phase shift in adapted light.

    Parameters
    ----------
    scanner
        The instrument.
    adapt
        False leaves the final patterns at full light, for contrast.
    mask_clipped
        False accepts pixels whose sine was clipped, as the seed's Figure 2 does: their columns err
        periodically.
    crude_cell_px
        Columns per cell of the crude Gray code.
    crude_exposures
        Exposures of the crude round, in even ratios over what the camera offers.
    period_px, steps
        Of the final sines.
    fill_share
        Share of the camera's range that adapted light is meant to fill.
    least_intensity
        The dimmest light that still carries a pattern in 8 bits.
    exposure_ms
        Of the final round; by default the one that lets most pixels be measured well.

    Notes
    -----
    Frames with the default camera and 1024 columns: 27 crude (7 bits, white and black, three times), 14 Gray,
    8 sines, 1 white; 50 in all. O(frames · pixels).

    """
    scanner = linear(scanner)
    camera, view = scanner.camera, scanner.rig.projector
    crude = _crude(scanner, cell_px=crude_cell_px, exposures=crude_exposures)
    least = least_intensity if adapt else 1.0
    final_ms = exposure_ms or _exposure_ms(
        crude.response, camera, least=least, fill_share=fill_share, period_px=period_px, steps=steps
    )
    intensity = None
    if adapt:
        wanted = crude.response.signal_e_per_ms * final_ms > 3.0 * camera.read_noise_e
        u_px = fill_columns(crude.u_px, np.isfinite(crude.u_px), wanted=wanted)
        light = fill_share * camera.full_well_e / (brightest(u_px, scanner, crude.response) * final_ms)
        intensity = np.clip(light, least, 1.0)
    code = gray_phase(width=view.width, period_px=period_px, steps=steps, mask_clipped=mask_clipped)
    shown = patterns(code.light, code.names, view=view, sheet=scanner.projector, intensity=intensity)
    images = scanner.capture(shown, final_ms)
    white = scanner.capture(even(scanner, levels=(255,)), final_ms)[0]
    return Scan(
        correspondence=code.decode(images, camera),
        frames=crude.response.frames + len(shown) + 1,
        exposures_ms=(final_ms,),
        white=white,
        saturated=np.asarray((images >= camera.clipped_dn).any(axis=0)),
        pattern=shown.frames[-1],
        image=images[-1],
        intensity=None if intensity is None else intensity.astype(np.float32),
        notes={"rounds": 2.0},
    )


def _crude(scanner: Scanner, *, cell_px: int, exposures: int) -> _Crude:
    """Every exposure's Gray code, white and black; each pixel from the longest that did not clip it."""
    camera, view = scanner.camera, scanner.rig.projector
    bits = gray_bits(width=view.width, cell_px=cell_px)
    light = np.concatenate([bits, np.ones((1, view.width)), np.zeros((1, view.width))])
    names = (*(f"crude-u-{i:02d}" for i in range(len(bits))), "crude-white", "crude-black")
    shown = patterns(light, names, view=view, sheet=scanner.projector)
    u_px = np.full(scanner.rig.camera.shape, np.nan, np.float32)
    white, black = np.full_like(u_px, np.nan), np.zeros_like(u_px)
    shortest, longest = camera.exposure_range_ms
    for time_ms in np.geomspace(longest, shortest, exposures).clip(shortest, longest):
        images = scanner.capture(shown, float(time_ms))
        todo = np.isnan(white) & (images < camera.clipped_dn).all(axis=0)
        u_px[todo] = _cells(images, camera, cell_px)[todo]
        for into, image in ((white, images[-2]), (black, images[-1])):
            into[todo] = (image[todo] - camera.black_level_dn) / (camera.gain_dn_per_e * time_ms)
    clipped = np.isnan(white)
    white[clipped] = camera.full_well_e / shortest
    response = Response(white, black, clipped, exposures * len(shown))
    return _Crude(np.where(_certain(u_px, cell_px), u_px, np.float32(np.nan)), response)


def _cells(images: Image, camera: CameraSheet, cell_px: int) -> Floats32:
    """Middles of the cells (h, w), NaN where a bit is in doubt; white and black stand in for inverses."""
    bits = images[:-2]
    both = images[-2].astype(np.int32) + images[-1]
    pairs = np.empty((2 * len(bits), *both.shape), np.uint16)
    pairs[0::2] = bits
    pairs[1::2] = np.clip(both - bits, 0, 65_535)
    # the stand-in has three pictures' noise
    cell, other = decode_gray(pairs, camera=camera, doubtful_z=_DOUBT_Z)
    known = (other >= 0) & (np.abs(cell - other) <= 1)
    middle = 0.5 * (cell + other) * cell_px + 0.5 * (cell_px - 1)
    return np.where(known, middle, np.nan).astype(np.float32)


def _certain(u_px: Floats32, cell_px: int, *, reach_px: int = 2, most_cells: float = 1.5) -> Bools:
    """Pixels with which most of the eight pixels around them, ``reach_px`` away, agree."""
    agree = np.zeros(u_px.shape, np.int32)
    steps = (-reach_px, 0, reach_px)
    for rows, columns in [(rows, columns) for rows in steps for columns in steps if rows or columns]:
        with np.errstate(invalid="ignore"):
            agree += np.abs(shifted(u_px, rows, columns) - u_px) <= most_cells * cell_px
    return agree >= 5


def _exposure_ms(
    response: Response, camera: CameraSheet, *, least: float, fill_share: float, period_px: int, steps: int
) -> float:
    """The exposure at which most pixels, dimmed to fit as far as ``least``, are measured well."""
    seen = response.signal_e_per_ms * camera.exposure_range_ms[1] > camera.read_noise_e
    signal = response.signal_e_per_ms[seen][::7].astype(float)
    steady = np.maximum(response.black_e_per_ms[seen][::7], 0.0).astype(float)
    if not len(signal):
        return camera.exposure_range_ms[1]
    roof = camera.full_well_e - 3.0 * np.sqrt(camera.full_well_e)
    times = np.geomspace(*camera.exposure_range_ms, _CANDIDATES)
    counts = []
    for time_ms in times:
        dim = np.clip(fill_share * camera.full_well_e / (signal * time_ms), least, 1.0)
        kept, dark = signal * dim * time_ms, steady * time_ms
        sigma = sine_sigma_px(kept, dark, camera=camera, period_px=float(period_px), steps=steps)
        counts.append(int(((kept + dark < roof) & (sigma <= _WELL_MEASURED_PX)).sum()))
    return float(times[_CANDIDATES - 1 - int(np.argmax(counts[::-1]))])


def brightest(u_px: Floats32, scanner: Scanner, response: Response) -> Floats:
    """The strongest response (H, W), electrons per ms, of the camera pixels that see a projector pixel.

    Parameters
    ----------
    u_px
        (h, w) columns; rows follow from the rig.
    scanner, response
        The path from camera to projector, and what comes back along it.

    Notes
    -----
    Per pixel, as section 2 says: of the camera pixels that one projector pixel lights the brightest counts,
    and nothing is spread to its neighbours. Where no camera pixel looks, the nearest one's does. O(pixels).

    """
    height, width = scanner.rig.projector.shape
    v_px = epipolar_v(u_px, scanner.rig)
    found = np.zeros((height, width), np.float32)
    with np.errstate(invalid="ignore"):
        inside = (u_px > -0.5) & (u_px < width - 0.5) & (v_px > -0.5) & (v_px < height - 0.5)
    at = np.rint(v_px[inside]).astype(np.int64), np.rint(u_px[inside]).astype(np.int64)
    np.maximum.at(found, at, response.white_e_per_ms[inside])
    if not (found > 0.0).any():
        return np.full((height, width), 1e-12)
    nearest = ndimage.distance_transform_edt(found <= 0.0, return_distances=False, return_indices=True)
    return np.asarray(found[tuple(nearest)], float)
