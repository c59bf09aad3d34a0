"""The steps of the default pipeline, and what stands in a step's place while it is left out."""

from __future__ import annotations

import importlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from burrscan.arrays import Bools, Floats, Ints
from burrscan.axis.fitting.correlogram import NONE
from burrscan.axis.fitting.fit import Fit
from burrscan.axis.fitting.scales import Thickness, thickness_of
from burrscan.axis.points.cloud import canonical_cloud
from burrscan.burrs.describe import Site
from burrscan.burrs.field import Field
from burrscan.burrs.light.brightness import excess
from burrscan.burrs.light.row_sigma import row_sigma
from burrscan.burrs.noise.correlated_noise import Noise, noise_around
from burrscan.burrs.shape.patch import Patch
from burrscan.burrs.shape.ridge import Ridge
from burrscan.generatrix.polyline import Polyline
from burrscan.scan.lens import Lens
from burrscan.scan.matching.matched import Reading

StageName = Literal["scan", "axis", "generatrix", "burrs"]


@dataclass(frozen=True)
class Step:
    """One step.

    Parameters
    ----------
    name
        As the table calls it.
    stage
        The first stage that is run anew without it.
    places
        ``"module:name"`` of what does the step, where it is called from, and what stands there without it.

    """

    name: str
    stage: StageName
    places: Mapping[str, Any]

    @contextmanager
    def left_out(self) -> Iterator[None]:
        """Leave the step out of everything that runs meanwhile. Not for threads: modules are changed.

        Raises
        ------
        AttributeError
            When the pipeline has no such place any more.

        """
        kept = []
        try:
            for place, instead in self.places.items():
                path, name = place.split(":")
                module = importlib.import_module(path)
                kept.append((module, name, getattr(module, name)))
                setattr(module, name, instead)
            yield
        finally:
            for module, name, usual in reversed(kept):
                setattr(module, name, usual)


def _as_read(_images: Any, _code: Any, reading: Reading, **_: Any) -> Reading:
    """What one path tells."""
    return reading


def _as_points(_eye: Any, patch: Patch, *_: Any) -> Patch:
    """Vertices where they are, each for itself."""
    return patch


def _own_alone(*args: Any, **kwargs: Any) -> Noise:
    """Noise of the vertices' own."""
    return Noise(noise_around(*args, **kwargs).own_mm, 0.0)


def _no_correction(u_px: Any, *_: Any, **__: Any) -> Any:
    """Nothing to take off any column (h, w), and nothing to widen its sigma by."""
    return np.zeros_like(u_px)


def _as_it_is(points: Floats, _: Floats, fit: Fit, *__: Any, **___: Any) -> tuple[Fit, Thickness]:
    """The fit where the starts of the axis led."""
    return fit, thickness_of(points, fit)


def _whole_pieces(line: Polyline, *_: Any) -> list[Floats]:
    """The pieces of a line as they are."""
    ends = np.flatnonzero(np.diff(line.starts) > 1) + 1
    return [line.nodes_mm[part[0] : part[-1] + 2] for part in np.split(line.starts, ends)]


def _every_vertex(_: Field, site: Site) -> Ints:
    return site.chosen[site.on]


def _no(*_: Any, **__: Any) -> bool:
    return False


def _by_rows(rest: Floats, _: Floats, *, least: float) -> Floats:
    """(rows, 1) what cells scatter by, told by their row alone."""
    return row_sigma(rest, least=least)[:, None]


def _by_itself(brightness: Floats, known: Bools, _: Floats, **window: int) -> tuple[Floats, Floats, Floats]:
    return excess(brightness, known, **window)


def _one_height(_: Patch, ridge: Ridge, **__: Any) -> tuple[float, float]:
    return ridge.height_mm, ridge.sigma_of([1, 0, 0, 0, 0])


_EXACT, _RESIDUAL, _FUSION, _ROUNDS, _DISTURBED = (
    "burrscan.generatrix.exact",
    "burrscan.burrs.residual",
    "burrscan.scan.validity.fusion",
    "burrscan.scan.rounds",
    "burrscan.burrs.light.disturbed",
)

STEPS: tuple[Step, ...] = (
    Step(
        "intensity per projector pixel",
        "scan",
        {"burrscan.scan.adaptive:intensities": lambda *_, shape, **__: np.ones(shape)},
    ),
    Step(
        "columns filled in for the intensities",
        "scan",
        {"burrscan.scan.adaptive:fill_columns": lambda u_px, *_, **__: u_px},
    ),
    Step("intensities smoothed", "scan", {"burrscan.scan.intensity:_SMOOTH_PX": 0.0}),
    Step(
        "regions grown from sure columns",
        "scan",
        {f"{_FUSION}:grow_regions": lambda *readings, **_: readings[-1]},
    ),
    Step("sure only where direct light dominates", "scan", {f"{_FUSION}:_DIRECT_DOMINATES": np.inf}),
    Step("rounds that contradict each other dropped", "scan", {f"{_FUSION}:_APART_Z": np.inf}),
    Step(
        "columns that contradict their neighbours dropped",
        "scan",
        {f"{_FUSION}:consistent": lambda u, *_, **__: np.isfinite(u)},
    ),
    Step(
        "mixed pixels dropped",
        "scan",
        {f"{_ROUNDS}:mixed_pixels": lambda reading, *_, **__: np.zeros(reading.u_px.shape, np.bool_)},
    ),
    Step("bias of the known light taken off", "scan", {f"{_ROUNDS}:light_bias_px": _no_correction}),
    Step("direct of two paths", "scan", {f"{_ROUNDS}:direct_of_two": _as_read}),
    Step("lens of the projector found", "scan", {"burrscan.scan.adaptive:lens_of": lambda *_, **__: Lens()}),
    Step("what that leaves stated", "scan", {f"{_ROUNDS}:left": _no_correction}),
    Step("glints narrower than a pixel unsure", "scan", {"burrscan.footprint:_OFF_PEAK": 0.0}),
    Step("columns beside narrow gaps", "scan", {"burrscan.footprint:_LACKS": np.inf}),
    Step(
        "border of the projector's picture dropped",
        "scan",
        {"burrscan.meshing:_within_light": lambda points, _: np.isfinite(points[..., 2])},
    ),
    Step("sigma of interreflected light", "scan", {f"{_ROUNDS}:interreflection_sigma_px": _no_correction}),
    Step(
        "stated noise as weights",
        "axis",
        {"burrscan.axis.profile:canonical_cloud": lambda vertices, _: canonical_cloud(vertices, None)},
    ),
    Step(
        "what smoothing took given back",
        "axis",
        {"burrscan.axis.profile:given_back": lambda smooth, *_, **__: smooth},
    ),
    Step(
        "walls left out of the axis",
        "axis",
        {"burrscan.axis.profile:off_walls": lambda points, *_, **__: np.ones(len(points), np.bool_)},
    ),
    Step(
        "several starts of the axis",
        "axis",
        {"burrscan.axis.profile:RIVAL": 1.0, "burrscan.axis.profile:RIVAL_COST": 1e-9},
    ),
    Step(
        "axis tried where noise that shrinks leads",
        "axis",
        {"burrscan.axis.profile:_annealed": lambda _, fit: fit},
    ),
    Step(
        "axis tried where the generatrix is sharper",
        "axis",
        {"burrscan.axis.profile:_where_likelier": _as_it_is},
    ),
    Step(
        "noise of each piece in the axis's sigma",
        "axis",
        {"burrscan.axis.fitting.covariance:relative_scales": lambda thick, _: np.ones(len(thick.scales))},
    ),
    Step(
        "errors of neighbours in the axis's sigma",
        "axis",
        {"burrscan.axis.fitting.covariance:correlation_of": lambda *_, **__: NONE},
    ),
    Step(
        "errors that reach far in the axis's sigma",
        "axis",
        {"burrscan.axis.fitting.covariance:widened": lambda _: np.eye(4)},
    ),
    Step(
        "ends of the generatrix extended",
        "generatrix",
        {"burrscan.generatrix.curve:extended": lambda piece, **_: piece},
    ),
    Step(
        "ends of the generatrix trimmed",
        "generatrix",
        {"burrscan.generatrix.curve:trimmed": _whole_pieces},
    ),
    Step(
        "what would outvote the curve is not fitted",
        "generatrix",
        {"burrscan.generatrix.curve:without": lambda data, *_, **__: data},
    ),
    Step("creases sharpened", "generatrix", {f"{_EXACT}:creases": lambda _: {}}),
    Step(
        "roundings told from creases",
        "generatrix",
        {f"{_EXACT}:borne_out": lambda *_, sharp, **__: sharp[-1][0]},
    ),
    Step("more nodes where the curve bends", "generatrix", {f"{_EXACT}:halved": lambda line, *_: line}),
    Step("ends where the data end", "generatrix", {f"{_EXACT}:cut_back": lambda line, *_: line}),
    Step("fit to all vertices after the cells", "generatrix", {f"{_EXACT}:_TUKEY_STEPS": 0}),
    Step("waves taken off", "burrs", {"burrscan.burrs.field:without_waves": lambda *_, **__: None}),
    Step(
        "backs of thin walls left out",
        "burrs",
        {"burrscan.burrs.field:of_another_surface": lambda part, *_: np.zeros(len(part), np.bool_)},
    ),
    Step(
        "handles and bars are no burrs",
        "burrs",
        {"burrscan.burrs.field:of_another_body": lambda _, distance, __: np.zeros(len(distance), np.bool_)},
    ),
    Step("edges of openings are no burrs", "burrs", {f"{_RESIDUAL}:MOST_OPEN": 1.0}),
    Step("edges of surfaces without a curve are no burrs", "burrs", {f"{_RESIDUAL}:MOST_WITHOUT": 1.0}),
    Step("nicks are like their description", "burrs", {"burrscan.burrs.describe:_LEAST_EXPLAINED": -np.inf}),
    Step(
        "pieces of the curve apart",
        "burrs",
        {"burrscan.burrs.field:APART_CELLS": 0, "burrscan.burrs.light.unrolled:_APART_CELLS": 0},
    ),
    Step(
        "stands out from its surroundings", "burrs", {f"{_RESIDUAL}:convincing": lambda _, found, **__: found}
    ),
    Step("the far side is no measure of contrast", "burrs", {"burrscan.burrs.local_cfar:_FACED": np.pi}),
    Step("errors that neighbours share", "burrs", {f"{_RESIDUAL}:noise_around": _own_alone}),
    Step("shared errors count once a width", "burrs", {f"{_RESIDUAL}:_looks": lambda *_, **__: 1.0}),
    Step("border of the mesh is no evidence", "burrs", {f"{_RESIDUAL}:_inside": _every_vertex}),
    Step("ridges as pixels see them", "burrs", {"burrscan.burrs.describe:_seen_by": _as_points}),
    Step("halo left out of the ridge", "burrs", {f"{_RESIDUAL}:_HALO": 0.0}),
    Step(
        "corners left out of the ridge",
        "burrs",
        {"burrscan.burrs.describe:_cornered": lambda _, site, __: np.zeros(len(site.chosen), np.bool_)},
    ),
    Step("burrs are no triangles", "burrs", {"burrscan.burrs.describe:NO_TRIANGLE": 0.0}),
    Step(
        "height where it is highest",
        "burrs",
        {"burrscan.burrs.describe:height_of": _one_height},
    ),
    Step(
        "satellites dropped",
        "burrs",
        {f"{_RESIDUAL}:without_satellites": lambda _, regions, __: list(range(len(regions)))},
    ),
    Step(
        "light as evidence",
        "burrs",
        {
            f"{_RESIDUAL}:disturbed": lambda *_, **__: (None, None, []),
            f"{_RESIDUAL}:mirrored": lambda *_: 0.0,
            f"{_RESIDUAL}:is_an_edge": _no,
        },
    ),
    Step("a stump is not the burr", "burrs", {f"{_RESIDUAL}:_STUMP": 0.0}),
    Step("what corners mirror is no burr", "burrs", {f"{_RESIDUAL}:is_interreflected": _no}),
    Step("light along edges", "burrs", {f"{_RESIDUAL}:along_edges": lambda *_, **__: []}),
    Step(
        "noise along edges tells nothing", "burrs", {"burrscan.burrs.along_edges.unexplained:_NOISY": np.inf}
    ),
    Step("light of the dark by its own scatter", "burrs", {f"{_DISTURBED}:_shares": np.zeros_like}),
    Step(
        "scatter by how flatly it is looked at",
        "burrs",
        {f"{_DISTURBED}:cell_sigma": _by_rows},
    ),
    Step("depths that are noise are none", "burrs", {f"{_DISTURBED}:depths_are_noise": lambda *_: False}),
    Step("glints are no burrs", "burrs", {f"{_DISTURBED}:_is_a_glint": lambda *_, **__: False}),
    Step(
        "walls that mirror each other swap places",
        "burrs",
        {"burrscan.burrs.light.aside:_crossed": lambda *_: 0.0},
    ),
    Step("parallels share a highlight", "burrs", {f"{_DISTURBED}:excess_of_lobe": _by_itself}),
    Step(
        "ends that the wheel hides are no edges",
        "burrs",
        {"burrscan.burrs.edges:_hidden": lambda _, on, *__: np.zeros(len(on), np.bool_)},
    ),
    Step("nothing told of what is grazed", "burrs", {f"{_RESIDUAL}:FLATTEST": -np.inf}),
    Step(
        "edges of brightness are no burrs",
        "burrs",
        {f"{_DISTURBED}:wanders_flat": _no, f"{_RESIDUAL}:is_an_edge": _no},
    ),
    Step("heights less sure on what shines", "burrs", {f"{_RESIDUAL}:MIRRORED": 0.0}),
    Step("nicks less sure by light from wall to wall", "burrs", {f"{_RESIDUAL}:walls_share": lambda _: 0.0}),
    Step(
        "heights that depths show below those told",
        "burrs",
        {"burrscan.burrs.light.call:_unseen": lambda _, told: told},
    ),
    Step(
        "contradicted heights from the depths of the place",
        "burrs",
        {"burrscan.burrs.light.call:_seen": lambda _, __, told: told},
    ),
    Step(
        "heights doubted where little was measured", "burrs", {f"{_RESIDUAL}:doubted": lambda burr, *_: burr}
    ),
    Step(
        "side and height told by a model of the light",
        "burrs",
        {f"{_DISTURBED}:told_of": lambda *_, **__: None},
    ),
)
"""In the order of the pipeline."""
