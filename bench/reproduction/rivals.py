"""The rivals the paper names, on the same meshes: one view, and the whole wheel."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from bench.reproduction.frames import Mesh, searches
from bench.reproduction.lab import Lab
from bench.reproduction.noise import PAPER_MM, along_rays
from bench.reproduction.parts import Claim, Numbers, Section, Table, middle_half, verdict
from bench.reproduction.scanned import Scanned
from burrscan.arrays import Bools, Floats, Ints32
from burrscan.axis import find_axis
from burrscan.inspection import Axis
from burrscan.pose import placed

METHODS = {
    "seed": "the paper's",
    "line-complex": "[5, 6] Pottmann, Lee, Randrup: line complex",
    "line-complex-robust": "[5, 6] reweighted",
    "orriols": "[13] Orriols et al.: frusta, maximum likelihood",
    "qian-huang": "[14] Qian, Huang: constant curvature",
    "seed-mended": "the paper's idea mended",
    "profile": "default",
}
SPINS_DEG = (0.0, 60.0, 120.0, 180.0, 240.0, 300.0)
"""Views that cover the whole wheel, each with its own sixth."""
KINDS = ("one view", "whole wheel", "one view, noisy", "whole wheel, noisy")
FRAMES = 20
"""Random frames of each kind, each with a draw of noise of its own where there is noise."""
_ALONG = np.array([0.0, 0.0, 1.0])
"""The true axis, in the part frame."""


def whole(views: list[Scanned], *, noise_mm: float = 0.0, draw: int = 0) -> Mesh:
    """Views at their true poses as one mesh in the part frame, each cut to its own sector of the turn.

    So the surface is covered all around and once: [14] takes differences of normals between neighbours on a
    section, which sheets that overlap would spoil.
    """
    points, faces, start = [], [], 0
    for number, view in enumerate(views):
        T = view.arrays["T_part_camera"]
        moved = along_rays(view.vertices_mm, noise_mm, seed=number + len(views) * draw)
        points.append(placed(T, moved))
        faces.append(view.faces[_in_sector(view, 360.0 / len(views))[view.faces].all(axis=1)] + start)
        start += len(points[-1])
    return np.concatenate(points), np.concatenate(faces).astype(np.int32)


def _in_sector(view: Scanned, width_deg: float) -> Bools:
    """Which vertices (V,) lie within a sector of the turn about the middle of what the view sees."""
    turn = np.exp(1j * np.arctan2(view.part_mm[:, 1], view.part_mm[:, 0]))
    return np.asarray(np.abs(np.degrees(np.angle(turn / turn.mean()))) <= width_deg / 2.0)


def measure(lab: Lab) -> Numbers:
    """Errors in random frames, and median processor time, of every method on every kind of mesh."""
    views = [lab.scan("wheel", "adaptive", spin_deg=spin) for spin in SPINS_DEG]
    quiet = [whole(views[:1]), whole(views)]
    runs = 1 if lab.quick else FRAMES
    errors = np.full((len(METHODS), len(KINDS), runs), np.nan)
    seconds = np.full(errors.shape[:2], np.nan)
    for row, method in enumerate(METHODS):
        drawn: list[Mesh | Callable[[int], Mesh]] = [
            *quiet,
            lambda k: whole(views[:1], noise_mm=PAPER_MM, draw=k),
            lambda k: whole(views, noise_mm=PAPER_MM, draw=k),
        ]
        for column, mesh_of in enumerate(drawn):
            found = list(searches(partial(_found, method), mesh_of, runs, stream=3))
            errors[row, column] = [search.error_deg(_ALONG) for search in found]
            seconds[row, column] = np.median([search.seconds for search in found])
    return {"errors": errors, "seconds": seconds, "triangles": np.array([len(mesh[1]) for mesh in quiet])}


def _found(method: str, vertices_mm: Floats, faces: Ints32, *, seed: int) -> Axis:
    """By a method's name; only the seed's draws samples."""
    own = {"seed": seed} if method == "seed" else {}
    return find_axis(vertices_mm, faces, method=method, **own)


def draw(n: Numbers) -> Section:
    """One table of errors and times."""
    errors, seconds = n["errors"], n["seconds"]
    place = {name: k for k, name in enumerate(METHODS)}
    rows = tuple(
        (title, *(_words(values) for values in errors[k]), f"{seconds[k, 0]:.2f} s", f"{seconds[k, 1]:.2f} s")
        for k, title in enumerate(METHODS.values())
    )
    seed, qian, best = (errors[place[name]] for name in ("seed", "qian-huang", "profile"))
    partial, around, *noisy = (float(np.median(of)) for of in qian)
    frusta, own = seconds[place["orriols"], 0], seconds[place["seed"], 0]
    needs = [partial > 2.0 and partial > 3.0 * around, noisy[0] > 2.0 and noisy[0] > 3.0 * noisy[1]]
    wins = [float(np.median(seed[k])) < float(np.median(qian[k])) for k in (0, 2)]
    first, second = (f"{count:,}" for count in n["triangles"][:2])
    return Section(
        title="The rivals",
        reports="[14] needs data all around the surface; [13] seems too complex for online use; [5, 6] "
        "need a generalized eigenvalue problem. The paper's own method is for partial data.",
        measured=f"One view of the default scanner ({first} triangles), and six views at their true poses, "
        f"each cut to its own sector ({second}); also with {PAPER_MM:g} mm of noise. {errors.shape[2]} "
        "random frames, noise drawn anew in each, median and middle half. "
        f"[14]: {_words(qian[0])} on one view, {_words(qian[1])} on the whole wheel: a circle cut askew by "
        "an angle α is an ellipse whose curvature varies by 3/2 α² only, and a "
        f"short arc shows less of it. The paper's own method: {_words(seed[0])} and {_words(seed[1])}.",
        claims=(
            Claim(
                "1",
                "[14] needs data sampled all around: partial data are not enough",
                "not for partial data",
                f"one view {_words(qian[0])}, all around {_words(qian[1])}; with {PAPER_MM:g} mm of noise "
                f"{_words(qian[2])} and {_words(qian[3])}",
                f"{_words(best[0])}, {_words(best[1])}",
                verdict(needs),
                "beyond 2° and three times what it reaches all around counts. That is [14]'s test of "
                "curvature in our hands, on smoothed normals an eighth of the section apart, not its "
                "authors' "
                "code",
            ),
            Claim(
                "1",
                "the paper's method is the better one on partial data",
                "better than [14]",
                f"{_words(seed[0])} against {_words(qian[0])}; with {PAPER_MM:g} mm of noise "
                f"{_words(seed[2])} against {_words(qian[2])}",
                _words(best[0]),
                verdict(wins),
                ""
                if all(wins)
                else f"without noise {'it is' if wins[0] else 'it is not'}, with noise "
                f"{'it is' if wins[1] else 'it is not'}. Where nothing is noisy only the "
                "seed, whose starts are a grid in the frame, varies between frames",
            ),
            Claim(
                "1",
                "[13] seems too complex for online use",
                "too complex",
                f"[13] {frusta:.2f} s, {_words(errors[place['orriols']][0])}; the paper's {own:.2f} s",
                f"{seconds[place['profile'], 0]:.2f} s",
                "partly",
                "the paper gives no figure, and says itself that [13] does not discuss its complexity. Our "
                "port starts from the answer of [5, 6] and stands voxel means for the points, so neither its "
                f"rounds nor its cost are those of 2000; like this it takes {frusta / own:.1f} times the "
                "seed's time",
            ),
        ),
        tables=(Table(("method", *KINDS, "time, one view", "time, whole"), rows),),
    )


def _degrees(value: float) -> str:
    return f"{value:.0f}°" if value >= 10.0 else f"{value:.2g}°"


_words = partial(middle_half, say=_degrees)
