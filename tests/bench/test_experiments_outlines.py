"""Suites of wheels that nobody has looked at: can they be run, are they the seed's, and are they alike?"""

from __future__ import annotations

from pathlib import Path

import pytest

from bench.experiments import outlines
from bench.suites.cases import expand
from bench.suites.catalogue import load_suite
from burrscan.errors import InputError
from scenes.scene import scene_from
from scenes.wheel import build_wheel


def test_a_design_is_a_suite_whose_scenes_can_be_made(tmp_path: Path) -> None:
    path = tmp_path / "unseen.toml"
    path.write_text(outlines.suite(3, 6))
    cases = expand(load_suite(str(path)), seed=0)
    assert len(cases) == 6
    scenes = [scene_from(case.document, source=case.id) for case in cases]
    assert len({str(scene.wheel.generatrix) for scene in scenes}) == 6
    assert len({str(scene.finish) for scene in scenes}) > 3
    burrs = [burr for scene in scenes for burr in build_wheel(scene.wheel, scene.burr).burrs]
    assert len(burrs) >= 3
    assert all(0.28 < burr.height_mm < 2.4 for burr in burrs)  # a course varies about its height


def test_the_seed_is_the_design(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert outlines.suite(4, 2) == outlines.suite(4, 2) != outlines.suite(5, 2)
    path = tmp_path / "unseen.toml"
    monkeypatch.setattr("sys.argv", ["outlines", "--seed", "4", "--wheels", "2", "--out", str(path)])
    outlines.main()
    assert path.read_text() == outlines.suite(4, 2)
    assert f"{path}: 2 wheels" in capsys.readouterr().out


def test_what_cannot_be_made_is_drawn_again_and_in_the_end_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    plain, tries = outlines.suite(4, 1), []

    def refused_twice(*args: object) -> object:
        tries.append(args)
        if len(tries) <= 2:
            raise InputError("does not fit")
        return build_wheel(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(outlines, "build_wheel", refused_twice)
    assert outlines.suite(4, 1) != plain
    assert len(tries) >= 3
    monkeypatch.setattr(outlines, "build_wheel", lambda *_: (_ for _ in ()).throw(InputError("never")))
    with pytest.raises(InputError, match="none could be made"):
        outlines.suite(4, 1)
