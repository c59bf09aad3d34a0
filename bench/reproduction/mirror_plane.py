"""Figure 2: a plane whose mirror reflection of the projector blinds the camera, and the corrected one."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from bench.reproduction.drawing import chart, grey
from bench.reproduction.parts import (
    SIDES,
    Claim,
    Numbers,
    Picture,
    Section,
    Side,
    Table,
    both,
    middle_half,
    number,
    verdict,
)
from bench.reproduction.plane_scans import measure
from burrscan.arrays import Floats

__all__ = ["draw", "measure"]

TITLES = {
    "seed_clipped": "full light, clipped sines accepted (seed)",
    "seed_refused": "full light, clipped sines refused (seed)",
    "default_refused": "full light, clipped sines refused (default's code)",
    "seed_corrected": "adapted light (seed)",
    "default_corrected": "adapted light (default)",
}

_HOLE, _CORRECTED, _STRONG, _NEAR, _MOST = 0.8, 0.95, 2.0, 0.3, 0.9
"""Of a highlight: share missing that is a hole, share measured that is corrected, error over that beside it
that is strong, cycles within which it is the harmonic; and share of the planes in which that must be."""


def draw(n: Numbers) -> Section:
    """Clipped and corrected planes, and sections through the highlight."""
    clipped, outside = n["seed_clipped_rms_mm"]
    missing = {v: 1.0 - float(n[f"{v}_refused_covered"][0]) for v in SIDES}
    fixed = {v: n[f"{v}_corrected_rms_mm"] for v in SIDES}
    whole = {v: float(n[f"{v}_corrected_covered"][0]) for v in SIDES}
    many = {v: 1.0 - n[f"{v}_refused_covered_planes"][:, 0] for v in SIDES}
    errors = n["seed_clipped_rms_mm_planes"]
    ratio, cycles = errors[:, 0] / errors[:, 1], n["harmonic_planes"]
    periodic = (ratio > _STRONG) & (np.abs(cycles - 8.0) < _NEAR)
    mended = {
        v: (n[f"{v}_corrected_covered_planes"][:, 0] > _CORRECTED)
        & (n[f"{v}_corrected_rms_mm_planes"][:, 0] < errors[:, 0])
        for v in SIDES
    }
    return Section(
        title="Figure 2: a plane with the mirror reflection of the projector",
        reports="Left, a plane is incomplete where its highlight oversaturates the camera; right, adapted "
        "light corrects it. In the cross-section the sines that were clipped leave a strong periodic "
        "artefact, and the mirror reflection a circular hole.",
        measured="A glossy plane that mirrors the projector into the camera. At "
        f"{number(n, 'exposure_ms'):.0f} ms, which suits most of it, the highlight clips on "
        f"{number(n, 'spot'):.0%} of the plane. Where clipped sines are accepted the height errs there by "
        f"{clipped:.2f} mm RMS, {clipped / outside:.1f} times as much as beside it, "
        f"{number(n, 'harmonic'):.1f} times per period of the sine: eight-step phase shifting lets the "
        f"seventh and ninth harmonics through. Where they are refused {missing['seed']:.0%} of the "
        f"highlight is a hole. In adapted light {whole['seed']:.1%} of it is measured, to "
        f"{fixed['seed'][0]:.2f} mm (seed), and {whole['default']:.1%} to {fixed['default'][0]:.3f} mm "
        f"(default). The seed's adapted light is noisier beside the highlight, {fixed['seed'][1]:.2f} mm: "
        f"its one exposure is {number(n, 'seed_corrected_exposure_ms'):.1f} ms. The paper does not say how "
        "it is chosen; our port asks for half a column, which nearly every exposure gives here, so it gets "
        f"no more. Of {len(cycles)} further planes, tilted a little, glossier and duller, on half the "
        "raster, the claims have medians and the middle half.",
        claims=(
            Claim(
                "2, figure 2",
                "oversaturation makes a circular hole in the plane",
                "circular hole",
                *both(lambda v: f"{_spread(many[v], '.0%')} of the highlight missing"),
                verdict([bool(np.median(each) > _HOLE) for each in many.values()]),
                f"{_HOLE:.0%} of the highlight counts as a hole",
            ),
            Claim(
                "2, figure 2",
                "clipped sines give a strong periodic artefact",
                "strong",
                f"RMS {_spread(ratio, '.1f')} times as large as beside, {_spread(cycles, '.1f')} cycles per "
                "period",
                "refuses clipped sines",
                verdict([periodic.mean() > _MOST, bool(periodic.any())]),
                f"over {_STRONG:g} times, at the eighth harmonic, on {periodic.mean():.0%} of the planes; "
                f"{_MOST:.0%} of them are asked for",
            ),
            Claim(
                "2, figure 2",
                "adapted light corrects the plane",
                "corrected",
                *both(
                    lambda v: (
                        f"{_spread(n[f'{v}_corrected_covered_planes'][:, 0], '.1%')} of the highlight, "
                        f"{_spread(n[f'{v}_corrected_rms_mm_planes'][:, 0], '.2g')} mm RMS"
                    )
                ),
                verdict([bool(each.mean() > _MOST) for each in mended.values()]),
                f"over {_CORRECTED:.0%} of the highlight, and nearer to the plane than clipped sines are "
                f"({_spread(errors[:, 0], '.2g')} mm RMS), on {mended['seed'].mean():.0%} of the planes "
                f"(seed) and {mended['default'].mean():.0%} (default); {_MOST:.0%} of them are asked for",
            ),
        ),
        pictures=(*_shared(n), *(picture for v in SIDES for picture in _pictures(n, v))),
        tables=(_table(n),),
    )


def _shared(n: Numbers) -> tuple[Picture, ...]:
    exposure = f"{number(n, 'exposure_ms'):.0f} ms"
    return (
        Picture(f"Full white light at {exposure}, as the camera sees it", grey(n["white"], "white light")),
        Picture(f"A sine at {exposure}: clipped in the highlight", grey(n["image"], "clipped sine")),
    )


def _pictures(n: Numbers, variant: Side) -> list[Picture]:
    wrong = "seed_clipped" if variant == "seed" else "default_refused"
    right, css = f"{variant}_corrected", "v0" if variant == "seed" else "v1"
    views = [
        Picture(TITLES[key].capitalize(), grey(n[f"{key}_view"], TITLES[key]), variant)
        for key in (wrong, right)
    ]
    legend = (("v5", "full light"), (css, "adapted light"))
    return [
        *views,
        Picture(
            "Section along the line through the highlight",
            _section(n, {"v5": wrong, css: right}),
            variant,
            legend,
        ),
    ]


def _section(n: Numbers, keys: Mapping[str, str]) -> Markup:
    limit = 1.1 * float(np.nanmax(np.abs(n["seed_clipped_section"][:, 1])))
    curves = {css: n[f"{key}_section"].astype(float) for css, key in keys.items()}
    return chart(
        curves,
        "along the plane, mm",
        "height, mm",
        "section through the highlight",
        marks=False,
        y=(-limit, limit),
    )


def _table(n: Numbers) -> Table:
    rows = tuple((title[0].upper() + title[1:], *_cells(n, key)) for key, title in TITLES.items())
    return Table(
        ("scan", "exposure", "highlight measured", "beside it", "height RMS in the highlight", "beside it"),
        rows,
    )


def _cells(n: Numbers, key: str) -> tuple[str, ...]:
    covered, rms = n[f"{key}_covered"], n[f"{key}_rms_mm"]
    return (
        f"{number(n, f'{key}_exposure_ms'):.1f} ms",
        *(f"{c:.1%}" for c in covered),
        *(_mm(r) for r in rms),
    )


def _mm(value: float) -> str:
    return f"{value:.3f} mm" if np.isfinite(value) else "–"


def _spread(values: Floats, form: str) -> str:
    return middle_half(values, f"{{:{form}}}".format)
