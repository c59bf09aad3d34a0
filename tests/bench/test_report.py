"""The report is one file that stands alone, says what the records say, and shows what there is."""

from __future__ import annotations

import base64
import html.parser
import json
import re
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from bench.plotting import pictures
from bench.plotting.axes import Axes, round_up, ticks
from bench.report import build_report, charts, summary
from bench.report.cases import burr_tables
from bench.report.page import MOST_PICTURED
from bench.run import load_run
from burrscan import InputError
from tests.bench.report_run import drum, made_up_run

SECTIONS = (
    "what", "verdict", "difference", "detection", "where", "cases", "speed", "read", "provenance",
)  # fmt: skip
VOID = {"meta", "img", "br", "hr", "link", "input"}


class Page(html.parser.HTMLParser):
    """Ids, links, pictures and words of a page; fails when a tag is left open or closed twice."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.ids: list[str] = []
        self.references: list[str] = []
        self.pictures: list[str] = []
        self.words = ""
        self.solids: list[dict[str, Any]] = []
        self._open: list[str] = []
        self.feed(text)
        self.close()
        assert not self._open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        if given.get("id"):
            self.ids.append(str(given["id"]))
        for name in ("href", "src"):
            value = given.get(name)
            if value is not None:
                (self.references if tag == "a" else self.pictures).append(value)
        if tag not in VOID:
            self._open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open[-1:] == ["script"] and data.startswith("{"):
            self.solids.append(json.loads(data))
        elif self._open[-1:] != ["script"]:
            self.words += data


def decoded(uri: str) -> NDArray[np.uint8]:
    data = np.frombuffer(base64.b64decode(uri.partition(",")[2]), np.uint8)
    image = cv2.imdecode(data, cv2.IMREAD_UNCHANGED)
    assert image is not None
    return np.asarray(image, np.uint8)


@pytest.fixture(scope="module")
def page_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_report(made_up_run(tmp_path_factory.mktemp("run"), fail=True))


@pytest.fixture(scope="module")
def page(page_file: Path) -> Page:
    return Page(page_file.read_text("utf-8"))


def test_the_page_lies_beside_the_records(page_file: Path) -> None:
    assert page_file.name == "report.html"
    assert (page_file.parent / "records.jsonl").exists()
    assert not list(page_file.parent.glob("*.tmp*"))


def test_every_section_is_there_once_and_every_link_leads_somewhere(page: Page) -> None:
    assert set(SECTIONS) | {"failures"} <= set(page.ids)
    assert len(page.ids) == len(set(page.ids))
    assert {link.removeprefix("#") for link in page.references} <= set(page.ids)


def test_nothing_is_loaded_from_outside(page_file: Path, page: Page) -> None:
    text = re.sub(r'"data:[^"]*"', "", page_file.read_text("utf-8"))
    assert all(picture.startswith("data:image/webp;base64,") for picture in page.pictures)
    assert not re.search(r"https?:|@import|<script src|<link|fetch\(|import\(", text)


def test_the_worst_cases_have_their_pictures(page: Page) -> None:
    # a case: white, true map, a still for the 3D view of each side; a side: camera, pixels, depth, map, mask
    shared, fixed, adaptive = 2, 5, 6
    lost = fixed  # one case of 'fixed' failed and kept nothing
    assert len(page.pictures) == MOST_PICTURED * (shared + fixed + adaptive) - lost
    for picture in page.pictures:
        assert decoded(picture).size > 0


def test_the_packed_mesh_is_the_mesh(page: Page) -> None:
    view = page.solids[1]
    mesh = view["meshes"][0]
    data = np.frombuffer(zlib.decompress(base64.b64decode(mesh["data"])), np.uint8)
    places, faces, values = unpacked(data, mesh["v"], mesh["f"])
    true = drum()
    size = float(np.ptp(true["mesh_mm"], axis=0).max())
    assert places / 4095 * size + true["mesh_mm"].min(axis=0) == pytest.approx(
        true["mesh_mm"], abs=size / 8000
    )
    assert np.array_equal(faces, true["mesh_faces"])
    known = np.clip(true["mesh_values_mm"].astype(float), -0.5, 0.5)
    assert (values / 254.0 - 0.5) == pytest.approx(known, abs=0.003)
    assert len(base64.b64decode(view["ramp"])) == 41 * 3
    assert np.array(view["view"]).reshape(3, 3) @ np.array(view["view"]).reshape(3, 3).T == pytest.approx(
        np.eye(3), abs=1e-4
    )


def unpacked(data: NDArray[np.uint8], vertices: int, faces: int) -> tuple[Any, Any, Any]:
    """What the page's script reads of a packed mesh."""

    def columns(at: int, count: int) -> NDArray[np.int64]:
        low, high = data[at : at + 3 * count].astype(int), data[at + 3 * count : at + 6 * count].astype(int)
        steps = (low | high << 8).astype(np.uint16).view(np.int16).reshape(3, count)
        return np.cumsum(steps, axis=1).T

    end = 6 * (vertices + faces)
    return columns(0, vertices), columns(6 * vertices, faces), data[end : end + vertices].astype(float)


def test_headings_carry_units(page: Page) -> None:
    for heading in ("Coverage, %", "Depth RMS, mm", "Axis angle, deg", "False calls", "scan, s"):
        assert heading in page.words


def test_failures_are_listed_and_escaped(page: Page) -> None:
    assert "1 result is missing" in page.words
    assert "ValueError: <no light> reached the camera" in page.words
    assert "A made-up run, for <tests> & looks" in page.words


def test_the_verdict_counts_what_the_records_say(tmp_path: Path) -> None:
    run = load_run(made_up_run(tmp_path / "run", pictures=False))
    sentence = summary.verdict(run.records, ["fixed", "adaptive"])
    fixed, adaptive = (np.mean([0.41, 0.55, 0.97]) - 0.005, np.mean([0.93, 0.91, 0.975]) - 0.005)
    assert sentence == (
        f"adaptive measures {100 * adaptive:.1f} % of the measurable pixels, "
        f"{100 * (adaptive - fixed):.1f} points more than fixed, and is ahead in 6 of 6 cases; "
        "it finds 6 of 6 burrs (fixed: 4), with 0 false calls a case (fixed: 0.3)."
    )
    alone = summary.verdict(run.records, ["fixed"])
    assert "finds 4 of 6 burrs in 6 cases" in alone


def test_a_failed_case_counts_its_burrs_as_missed(tmp_path: Path) -> None:
    records = load_run(made_up_run(tmp_path / "run", fail=True, pictures=False)).records
    there = summary.true_burrs(records)
    assert summary.burrs_found(summary.of_variant(records, "fixed"), there) == (4, 6)
    assert "(fixed: 4)" in summary.verdict(records, ["fixed", "adaptive"])


def test_a_run_without_pictures_or_end_still_has_a_page(tmp_path: Path) -> None:
    page = Page(build_report(made_up_run(tmp_path / "run", pictures=False, stop_after=2)).read_text("utf-8"))
    assert "8 of 12 results are still to come" in page.words
    assert "No pictures were kept" in page.words
    empty = Page(build_report(made_up_run(tmp_path / "empty", stop_after=0)).read_text("utf-8"))
    assert "No case has ended yet" in empty.words


def test_a_damaged_picture_file_is_left_out(tmp_path: Path) -> None:
    run = made_up_run(tmp_path / "run", stop_after=1)
    (run / "cases" / "finish=polished,seed=0" / "fixed.npz").write_bytes(b"PK\x03\x04 torn")
    page = Page(build_report(run).read_text("utf-8"))
    assert len(page.pictures) == 2 + 6
    assert "8 of 12" not in page.words


def test_no_run_no_page(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="not a run directory"):
        build_report(tmp_path)


def test_burr_tables_tell_missed_from_failed(tmp_path: Path) -> None:
    records = load_run(made_up_run(tmp_path / "run", fail=True, pictures=False)).records
    verdicts = [burr_tables(records[i : i + 2])[0].rows[0].cells[0].text for i in (0, 2, 4)]
    assert verdicts == ["failed", "✗ missed, 40 % measured", "✓ found, 55 % measured"]


@pytest.mark.parametrize(
    ("known", "said"),
    [
        ({"visible_mm": 0.0, "measurable_mm": 0.0, "covered_mm": 0.0}, "✗ missed, out of view"),
        ({"measurable_mm": 4.0, "covered_mm": 4.0}, "✗ missed, dark or shadowed, 40 % measured"),
        ({"covered_mm": 1.0}, "✗ missed, mirrored light, 10 % measured"),
        ({"covered_mm": 9.0}, "✗ missed, 90 % measured"),
        ({"covered_mm": 9.0, "located": True}, "✗ wrong side, 90 % measured"),
    ],
)
def test_a_missed_burr_says_why(tmp_path: Path, known: dict[str, Any], said: str) -> None:
    record = load_run(made_up_run(tmp_path / "run", pictures=False)).records[0]
    seen = {"visible_mm": 10.0, "measurable_mm": 10.0, "covered_mm": 10.0, "found": False, "dprime": 812.3}
    (table,) = burr_tables([replace(record, burrs=({**record.burrs[0], **seen, **known},))])
    cells = {row.title: row.cells[0].text for row in table.rows}
    assert cells["Found"] == said
    assert cells["Detectability d'"] == "812"


def test_a_signed_map_is_white_at_zero_blue_below_red_above_and_clear_where_unknown() -> None:
    values = np.array([[-2.0, -1.0, 0.0, 1.0, 2.0, np.nan]])
    pixels = decoded(pictures.signed_map(values, 1.0))[0]
    rgb = pixels[:, 2::-1].astype(int)
    assert pixels[:, 3].tolist() == [255] * 5 + [0]
    assert tuple(rgb[2]) == pictures.BLUE_WHITE_RED[2]
    assert tuple(rgb[0]) == tuple(rgb[1]) == pictures.BLUE_WHITE_RED[0]
    assert tuple(rgb[3]) == tuple(rgb[4]) == pictures.BLUE_WHITE_RED[-1]


def test_axes_put_values_where_their_ticks_are() -> None:
    axes = Axes((0.0, 10.0), (-1.0, 1.0), "x, mm", "y, mm")
    assert axes.px(0.0) < axes.px(5.0) < axes.px(10.0)
    assert axes.py(1.0) < axes.py(-1.0)
    assert axes.px(5.0) == pytest.approx((axes.px(0.0) + axes.px(10.0)) / 2)
    assert ticks(-0.31, 0.52) == pytest.approx([-0.2, 0.0, 0.2, 0.4])
    assert [round_up(value) for value in (0.011, 0.2, 3.0, 70.0)] == pytest.approx([0.02, 0.2, 5.0, 100.0])


def test_a_curve_lifts_the_pen_at_gaps_and_keeps_its_corners() -> None:
    axes = Axes((0.0, 10.0), (0.0, 10.0), "", "")
    straight = np.column_stack([np.linspace(0, 4, 500), np.linspace(0, 4, 500)])
    corner = np.array([[5.0, 0.0], [6.0, 5.0], [7.0, 0.0]])
    path = axes.line(np.vstack([straight, [[np.nan, np.nan]], corner]), "curve")
    assert path.count("M") == 2
    assert path.count("L") == 1 + 2


def test_the_generatrix_error_is_the_distance_along_the_normal_outwards() -> None:
    true = np.array([[-10.0, 0.0], [-10.0, 50.0], [10.0, 60.0], [10.0, 0.0]])
    normal = np.array([-10.0, 20.0]) / np.hypot(10.0, 20.0)
    found = np.array([[0.0, 55.0] + 0.02 * normal, [np.nan, np.nan], [0.0, 55.0] - 0.01 * normal])
    assert charts.error_um(found, true) == pytest.approx([20.0, np.nan, -10.0], abs=1e-3, nan_ok=True)


def test_an_angle_is_drawn_in_the_turn_that_the_map_shows() -> None:
    assert charts.turned_into((-171.0, -169.0), (120.0, 250.0)) == (189.0, 191.0)
    assert charts.turned_into((350.0, 352.0), (-60.0, 60.0)) == (-10.0, -8.0)


def test_a_single_variant_without_a_sweep_has_a_page(tmp_path: Path) -> None:
    run = made_up_run(tmp_path / "run", stop_after=1)
    manifest = json.loads((run / "run.json").read_text("utf-8"))
    manifest["suite"] |= {"variant": [{"name": "adaptive", "scan": "adaptive"}], "sweep": {}}
    manifest["cases"] = manifest["cases"][:1]
    (run / "run.json").write_text(json.dumps(manifest), "utf-8")
    page = Page(build_report(run).read_text("utf-8"))
    assert "adaptive measures 93.0 % of the measurable pixels and finds 1 of 1 burr in 1 case." in page.words
    assert "The suite sweeps nothing" in page.words
    assert len(page.pictures) == 2 + 6


def test_a_burr_found_at_no_angle_is_left_out_of_the_map(tmp_path: Path) -> None:
    """A ring has none."""
    run = made_up_run(tmp_path / "run", stop_after=1)
    kept = next(run.rglob("adaptive.npz"))
    with np.load(kept) as arrays:
        ring = {**arrays, "burr_angle_deg": np.array([np.nan], np.float32)}
    np.savez_compressed(kept, **ring)
    assert build_report(run).exists()


def test_a_long_index_of_cases_is_packed_and_whole(tmp_path: Path) -> None:
    folder = made_up_run(tmp_path / "run", pictures=False, seeds=9)
    page = build_report(folder).read_text("utf-8")
    (packed,) = re.findall(r'<details class="index" data-packed="([^"]+)">', page)
    table = Page(zlib.decompress(base64.b64decode(packed)).decode())
    for record in load_run(folder).records:
        assert record.case.replace(",", ", ") in table.words


def test_a_run_that_names_no_version_of_ours_has_a_page(tmp_path: Path) -> None:
    run = made_up_run(tmp_path / "run", stop_after=1)
    manifest = json.loads((run / "run.json").read_text("utf-8"))
    for session in manifest["sessions"]:
        session["versions"] = {}
    (run / "run.json").write_text(json.dumps(manifest), "utf-8")
    assert "<dt>burrscan</dt><dd>unknown" in build_report(run).read_text("utf-8")


def test_a_record_of_another_case_is_refused(tmp_path: Path) -> None:
    run = made_up_run(tmp_path / "run", stop_after=1)
    records = (run / "records.jsonl").read_text("utf-8")
    (run / "records.jsonl").write_text(records.replace('"finish":"polished"', '"fjnish":"polished"'), "utf-8")
    with pytest.raises(InputError, match="has other parameters"):
        build_report(run)


@pytest.mark.parametrize("key", ["parameters", "scene_hash", "identity"])
def test_a_case_without_all_that_the_page_shows_is_refused(tmp_path: Path, key: str) -> None:
    run = made_up_run(tmp_path / "run", stop_after=1)
    manifest = json.loads((run / "run.json").read_text("utf-8"))
    del manifest["cases"][0][key]
    (run / "run.json").write_text(json.dumps(manifest), "utf-8")
    with pytest.raises(InputError, match=key):
        build_report(run)
