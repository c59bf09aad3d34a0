"""Figure 9: the wrong orientations that the two rejected measures also like."""

from __future__ import annotations

import numpy as np

from bench.reproduction import landscape
from bench.reproduction.circles import picture, shown
from bench.reproduction.lab import Lab
from bench.reproduction.orientation import direction_of
from bench.reproduction.parts import SIDES, Claim, Numbers, Section, both, number, verdict

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
            # without any so far off, the farthest
            wrong = int(
                np.argmax(errors > landscape.EYE_DEG) if errors.max() > landscape.EYE_DEG else errors.argmax()
            )
            best = min(float(values[0]), float(known[f"{key}_at_truth"]))
            heights = known[key][np.isfinite(known[key])]
            found[f"{key}_height"] = np.asarray((float(values[wrong]) - best) / (np.median(heights) - best))
            found |= shown(key, scan, direction_of(known[f"{key}_minima"][wrong]))
            found[f"{key}_value"] = values[wrong]
            found[f"{key}_at_truth"] = known[f"{key}_at_truth"]
            found[f"{key}_first"] = np.asarray(float(wrong == 0))
            found[f"{key}_best_off"] = errors[0]
    return found


def draw(n: Numbers) -> Section:
    """The meshes turned to the wrong minima."""
    longest = [number(n, f"{v}_max_centre_distance_first") > 0 for v in SIDES]
    off = [number(n, f"{v}_max_centre_distance_best_off") for v in SIDES]
    competing = [number(n, f"{v}_bounding_box_height") < landscape.CLOSE for v in SIDES]
    return Section(
        title="Figure 9: wrong minima of the rejected measures",
        reports="The bounding box of the centres is small at wrong orientations too; its longest side even "
        "has its best value at a wrong one, where the centres are collinear along the orientation.",
        measured="The pictures show the best orientation that looks wrong, more than 10° off. Box: "
        + "; ".join(_words(n, v, "bounding_box") for v in SIDES)
        + ". Longest side: " + "; ".join(_words(n, v, "max_centre_distance") for v in SIDES) + ".",
        claims=(
            Claim("5.1, figure 9", "box: a wrong orientation also has a small one", "almost as small",
                  *both(lambda v: _words(n, v, "bounding_box")), verdict(competing),
                  "its height above the best, as a share of the landscape's median: the statistic of figure "
                  "10"),
            Claim("5.1, figure 9", "longest side: best at a wrong orientation", "wrong one chosen",
                  *both(lambda v: _words(n, v, "max_centre_distance")),
                  "yes" if all(longest) else "partly" if any(longest) or min(off) > 2.0 else "no",
                  _still_close(n, off)),
        ),
        pictures=tuple(
            picture(n, f"{v}_{key}", f"Wrong minimum of the {title}, {_off(n, v, key)} off", v)
            for v in SIDES for key, title in REJECTED.items()
        ),
    )  # fmt: skip


def _still_close(n: Numbers, off: list[float]) -> str:
    heights = " and ".join(f"{number(n, f'{v}_max_centre_distance_height'):.2g}" for v in SIDES)
    return (
        f"its best is {off[0]:.1f}° and {off[1]:.1f}° off (seed, default): beside the axis, not far "
        f"from it; the best of those that look wrong stands {heights} of the landscape's height above it"
    )


def _words(n: Numbers, variant: str, key: str) -> str:
    prefix, unit = f"{variant}_{key}", _UNITS[key]
    return (
        f"{number(n, f'{prefix}_value'):.3g} {unit} at {number(n, f'{prefix}_off'):.0f}° off, "
        f"{number(n, f'{prefix}_at_truth'):.3g} {unit} at the true axis; "
        f"{number(n, f'{prefix}_height'):.2g} of the "
        "median's height above the best"
    )


def _off(n: Numbers, variant: str, key: str) -> str:
    return f"{number(n, f'{variant}_{key}_off'):.0f}°"
