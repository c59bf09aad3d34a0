"""A cell's part of the page: burrs found against looks, the looks around the wheel, before and after."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from markupsafe import Markup

from bench.plotting import pictures
from bench.plotting.axes import WIDTH, Axes
from bench.run import Run
from bench.suites.suite import CONDITION
from burrscan.arrays import Floats

_MOST_WHEELS = 3
"""Wheels whose path of looks is drawn."""
_ROUND_PX = 300.0
"""Height of that drawing."""


@dataclass(frozen=True)
class Removed:
    """A burr before and after, as pictures, and what is said and true of it."""

    case: str
    before: str
    after: str
    words: str


@dataclass(frozen=True)
class CellPart:
    """What the page shows of cells.

    Parameters
    ----------
    curves
        Title, drawing and legend (style class, words) of what grows with the looks.
    paths
        Case and drawing: the wheel from above, its burrs, and the looks in their order.
    removed
        Burrs that were milled off.

    """

    curves: tuple[tuple[str, Markup, tuple[tuple[str, str], ...]], ...]
    paths: tuple[tuple[str, Markup], ...]
    removed: tuple[Removed, ...]


def cell_part(run: Run) -> CellPart | None:
    """The cells of a run; None where it has none, or none that is done."""
    stories = [story for story in _stories(run) if story[2].get("looks")]
    if not stories:
        return None
    kinds = list(dict.fromkeys(kind for kind, _, _, _ in stories))
    legend = tuple((f"v{number}", kind) for number, kind in enumerate(kinds))
    most = max(story["most"] for _, _, story, _ in stories)
    curves = []
    for key, title in (("found", "burrs found, %"), ("coverage", "part measured, %")):
        axes = Axes((0.5, most + 0.5), (0.0, 104.0), "looks", title)
        lines = [
            axes.line(_grown([s for k, _, s, _ in stories if k == kind], key, most), f"curve v{number}")
            for number, kind in enumerate(kinds)
        ]
        words = f"Mean over the wheels: {title.split(',')[0]} against looks"
        curves.append((words, axes.svg(lines, words), legend))
    first = [entry for entry in stories if entry[0] == kinds[0]][:_MOST_WHEELS]
    return CellPart(
        tuple(curves),
        tuple((case, _path(story)) for _, case, story, _ in first),
        tuple(removed for _, case, story, folder in stories for removed in _removed(case, story, folder)),
    )


def _stories(run: Run) -> list[tuple[str, str, Mapping[str, Any], Path]]:
    """Planner, case, story and the stem of its files; those that cannot be read are left out."""
    found = []
    for record in run.records:
        folder = run.directory.case(record.case)
        file = folder / f"{record.variant}.cell.json"
        try:
            story = json.loads(file.read_text("utf-8"))
        except (OSError, ValueError):
            continue
        kind = str(record.parameters.get(CONDITION, story.get("planner", "")))
        found.append((kind, record.case, story, folder / record.variant))
    return found


def _grown(stories: Sequence[Mapping[str, Any]], key: str, most: int) -> Floats:
    """(most, 2) looks and the mean share in per cent; after the last look a share stays as it is."""
    rows = []
    for story in stories:
        values = [float(look[key] or 0.0) for look in story["looks"]]
        rows.append(values + values[-1:] * (most - len(values)))
    return np.stack([np.arange(1.0, most + 1.0), 100.0 * np.mean(rows, axis=0)], axis=1)


def _path(story: Mapping[str, Any]) -> Markup:
    """The wheel from above: what is left to find around it, and the looks with numbers."""
    middle = np.array([WIDTH / 2.0, _ROUND_PX / 2.0])
    left = np.mean(np.array(story["chart"]["left"], float), axis=0)
    parts = [_ring(middle, 62.0, left)]
    for number, look in enumerate(story["looks"], 1):
        # the table turns the part; seen from the part, the camera goes round the other way
        angle = np.radians(180.0 - float(look["turn_deg"]))
        away = 128.0 - 0.55 * float(look["elevation_deg"])
        eye = middle + away * np.array([np.cos(angle), -np.sin(angle)])
        foot = middle + 70.0 * np.array([np.cos(angle), -np.sin(angle)])
        parts.append(
            Markup(
                '<line class="curve v0" x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}"/>'
                '<circle class="dot v0" cx="{:.1f}" cy="{:.1f}" r="9"/>'
                '<text class="tick x" x="{:.1f}" y="{:.1f}" style="fill:#fff">{}</text>'
            ).format(*eye, *foot, *eye, eye[0], eye[1] + 3.5, f"{number}{'′' if look['roll_deg'] else ''}")
        )
    return Markup(
        '<svg class="plot" viewBox="0 0 {w:g} {h:g}" role="img" aria-label="The looks around the wheel">'
        "{body}</svg>"
    ).format(w=WIDTH, h=_ROUND_PX, body=Markup("").join(parts))


def _ring(middle: Floats, radius: float, left: Floats) -> Markup:
    """A ring around the wheel, the darker the more may be left there."""
    count = len(left)
    pieces = []
    for number, share in enumerate(left):
        ends = 2.0 * np.pi * (np.array([number, number + 1.1])) / count
        a, b = (middle + radius * np.array([np.cos(end), -np.sin(end)]) for end in ends)
        pieces.append(
            Markup(
                '<path d="M{:.1f} {:.1f}A{r:g} {r:g} 0 0 0 {:.1f} {:.1f}" fill="none" stroke="currentColor" '
                'stroke-width="12" stroke-opacity="{o:.2f}"/>'
            ).format(*a, *b, r=radius, o=0.08 + 0.85 * float(share))
        )
    return Markup("").join(pieces)


def _removed(case: str, story: Mapping[str, Any], stem: Path) -> list[Removed]:
    """Burrs with both pictures."""
    found = []
    for number, removal in enumerate(story["removals"], 1):
        shots = [_shot(stem, f"burr-{number}-{when}") for when in ("before", "after")]
        if all(shots):
            found.append(Removed(case, shots[0], shots[1], _words(removal)))
    return found


def _shot(stem: Path, name: str) -> str:
    """A picture as the page holds it; empty where there is none."""
    file = stem.with_name(f"{stem.name}.{name}.png")
    image = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE) if file.is_file() else None
    return "" if image is None else pictures.photo(np.asarray(image, np.uint8))


def _words(removal: Mapping[str, Any]) -> str:
    def mm(key: str) -> str:
        value = removal.get(key)
        return "–" if value is None else f"{value:.3f} mm"

    return (
        f"{removal['looks']} looks to reach it, the mill truly off by {mm('off_mm')}; left over "
        f"{mm('residual_mm')} (said: {mm('said_residual_mm')}), gouge {mm('gouge_mm')}"
    )
