"""Views that have nothing to align them by, and what is no view; short, for `make test-fast`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burrscan.errors import InputError
from burrscan.registration import align
from tests.burrscan.registration.test_align import views


def test_views_that_share_nothing_keep_their_rough_poses() -> None:
    apart = views(1, (0.0, 180.0), lobes=0.0)
    found = align(apart)
    assert found.overlap.max() == 0.0
    np.testing.assert_allclose(found.T_world_camera, [one.T_world_camera for one in apart], atol=1e-9)
    assert np.degrees(np.sqrt(found.covariance[1, 0, 0])) == pytest.approx(0.2 * np.sqrt(2.0), rel=1e-6)


def test_what_cannot_be_aligned_is_refused() -> None:
    good = views(0, (0.0, 60.0))
    mirrored = replace(good[1], T_world_camera=good[1].T_world_camera @ np.diag([1.0, 1.0, -1.0, 1.0]))
    crumb = replace(good[1], faces=good[1].faces[:40])
    for bad, why in (([], "two views"), ([mirrored], "view 2: .*rigid"), ([crumb], "view 2: only")):
        with pytest.raises(InputError, match=why):
            align([good[0], *bad])
