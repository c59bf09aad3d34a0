"""The width that correlated errors give a stated axis, against sectors whose errors are drawn."""

import numpy as np

from burrscan.arrays import Floats
from burrscan.axis.fitting.correlation import Scores, widened

SECTORS, PIECES, POINTS = 32, 12, 40
SEEN = 14


def drawn(shared: float, length: float, rng: np.random.Generator) -> tuple[Scores, float]:
    """Scores of a cylinder's view with errors of a deviation ``shared`` that reach so far; and its own size.

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
    )
    return scores, float(pose @ pose) / 4.0


def ratio(shared: float, length: float) -> Floats:
    """Stated variance, and the true one, over many draws, in units of what independent errors make."""
    rng = np.random.default_rng(0)
    runs = [drawn(shared, length, rng) for _ in range(60)]
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


def test_what_says_nothing_widens_nothing() -> None:
    zeros = np.zeros((PIECES, SECTORS, 4))
    nothing = Scores(
        np.zeros((SECTORS, 4)),
        np.zeros((SECTORS, 4, 4)),
        zeros,
        np.zeros(SECTORS),
        zeros[:, 0, :2],
        zeros[:, 0, :2],
    )
    np.testing.assert_array_equal(widened(nothing), np.eye(4))
