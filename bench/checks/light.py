"""How right the interreflected light around burrs is, pixel by pixel, against stock Mitsuba.

    python -m bench.checks.light [--scenes N] [--seed S] [--paths P]

Draws scenes anew: ridges, rim burrs, nicks and grooves of random size, place and pose, polished, ground and
turned, with the camera's raster cut down to the burr. Printed per scene and for all, over the pixels whose
interreflected light is more than a fifth of the direct and whose whole light the reference knows to 2.5 %:
error of the white image, shift of stripes of 24 projector pixels (each median and 90 %), the reference's own
standard error, the robust spread of error over both standard errors, and the correlation of neighbours.
Errors against the reference hold its own, too. What is ours alone stands beside them: two of our tracings
differ by √2 of it, where their mean is that of the reference. Beside bright edges a few paths carry a tenth
of the light: a reference of 4,096 paths, which meets none of them, is known badly and does not say so; 65,536
(``--paths``) take half an hour and are better.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np

from bench.checks.zoomed import DRUM, GROOVED, RUNS, SAMPLES, Compared, Rendered, Zoom, compare
from burrscan.arrays import Bools, Floats
from burrscan.robust import SIGMA_PER_MEDIAN
from scenes.finish import FinishSpec, Metal
from scenes.renderer import activate
from scenes.wheel import AxialRidge, BurrSpec, Nick, RimBurr

_KNOWN = 0.025
"""Standard deviation of the reference over the light, up to which a pixel is compared."""
_STRIPES_PX = 24.0
"""Period whose shift is compared: a usual fine stripe."""
_METALS: tuple[Metal, ...] = ("aluminium", "steel", "brass", "chrome")


class _Errors(NamedTuple):
    """Of the pixels compared: errors relative to their light, shifts in px, z and its neighbours' pairs."""

    white: Floats
    shift_px: Floats
    own_white: Floats
    own_shift_px: Floats
    reference: Floats
    z: Floats
    pairs: Floats


def main() -> None:
    """Draw, compare and print."""
    plain = argparse.RawDescriptionHelpFormatter
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=plain)
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--paths", type=int, default=RUNS * SAMPLES, help="of the reference, for each pixel")
    given = parser.parse_args()
    if given.paths < 2 * RUNS:
        parser.error(f"--paths {given.paths}: a reference's error is told by {RUNS} runs of 2 or more each")
    mi = activate()
    if str(mi.variant()).startswith("scalar"):
        raise SystemExit("no vectorised Mitsuba variant on this machine; see 'burrscan doctor'")
    rng = np.random.default_rng(given.seed)
    every: dict[str, list[_Errors]] = {"burrs": [], "grooves": []}
    print("                                   against stock Mitsuba        ours alone")
    print(
        "scene                      pixels  white, %     shift, px      white, %     shift, px      "
        "reference, %  spread  neighbours"
    )
    for number in range(given.scenes):
        name, zoom = _drawn(rng, number)
        compared = compare(Rendered(mi, zoom), stripes_px=_STRIPES_PX, samples=given.paths // RUNS)
        errors = _errors(compared)
        every["grooves" if "groove" in name else "burrs"].append(errors)
        _print(name, errors)
    for kind, parts in (*every.items(), ("all", [one for some in every.values() for one in some])):
        if parts:
            _print(kind, _Errors(*(np.concatenate(column) for column in zip(*parts, strict=True))))


def _drawn(rng: np.random.Generator, number: int) -> tuple[str, Zoom]:
    kind = ("ridge", "rim", "nick", "groove")[number % 4]
    texture = ("polished", "ground", "turned")[number % 3]
    angle, size = rng.uniform(-30.0, 30.0), rng.uniform(0.8, 2.2)
    width = size * rng.uniform(1.0, 1.6)
    burrs: dict[str, BurrSpec] = {
        "ridge": AxialRidge(angle, size, width, -10.0, 12.0),
        "rim": RimBurr(angle, 40.0, size, width, 2),
        "nick": Nick(angle, size, 1.3 * width, -10.0, 12.0),
        "groove": AxialRidge(-70.0, 1.5, 2.0, 8.0, 20.0),
    }
    metal = _METALS[rng.integers(len(_METALS))]
    finishes = {
        "polished": FinishSpec(metal=metal, alpha=rng.uniform(0.06, 0.1)),
        "ground": FinishSpec(metal=metal, alpha=rng.uniform(0.15, 0.25)),
        "turned": FinishSpec(
            texture="turned",
            metal=metal,
            alpha_along=rng.uniform(0.05, 0.1),
            alpha_across=rng.uniform(0.18, 0.35),
        ),
    }
    groove = kind == "groove"
    zoom = Zoom(
        GROOVED if groove else DRUM,
        burrs[kind],
        finishes[texture],
        roll_deg=rng.uniform(60.0, 90.0) if groove else rng.uniform(0.0, 90.0),
        elevation_deg=rng.uniform(2.0, 25.0),
        at_mm=(58.5, 0.0, rng.uniform(-4.5, 4.5)) if groove else None,
    )
    return f"{number:2d} {kind}, {texture} {metal}", zoom


def _errors(one: Compared) -> _Errors:
    whole = one.mean + one.direct
    deviation = np.sqrt(one.variance)
    known: Bools = one.compared & (deviation < _KNOWN * whole)
    z = one.z(one.light.white_indirect, one.light.indirect_sigma)
    cut = np.clip(z, -3.0, 3.0)
    pairs = np.concatenate(
        [
            np.stack([cut[:, :-1].ravel(), cut[:, 1:].ravel()], axis=1),
            np.stack([cut[:-1].ravel(), cut[1:].ravel()], axis=1),
        ]
    )
    return _Errors(
        white=(np.abs(one.light.white_indirect - one.mean) / np.where(known, whole, 1.0))[known],
        shift_px=np.abs(one.shift_px)[known],
        own_white=(np.abs(one.own_white) / np.where(known, np.sqrt(2.0) * whole, 1.0))[known],
        own_shift_px=np.abs(one.own_shift_px)[known] / np.sqrt(2.0),
        reference=(deviation / np.where(known, whole, 1.0))[known],
        z=z[np.isfinite(z)],
        pairs=pairs[np.isfinite(pairs).all(axis=1)],
    )


def _print(name: str, errors: _Errors) -> None:
    if errors.white.size < 10:
        print(f"{name:26s} {errors.white.size:6d}  too few pixels to say")
        return
    quantiles = [
        np.quantile(values, [0.5, 0.9])
        for values in (errors.white, errors.shift_px, errors.own_white, errors.own_shift_px, errors.reference)
    ]
    white, shift, own_white, own_shift, reference = quantiles
    spread = SIGMA_PER_MEDIAN * np.median(np.abs(errors.z - np.median(errors.z)))
    correlation = float(np.asarray(np.corrcoef(errors.pairs.T))[0, 1])
    print(
        f"{name:26s} {errors.white.size:6d}  {100 * white[0]:4.1f} / {100 * white[1]:4.1f}  "
        f"{shift[0]:5.3f} / {shift[1]:5.3f}   {100 * own_white[0]:4.1f} / {100 * own_white[1]:4.1f}  "
        f"{own_shift[0]:5.3f} / {own_shift[1]:5.3f}   {100 * reference[0]:3.1f} / {100 * reference[1]:3.1f}"
        f"     {spread:4.2f}   {correlation:+.2f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
