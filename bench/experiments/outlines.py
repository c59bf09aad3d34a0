"""A suite of wheels that nobody has looked at: random outlines, metals, burrs, blemishes and poses.

    python -m bench.experiments.outlines --seed 7 --wheels 60 --out unseen.toml
    burrscan run unseen.toml --out RUN

The suites of the repository have a few wheels each, and a detector made in view of them comes to know them.
Here each scene has a part of its own: cylinders, cones and steps from a bore to an outer face, a rounding at
every edge, on any metal. The seed is the design: the same one draws the same suite.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from burrscan.errors import InputError
from burrscan.files import write_text
from scenes.scene import scene_from
from scenes.wheel import build_wheel

_METRICS = (
    "coverage",
    "axis_deg",
    "generatrix_rms_mm",
    "burr_found",
    "burr_located",
    "burr_height_mm",
    "false_calls",
)
"""What is asked of a part as a whole, and of its burrs."""
_WHEELS = 60
"""Some 60 burrs: a share of them is known to 4 %. Five minutes on two cores."""
_RADIUS_MM, _LONGEST_MM = (35.0, 95.0), 80.0
"""Of parts that a scanner of the default rig sees whole."""
_METALS = ("steel", "aluminium", "brass", "chrome", "copper")
"""What turned parts with burrs are made of, or coated with."""
_MATTE, _TURNED = 0.1, 0.4
"""Shares of parts with a coating, and of those and turned ones: most are ground or polished."""
_HEIGHTS_MM = (0.3, 2.0)
"""From what the goals count as a burr up to what a hand feels from a metre."""
_NARROWEST_MM = 0.8
"""Two pixels: what is narrower is a question of resolution."""
_STAINED = 0.35
"""Share of parts with something on them that is no burr."""
_TRIES = 50
"""Of drawing a part that can be made: one in three has fillets that do not fit, or no room for its burr."""


class _Face(NamedTuple):
    """A stretch of the outside, from (z, r) to (z, r), mm."""

    z0: float
    r0: float
    z1: float
    r1: float


class _Part(NamedTuple):
    """Corners (z, r, fillet), mm, and what of the outside lies along the axis."""

    corners: list[list[float]]
    faces: list[_Face]


def suite(seed: int, wheels: int) -> str:
    """The TOML text of a suite. O(wheels), half a second each: every scene is made once.

    Raises
    ------
    InputError
        Where a part was not drawn that can be made, which is a fault of the limits above.

    """
    rng = np.random.default_rng(seed)
    scenes = [_scene(rng, f"unseen-{seed}-{number}") for number in range(wheels)]
    lines = [
        f'name = "unseen-{seed}"',
        'title = "Wheels that nobody has looked at: are burrs seen, and only burrs, on any part"',
        f'description = "Random outlines, metals and burrs, by bench.experiments.outlines --seed {seed}."',
        f"metrics = {_toml(_METRICS)}",
        "",
        "[scene]",
        "rig = { scale = 0.5 }",
    ]
    for number, scene in enumerate(scenes):
        lines += ["", f"[condition.wheel-{number:02d}]"]
        lines += [f"{key} = {_toml(value)}" for key, value in scene.items() if key != "pose"]
        lines += [f'"pose.{key}" = {_toml(value)}' for key, value in scene["pose"].items()]
    return "\n".join([*lines, "", "[[variant]]", 'name = "adaptive"', ""])


def _scene(rng: np.random.Generator, name: str) -> dict[str, Any]:
    """Tables of a scene that can be made."""
    for _ in range(_TRIES):
        part = _part(rng)
        scene = {
            "wheel": {"name": name, "generatrix": part.corners},
            "finish": _finish(rng),
            "burr": _burrs(rng, part),
            "blemish": _blemishes(rng, part),
            "pose": {
                "elevation_deg": _between(rng, (-20.0, 30.0)),
                "roll_deg": _between(rng, (-15.0, 15.0)),
            },
        }
        try:
            made = scene_from(scene, source=name)
            build_wheel(made.wheel, made.burr)
        except InputError:
            continue
        return scene
    raise InputError(f"{name}: of {_TRIES} parts none could be made")


def _between(rng: np.random.Generator, limits: tuple[float, float], *, log: bool = False) -> float:
    low, high = limits
    value = low * (high / low) ** rng.random() if log else rng.uniform(low, high)
    return round(float(value), 2)


def _part(rng: np.random.Generator) -> _Part:
    """Two to five stretches, straight or conical, with steps between some of them."""
    radius = _between(rng, _RADIUS_MM)
    bore = 0.0 if rng.random() < 0.4 else _between(rng, (8.0, 0.4 * radius))
    lengths = rng.uniform(8.0, 22.0, rng.integers(2, 6))
    lengths *= min(1.0, _LONGEST_MM / lengths.sum())
    z, r = -0.5 * float(lengths.sum()), radius * rng.uniform(0.75, 1.0)
    path, faces = [(z, bore), (z, r)], list[_Face]()
    for number, length in enumerate(lengths.tolist()):
        slope = np.tan(np.radians(rng.uniform(-35.0, 35.0))) if rng.random() < 1.0 / 3.0 else 0.0
        end = float(np.clip(r + slope * length, 0.55 * radius, 1.05 * radius))
        faces.append(_Face(z, r, z + length, end))
        z, r = z + length, end
        path.append((z, r))
        step = rng.uniform(3.0, 12.0) * rng.choice([-1.0, 1.0])
        further = float(np.clip(r + step, 0.5 * radius, 1.05 * radius))
        if number < len(lengths) - 1 and rng.random() < 0.6 and abs(further - r) > 2.0:
            r = further
            path.append((z, r))
    path.append((z, bore))
    fillets = [0.0 if at[1] == 0.0 else float(rng.choice([0.0, 0.3, 0.5, 1.0, 2.0])) for at in path]
    corners = [[round(a, 2), round(b, 2), fillet] for (a, b), fillet in zip(path, fillets, strict=True)]
    return _Part(corners, faces)


def _finish(rng: np.random.Generator) -> dict[str, Any]:
    kind, metal = rng.random(), str(rng.choice(_METALS))
    if kind < _MATTE:
        return {"texture": "matte"}
    oxide = float(rng.choice([0.0, 0.0, 0.1, 0.3]))
    if kind < _TURNED:
        along, across = _between(rng, (0.05, 0.12)), _between(rng, (0.12, 0.3))
        lay = {"texture": "turned", "alpha_along": along, "alpha_across": across}
    else:
        lay = {"alpha": _between(rng, (0.05, 0.35), log=True)}
    return {**lay, "metal": metal, "diffuse_share": oxide}


def _burrs(rng: np.random.Generator, part: _Part) -> list[dict[str, Any]]:
    """None, one or two; two on either side of what faces the camera."""
    kind = rng.choice(["none", "ridge", "ridge", "nick", "rim", "two"])
    if kind == "none":
        return []
    if kind == "rim":
        return [_rim(rng, part)]
    if kind == "two":
        other = str(rng.choice(["ridge", "nick"]))
        return [_axial(rng, part, "ridge", (-28.0, -5.0)), _axial(rng, part, other, (5.0, 30.0))]
    return [_axial(rng, part, str(kind), (-25.0, 30.0))]


def _axial(
    rng: np.random.Generator, part: _Part, kind: str, angle_deg: tuple[float, float]
) -> dict[str, Any]:
    """A ridge or a nick on the longest of three stretches drawn."""
    drawn = [part.faces[number] for number in rng.integers(len(part.faces), size=3)]
    face = max(drawn, key=lambda one: one.z1 - one.z0)
    length = min(_between(rng, (5.0, 13.0)), face.z1 - face.z0 - 2.6)
    start = face.z0 + 1.3 + rng.random() * (face.z1 - face.z0 - 2.6 - length)
    height = _between(rng, _HEIGHTS_MM, log=True)
    burr = {
        "angle_deg": _between(rng, angle_deg),
        "height_mm": height,
        "width_mm": round(max(_NARROWEST_MM, height * rng.uniform(0.8, 2.0)), 2),
        "z_start_mm": round(start, 2),
        "z_end_mm": round(start + length, 2),
    }
    if rng.random() < 0.5:
        burr["finish"] = "wheel"
    if kind == "nick":
        return {"kind": "nick", **burr}
    if rng.random() < 0.5:
        burr["height_rms"] = 0.15
    section = str(rng.choice(["triangle", "rounded", "rolled", "flake"]))
    return {"kind": "axial_ridge", "section": section, "seed": int(rng.integers(100)), **burr}


def _rim(rng: np.random.Generator, part: _Part) -> dict[str, Any]:
    """On the upper end's edge, along the axis or away from it, or on the widest."""
    upper, widest = part.corners[-2], max(part.corners, key=lambda one: one[1])
    edge = upper if rng.random() < 0.6 else widest
    height = _between(rng, (_HEIGHTS_MM[0], 1.5), log=True)
    return {
        "kind": "rim",
        "angle_deg": _between(rng, (-20.0, 20.0)),
        "arc_deg": _between(rng, (8.0, 30.0)),
        "height_mm": height,
        "width_mm": round(max(_NARROWEST_MM, height * rng.uniform(0.8, 1.6)), 2),
        "edge": edge[:2],
        "direction": "axial" if edge is upper and rng.random() < 0.5 else "radial",
    }


def _blemishes(rng: np.random.Generator, part: _Part) -> list[dict[str, Any]]:
    if rng.random() >= _STAINED:
        return []
    face = part.faces[int(rng.integers(len(part.faces)))]
    return [
        {
            "kind": str(rng.choice(["stain", "bright_spot", "scratch"])),
            "angle_deg": _between(rng, (-25.0, 25.0)),
            "z_mm": round(face.z0 + 2.0 + rng.random() * (face.z1 - face.z0 - 4.0), 2),
            "length_mm": round(min(float(rng.uniform(4.0, 10.0)), face.z1 - face.z0 - 1.0), 2),
        }
    ]


def _toml(value: Any) -> str:
    """A value as TOML writes it on one line."""
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_toml(one)}" for key, one in value.items()) + " }"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "[" + ", ".join(_toml(one) for one in value) + "]"
    return json.dumps(value)


def main() -> None:
    """Write the suite."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    parser.add_argument("--seed", type=int, required=True, help="the design")
    parser.add_argument("--wheels", type=int, default=_WHEELS, help=f"how many (default: {_WHEELS})")
    parser.add_argument("--out", type=Path, required=True, help="the suite's file")
    told = parser.parse_args()
    write_text(told.out, suite(told.seed, told.wheels))
    print(f"{told.out}: {told.wheels} wheels; burrscan run {told.out} --out RUN")


if __name__ == "__main__":
    main()
