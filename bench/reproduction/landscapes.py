"""The error over all orientations, for figure 10: on both scans, and with the paper's noise."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

import numpy as np

from bench.reproduction.lab import Lab
from bench.reproduction.minima import Objective, bottoms, grid_of, minima_of
from bench.reproduction.noise import PAPER_MM, along_rays
from bench.reproduction.orientation import WHOLE, angles_of, direction_of, sectioned
from bench.reproduction.parts import Numbers
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Floats, Ints32
from burrscan.axis.fitting.starts import WIDTH, angle_cost
from burrscan.axis.points.cloud import canonical_cloud, voxel_moments
from burrscan.axis.points.surfels import Surfels, surfels_of

MEASURES = ("bounding_box", "max_centre_distance", "circle_distance", WHOLE)
RIGHT_DEG = 2.0
"""Within it the best orientation counts as the right one."""
_PER_DRAW = ("count", "at_truth", "contrast", "grid_contrast")
DRAWS = 20
"""Of the paper's noise: which minimum is best depends on the draw."""


def landscapes(vertices_mm: Floats, faces: Ints32, grid: Floats) -> dict[str, Floats]:
    """The paper's measures at every orientation of a grid, from the same circles."""
    found = [sectioned(vertices_mm, faces, angles) for angles in grid]
    return {name: np.array([one.quality(name) for one in found]) for name in MEASURES}


def contrast(minima: Floats, values: Floats) -> float:
    """Height of the second minimum as a plot shows it: (second - best) / (median - best).

    Of a landscape's ``values`` (infinite ones left out). Neither the unit nor an offset changes it; a ratio
    of two minima that are nearly zero means nothing. 1 where there is but one minimum.
    """
    if len(minima) < 2:
        return 1.0
    return float((minima[1] - minima[0]) / (np.median(values[np.isfinite(values)]) - minima[0]))


def _quality(vertices_mm: Floats, faces: Ints32, measure_name: str, angles: Floats) -> float:
    return sectioned(vertices_mm, faces, angles).quality(measure_name)


def _surfels(vertices_mm: Floats) -> tuple[Surfels, Floats]:
    """The default's patches, and the rotation from their frame to the mesh's."""
    cloud = canonical_cloud(vertices_mm, None)
    return surfels_of(*voxel_moments(cloud.points, cloud.weights)), cloud.rotation


def _meridian(patches: tuple[Surfels, Floats], angles: Floats) -> float:
    """The cost of the default's starts: how far normals miss the best axis of a direction."""
    surfels, rotation = patches
    direction = rotation.T @ direction_of(angles)
    place = _meeting_point(surfels, direction)
    return float(angle_cost(surfels.points, surfels.normals, surfels.weights, direction, place, WIDTH))


def _meeting_point(surfels: Surfels, direction: Floats) -> Floats:
    """The point nearest, in least absolute deviations, to the normals' lines seen along a direction."""
    across = np.cross(surfels.normals, direction)
    offset = np.einsum("ij,ij->i", across, surfels.points)
    weights = surfels.weights.copy()
    place = np.zeros(3)
    for _ in range(6):
        normal = (across * weights[:, None]).T @ across + 1e-9 * np.eye(3)
        place = np.linalg.solve(normal, across.T @ (weights * offset))
        weights = surfels.weights / (np.abs(across @ place - offset) + 0.03)
    return place


def measure(lab: Lab) -> Numbers:
    """Landscapes on both variants' scans of the wheel, and medians over draws of the paper's noise."""
    steps = 16 if lab.quick else 46
    grid = grid_of(steps)
    count = lab.repeats(DRAWS)
    found: dict[str, Floats] = {"steps": np.asarray(float(steps)), "draws": np.asarray(float(count))}
    pair = lab.pair("wheel")
    for name, scan in pair.items():
        found |= {f"{name}_{key}": value for key, value in _landscape(scan, scan.vertices_mm, grid).items()}
    scan = pair["default"]
    draws = [
        _landscape(scan, along_rays(scan.vertices_mm, PAPER_MM, seed=seed), grid) for seed in range(count)
    ]
    for name in (*MEASURES, "meridian"):
        found |= {f"noisy_{name}_{key}": value for key, value in _medians(name, draws).items()}
    return found


def _landscape(scan: Scanned, vertices: Floats, grid: Floats) -> dict[str, Floats]:
    """Every measure's values, minima and margins, and what the paper's are at the true axis."""
    truth = angles_of(scan.direction)
    at_truth = sectioned(vertices, scan.faces, truth)
    found: dict[str, Floats] = {"true": truth}
    for name, values in landscapes(vertices, scan.faces, grid).items():
        one = partial(_quality, vertices, scan.faces, name)
        found |= _entry(name, values, grid, scan, one)
        found[f"{name}_at_truth"] = np.asarray(at_truth.quality(name))
    meridian = partial(_meridian, _surfels(vertices))
    return found | _entry("meridian", np.array([meridian(angles) for angles in grid]), grid, scan, meridian)


def _medians(name: str, draws: Sequence[Mapping[str, Floats]]) -> dict[str, Floats]:
    """Of a measure over draws of noise; ``errors_deg`` and ``values`` are the best minimum's."""
    errors = np.array([float(draw[f"{name}_errors_deg"][0]) for draw in draws])
    keys = [key for key in _PER_DRAW if f"{name}_{key}" in draws[0]]
    return {
        **{key: np.median([draw[f"{name}_{key}"] for draw in draws]) for key in keys},
        "errors_deg": np.array([np.median(errors)]),
        "values": np.array([np.median([draw[f"{name}_values"][0] for draw in draws])]),
        "right": np.mean(errors < RIGHT_DEG),
    }


def _entry(key: str, values: Floats, grid: Floats, scan: Scanned, objective: Objective) -> dict[str, Floats]:
    minima = minima_of(values, grid)
    found = bottoms(objective, minima, grid, step_deg=90.0 / np.sqrt(len(grid)))
    return {
        key: values,
        f"{key}_count": np.asarray(float(len(minima.index))),
        f"{key}_minima": found[:, :2],
        f"{key}_values": found[:, 2],
        f"{key}_errors_deg": np.array([scan.error_deg(direction_of(row[:2])) for row in found]),
        f"{key}_contrast": np.asarray(contrast(found[:, 2], values)),
        f"{key}_grid_contrast": np.asarray(contrast(minima.values, values)),
    }
