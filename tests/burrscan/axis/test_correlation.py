"""The width that correlated errors give a stated axis, against sectors whose errors are drawn."""

import numpy as np
import pytest

from burrscan.arrays import Floats
from burrscan.axis.fitting.correlation import Scores, widened
from burrscan.axis.fitting.correlogram import NONE, Correlation, correlation_of

SECTORS, PIECES, POINTS = 32, 12, 40
SEEN = 14


def drawn(
    shared: float, length: float, rng: np.random.Generator, told: Correlation = NONE
) -> tuple[Scores, float]:
    """Scores of a cylinder's view with errors of a deviation ``shared`` that reach so far; and its own size.

    ``told`` is what the residuals of neighbours say of them.

    Last the mean square, over the four of the pose, of the errors that they make.
    """
    turn = 2.0 * np.pi * np.arange(SECTORS) / SECTORS
    height = np.linspace(-0.8, 0.8, PIECES)
    lean = np.empty((PIECES, SECTORS, 4))
    lean[..., 0], lean[..., 1] = -height[:, None] * np.sin(turn), height[:, None] * np.cos(turn)
    lean[..., 2], lean[..., 3] = np.cos(turn), np.sin(turn)
    lean[:, SEEN:] = 0.0
    lean[:, :SEEN] -= lean[:, :SEEN].mean(axis=1, keepdims=True)
    information = POINTS * np.einsum("ksp,ksq->pq", lean, lean)
    values, vectors = np.linalg.eigh(information)
    lean = lean @ (vectors / np.sqrt(values))
    chord = 2.0 * np.sin(0.5 * (turn[:SEEN, None] - turn[:SEEN]))
    around, along = (
        np.linalg.cholesky(np.exp(-0.5 * (gap / length) ** 2) + 1e-9 * np.eye(len(gap)))
        for gap in (chord, height[:, None] - height)
    )
    errors = np.zeros((PIECES, SECTORS))
    errors[:, :SEEN] = shared * along @ rng.normal(size=(PIECES, SEEN)) @ around.T
    errors[:, :SEEN] += rng.normal(size=(PIECES, SEEN)) / np.sqrt(POINTS)
    errors[:, :SEEN] -= errors[:, :SEEN].mean(axis=1, keepdims=True)
    pose = POINTS * np.einsum("ks,ksp->p", errors, lean)
    errors -= np.einsum("ksp,p->ks", lean, pose)  # what the fit leaves
    weights = np.where(np.arange(SECTORS) < SEEN, float(POINTS * PIECES), 0.0)
    scores = Scores(
        sums=POINTS * np.einsum("ks,ksp->sp", errors, lean),
        shares=POINTS * np.einsum("ksp,ksq->spq", lean, lean),
        lifts=POINTS * lean,
        weights=weights,
        places=np.stack([height, np.ones(PIECES)], axis=1),
        normals=np.tile([0.0, 1.0], (PIECES, 1)),
        spacing=float(height[1] - height[0]),
        shared=told,
    )
    return scores, float(pose @ pose) / 4.0


def ratio(shared: float, length: float, told: Correlation = NONE) -> Floats:
    """Stated variance, and the true one, over many draws, in units of what independent errors make."""
    rng = np.random.default_rng(0)
    runs = [drawn(shared, length, rng, told) for _ in range(60)]
    stated = np.median([np.trace(widened(scores)) / 4.0 for scores, _ in runs])
    return np.array([stated, np.mean([true for _, true in runs])])


def test_independent_errors_widen_little() -> None:
    stated, true = ratio(0.0, 0.3)
    assert 0.8 < true < 1.2
    assert 1.0 <= stated < 2.5  # 14 sectors of 11 degrees do not tell more of what they share


def test_errors_that_reach_far_widen_by_what_they_make() -> None:
    for shared, length in ((0.5, 0.2), (1.0, 0.4)):
        stated, true = ratio(shared, length)
        assert true > 10.0
        assert 0.7 < stated / true < 3.0  # on the wide side: Student's quantile is in it


def test_what_neighbours_share_widens_by_what_it_makes() -> None:
    """Told of errors of one point in three standard deviations, it need not find them in fourteen sectors."""
    shared, length = 0.3, 0.2
    stated, true = ratio(shared, length, Correlation(share=shared**2, reach=length, own=1.0 - shared**2))
    assert true > 2.0
    assert 0.8 < stated / true < 2.0


def field(share: float, reach: float, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Counts and sums of residuals of cells on half a cylinder, 0.02 by 0.1 radii, with ten points each."""
    pieces, places, sectors = 10, 16, 64
    along = 0.02 * np.arange(pieces * places)
    turn = 2.0 * np.pi * np.arange(5 * sectors // 2) / (5 * sectors)  # five strips to a cell, then their mean
    roots = [
        np.linalg.cholesky(np.exp(-0.5 * ((at[:, None] - at) / reach) ** 2) + 1e-7 * np.eye(len(at)))
        for at in (along, turn)
    ]
    white = rng.normal(size=(len(along), len(turn)))
    errors = np.sqrt(share) * (roots[0] @ white @ roots[1].T).reshape(len(along), -1, 5).mean(axis=2)
    errors += np.sqrt((1.0 - share) / 10.0) * rng.normal(size=errors.shape)
    middle = 2.0 * np.pi * np.arange(sectors // 2) / sectors
    followed = np.column_stack([np.ones_like(middle), np.cos(middle), np.sin(middle)])  # by the fit
    errors -= errors @ followed @ np.linalg.pinv(followed)
    counts, sums = np.zeros((2, pieces, places, sectors))
    counts[..., : sectors // 2] = 10.0
    sums[..., : sectors // 2] = 10.0 * errors.reshape(pieces, places, -1)
    return counts, sums


def test_share_and_reach_are_read_off_neighbours() -> None:
    rng = np.random.default_rng(1)
    for share, reach in ((0.6, 0.05), (0.3, 0.1), (0.8, 0.15)):
        told = [correlation_of(*field(share, reach, rng), radius=1.0, along=0.02) for _ in range(8)]
        assert np.mean([one.share for one in told]) == pytest.approx(share, abs=0.12)
        assert np.mean([one.reach for one in told]) == pytest.approx(reach, rel=0.25)


def test_what_the_fit_has_followed_of_far_errors_is_counted() -> None:
    """Residuals are told in their own standard deviation, which is small where the fit takes most of them."""
    rng = np.random.default_rng(3)
    share, left, told = 0.9, [], []
    for _ in range(12):
        counts, sums = field(share, 0.25, rng)
        seen = counts > 0.0
        left.append(float((sums[seen] / 10.0).var()) + 0.9 * (1.0 - share))
        told.append(correlation_of(counts, sums / np.sqrt(left[-1]), radius=1.0, along=0.02))
    assert np.mean(left) < 0.6
    assert np.mean([one.share * v for one, v in zip(told, left, strict=True)]) == pytest.approx(
        share, abs=0.2
    )
    assert np.mean([one.own * v for one, v in zip(told, left, strict=True)]) == pytest.approx(0.1, abs=0.05)


def test_neighbours_that_share_nothing_are_said_to() -> None:
    rng = np.random.default_rng(2)
    shares = [correlation_of(*field(0.0, 0.1, rng), radius=1.0, along=0.02).share for _ in range(20)]
    assert max(shares) < 0.02


def test_what_says_nothing_widens_nothing() -> None:
    zeros = np.zeros((PIECES, SECTORS, 4))
    nothing = Scores(
        np.zeros((SECTORS, 4)),
        np.zeros((SECTORS, 4, 4)),
        zeros,
        np.zeros(SECTORS),
        zeros[:, 0, :2],
        zeros[:, 0, :2],
        0.1,
        NONE,
    )
    np.testing.assert_array_equal(widened(nothing), np.eye(4))
