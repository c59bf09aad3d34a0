"""Descents of the seed paper's orientation test, from the best of its sparse start (section 3.1)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from burrscan.arrays import Floats

Objective = Callable[[Floats], float]
GROWTH = 10.0
"""Factor on the damping after a failed step and its inverse after a good one (Marquardt 1963)."""


def forward(objective: Objective, at: Floats, value: float, step: float) -> Floats:
    """Gradient as printed: "forward differences divided by the discretisation step"; two evaluations."""
    return np.array([objective(at + side) - value for side in step * np.eye(2)]) / step


def central(objective: Objective, at: Floats, _value: float, step: float) -> Floats:
    """Gradient by differences to both sides; four evaluations.

    A one-sided difference over 30 and 10 degrees is that of a point half a step away: it descends to a place
    beside the minimum.
    """
    ahead = [objective(at + side) - objective(at - side) for side in step * np.eye(2)]
    return np.array(ahead) / (2.0 * step)


GRADIENTS = {"central": central, "forward": forward}


def steepest_descent(
    objective: Objective,
    start: Floats,
    value: float,
    step: float,
    *,
    gradient: str,
    trials: int,
    halving: str = "gradient",
) -> tuple[Floats, float]:
    """Steps of length ``step``, halved until they descend; stops when ``trials`` of them did not.

    Parameters
    ----------
    objective
        f of section 3.1 over (θ, φ) in radians.
    start, value
        (2,) where to begin, and f there.
    step
        Δθ = Δφ: discretisation of the gradient and longest step, radians.
    gradient
        ``"central"`` or ``"forward"``.
    trials
        Steps that do not descend before the run ends.
    halving
        ``"gradient"`` chooses the length anew, and counts anew, at every gradient; ``"run"`` keeps one length
        that is only ever halved, and counts over the run.

    Returns
    -------
    (2,) the last place that descended, and f there.

    """
    length, failed = step, 0
    while True:
        slope = GRADIENTS[gradient](objective, start, value, step)
        size = float(np.linalg.norm(slope))
        if not np.isfinite(size) or size == 0.0:
            return start, value
        if halving == "gradient":
            length, failed = step, 0
        while failed < trials:
            trial = start - length / size * slope
            reached = objective(trial)
            if reached < value:
                break
            length /= 2.0
            failed += 1
        else:
            return start, value
        start, value = trial, reached


def levenberg_marquardt(
    objective: Objective, start: Floats, value: float, step: float
) -> tuple[Floats, float]:
    """Damped Newton steps; gradient and Hessian from five forward differences, as section 3.1 counts them."""
    damping = 1.0
    for _ in range(20):
        e, h = np.array([[step, 0.0], [0.0, step]]), step * step
        a, b = objective(start + e[0]), objective(start + e[1])
        aa, bb = objective(start + 2 * e[0]), objective(start + 2 * e[1])
        ab = objective(start + e[0] + e[1])
        gradient = np.array([a - value, b - value]) / step
        cross = (ab - a - b + value) / h
        hessian = np.array([[(aa - 2 * a + value) / h, cross], [cross, (bb - 2 * b + value) / h]])
        if not np.isfinite(hessian).all():
            return start, value
        while damping < GROWTH**5:
            scale = damping * max(float(np.abs(hessian).max()), 1e-12)
            trial = start - np.linalg.solve(hessian + scale * np.eye(2), gradient)
            reached = objective(trial)
            if reached < value:
                break
            damping *= GROWTH
        else:
            return start, value
        settled = value - reached < 1e-3 * value
        start, value, damping = trial, reached, damping / GROWTH
        if settled:
            return start, value
    return start, value
