"""Figure 9: the wrong orientations that the two rejected measures also like."""

from __future__ import annotations

import numpy as np

from bench.paper import landscape
from bench.paper.circles import picture, shown
from bench.paper.lab import Lab
from bench.paper.orientation import direction_of
from bench.paper.parts import SIDES, Claim, Numbers, Section, both, number, verdict

REJECTED = {"bounding_box": "bounding box", "max_centre_distance": "longest side"}
_UNITS = {"bounding_box": "mm²", "max_centre_distance": "mm"}


def measure(lab: Lab) -> Numbers:
    """The best wrong minimum of both measures on both scans, from figure 10's landscapes."""
    known = lab.of_section("figure-10", landscape)
    found: dict[str, np.ndarray] = {}
    for name, scan in lab.pair("wheel").items():
        for measure_name in REJECTED:
            key = f"{name}_{measure_name}"
            errors, values = known[f"{key}_errors_deg"], known[f"{key}_values"]
            wrong = int(np.flatnonzero(errors > 2.0)[0])
            found |= shown(key, scan, direction_of(known[f"{key}_minima"][wrong]))
            found[f"{key}_value"] = values[wrong]
            found[f"{key}_at_truth"] = known[f"{key}_at_truth"]
            found[f"{key}_first"] = np.asarray(float(wrong == 0))
    return found


def draw(n: Numbers) -> Section:
    """The meshes turned to the wrong minima."""
    longest = [number(n, f"{v}_max_centre_distance_first") > 0 for v in SIDES]
    competing = [
        number(n, f"{v}_bounding_box_value") < 1.5 * number(n, f"{v}_bounding_box_at_truth") for v in SIDES
    ]
    return Section(
        title="Figure 9: wrong minima of the rejected measures",
        reports="The bounding box of the centres is small at wrong orientations too; its longest side even "
        "has its best value at a wrong one, where the centres are collinear along the orientation.",
        measured="The pictures show the best orientation more than 2° off. Box: "
        + "; ".join(_words(n, v, "bounding_box") for v in SIDES)
        + ". Longest side: " + "; ".join(_words(n, v, "max_centre_distance") for v in SIDES) + ".",
        claims=(
            Claim("5.1, figure 9", "box: a wrong orientation also has a small one", "almost as small",
                  *both(lambda v: _words(n, v, "bounding_box")), verdict(competing),
                  "" if all(competing) else "our scans are less noisy: the right axis has far smaller a box"),
            Claim("5.1, figure 9", "longest side: best at a wrong orientation", "wrong one chosen",
                  *both(lambda v: _words(n, v, "max_centre_distance")), verdict(longest),
                  "" if all(longest) else "with little noise the centres lie closest at the right axis"),
        ),
        pictures=tuple(
            picture(n, f"{v}_{key}", f"Wrong minimum of the {title}, {_off(n, v, key)} off", v)
            for v in SIDES for key, title in REJECTED.items()
        ),
    )  # fmt: skip


def _words(n: Numbers, variant: str, key: str) -> str:
    prefix, unit = f"{variant}_{key}", _UNITS[key]
    return (
        f"{number(n, f'{prefix}_value'):.3g} {unit} at {number(n, f'{prefix}_off'):.0f}° off, "
        f"{number(n, f'{prefix}_at_truth'):.3g} {unit} at the true axis"
    )


def _off(n: Numbers, variant: str, key: str) -> str:
    return f"{number(n, f'{variant}_{key}_off'):.0f}°"
