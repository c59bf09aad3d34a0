"""The seed's two-step scan: its Figure 2, and what its stages promise."""

import numpy as np
import pytest

from burrscan.scan.exposure import Response
from burrscan.scan.rivals.seed import brightest, scan_seed
from burrscan.triangulation import epipolar_v, triangulate
from tests.burrscan.instrument import Instrument, plane_depth, small_rig

STEPS, PERIOD_PX = 4, 16


def depth_ripple_mm(*, adapt: bool) -> float:
    """Periodic depth error of a shiny plane in its highlight: the fourth harmonic of the stripes.

    Clipped values of N steps move the phase N times per period (Figure 2: "a strong periodical artefact").
    """
    instrument = Instrument(small_rig(width=240), depth=plane_depth, decades=1.5, noise=False)
    exposure_ms = 2.5 * instrument.camera.full_well_e / instrument.response.max()
    scan = scan_seed(instrument, adapt=adapt, mask_clipped=False, steps=STEPS, exposure_ms=exposure_ms)
    points, _ = triangulate(scan.correspondence, instrument.rig)
    highlight = instrument.response * exposure_ms > 1.2 * instrument.camera.full_well_e
    known = highlight & scan.correspondence.mask
    assert known.sum() > 0.9 * highlight.sum() > 500
    error_mm = points[known][:, 2] - instrument.depth_mm[known]
    turns = STEPS * instrument.truth_u[known] / PERIOD_PX
    return float(2.0 * np.abs(np.mean(error_mm * np.exp(2j * np.pi * turns))))


def test_clipping_ripples_the_plane_and_adaptation_removes_it() -> None:
    without, adapted = depth_ripple_mm(adapt=False), depth_ripple_mm(adapt=True)
    assert without > 0.2
    assert adapted < without / 5.0


def test_adapted_light_reaches_more_than_full_light() -> None:
    instrument = Instrument(small_rig(width=200))
    bright = instrument.response > 1.0
    shares = [
        scan_seed(instrument, adapt=adapt).correspondence.mask[bright].mean() for adapt in (True, False)
    ]
    assert shares[0] > shares[1] + 0.1
    assert shares[0] > 0.85


def test_light_is_adapted_pixel_by_pixel() -> None:
    instrument = Instrument(small_rig(width=100), depth=plane_depth)
    u_px = instrument.truth_u.astype(np.float32)
    one = np.ones(u_px.shape, np.float32)
    row, column = 40, 50
    one[row, column] = 7.0
    response = Response(one, np.zeros_like(one), one < 0.0, frames=0)
    found = brightest(u_px, instrument, response)
    v_px = epipolar_v(u_px, instrument.rig)
    at = round(float(v_px[row, column])), round(float(u_px[row, column]))
    assert found[at] == pytest.approx(7.0)
    assert (found == found.max()).sum() == 1
