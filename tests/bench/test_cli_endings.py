"""How a command ends: signals, full disks, odd encodings, errors of its own; never with a traceback."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from bench.checks.fuzz.sound import write_sound
from bench.cli import main, program
from bench.run.directory import load_run, unfinished
from burrscan.errors import InputError
from tests.bench.compare_runs import written_run
from tests.tiers import some_of

_CALL = "import sys; from bench.cli import main; sys.exit(main())"


def test_an_unexpected_error_is_neither_a_verdict_nor_a_page_of_code(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(_: object) -> int:
        raise KeyError("x")

    assert main(["-vv", "completion", "bash"]) == 0  # an earlier call that asked for everything
    capsys.readouterr()
    monkeypatch.setattr(program, "_run", broken)
    assert main(["suites"]) == 3
    assert "Traceback" not in capsys.readouterr().err


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), MemoryError()])
def test_the_machines_errors_end_with_2(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def broken(_: object) -> int:
        raise error

    monkeypatch.setattr(program, "_run", broken)
    assert main(["suites"]) == 2
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_full_disk_behind_standard_output_is_told() -> None:
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(  # noqa: S603
            [sys.executable, "-c", _CALL, "completion", "bash"],
            stdout=full,
            stderr=subprocess.PIPE,
            check=False,
        )
    assert done.returncode == 2
    assert done.stderr.splitlines() == [b"burrscan: No space left on device"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
@some_of("after_s", [0.15, 0.4, 0.9], first=2)
def test_a_signal_at_any_moment_ends_it_without_code(number: int, code: int, after_s: float) -> None:
    # what it reads never comes: it is still at work whenever the signal does
    wait = f"import sys, time; from bench.cli import main, program; print('up', flush=True)\n{_LATE}"
    process = subprocess.Popen(  # noqa: S603
        [sys.executable, "-c", wait], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(after_s)
    process.send_signal(number)
    _, err = process.communicate(timeout=30)
    assert process.returncode == code
    assert b"Traceback" not in err


_LATE = """
def late(arguments):
    import scipy.optimize, pydantic, trimesh
    while True:
        time.sleep(0.01)
program._run = late
sys.exit(main())
"""


def test_any_encoding_and_any_path(tmp_path: Path) -> None:
    odd = os.fsencode(tmp_path) + b"/\xff\xfe.toml"
    Path(os.fsdecode(odd)).write_text("name = 1\n")
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", _EACH, odd, b"/" + b"x" * 5000 + b".toml", b"a\xffb.toml"],
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        check=True,
        timeout=60,
    )
    assert done.stdout.splitlines()[-1] == b"[0, 2, 2, 2]", done.stderr
    assert b"Traceback" not in done.stderr


_EACH = """
import sys
from bench.cli import main
print([main(["show", "quick"]), *(main(["show", path]) for path in sys.argv[1:])])
"""


def test_a_foreign_runs_code_is_not_imported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "foreign_code.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    run = written_run(tmp_path / "run").directory
    table = json.loads(run.manifest.read_text())
    table["suite"]["metrics"] = ["foreign_code:metric"]
    run.manifest.write_text(json.dumps(table))
    for words in (["report"], ["leaderboard"], ["compare", str(run.path)], ["history", "coverage"]):
        if words[0] != "history":
            assert main([*words, str(run.path)]) == 2
            assert "--trust" in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


def test_a_captures_code_is_not_imported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "capture_code.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w').close()\n")
    write_sound(tmp_path)
    document = tmp_path / "capture" / "capture.json"
    table = json.loads(document.read_text())
    for scan in (
        {"method": "capture_code:go"},
        {"method": "fixed", "parameters": {"code": "capture_code:go"}},
    ):
        document.write_text(json.dumps({**table, "scan": scan}))
        assert main(["scan", str(tmp_path / "capture")]) == 2
        assert "--trust" in capsys.readouterr().err
    assert not (tmp_path / "ran").exists()


def test_showing_a_suite_imports_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    (tmp_path / "shown_code.py").write_text(
        f"open({str(tmp_path / 'ran')!r}, 'w').close()\ndef find(v, f, *, sigma_mm=None): ...\n"
    )
    (tmp_path / "s.toml").write_text(
        'name = "s"\n[scene]\nbase = "paper"\n[[variant]]\nname = "a"\naxis = "shown_code:find"\n'
    )
    assert main(["show", str(tmp_path / "s.toml")]) == 0
    assert not (tmp_path / "ran").exists()
    assert main(["show", str(tmp_path / "s.toml"), "--trust"]) == 0
    assert (tmp_path / "ran").exists()


def test_reserved_names_and_control_characters(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    suite = tmp_path / "s.toml"
    suite.write_text('name = "s"\n[scene]\nbase = "paper"\n[[variant]]\nname = "truth"\n')
    assert main(["show", str(suite)]) == 2
    assert "truth" in capsys.readouterr().err
    suite.write_text('name = "s"\ntitle = "\\u001b[31m"\n[scene]\nbase = "paper"\n[[variant]]\nname = "a"\n')
    assert main(["show", str(suite)]) == 2
    assert "U+001B" in capsys.readouterr().err


def test_a_damaged_run_is_refused_and_stops_no_other(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = written_run(tmp_path / "good").directory
    good.records.write_bytes(b"".join(good.records.read_bytes().splitlines(keepends=True)[:3]))
    bad = written_run(tmp_path / "bad").directory
    for text in ("[]", '{"case": 1}', '{"case": "x"', "\udcff"):
        bad.records.write_bytes(text.encode("utf-8", "surrogateescape") + b"\n")
        assert main(["report", str(bad.path)]) == 2
        assert "Traceback" not in capsys.readouterr().err
    assert unfinished(tmp_path, None) == good.path
    assert load_run(good.path).missing > 0


def test_a_record_that_lost_a_burr_is_refused(tmp_path: Path) -> None:
    run = written_run(tmp_path / "run", variant=[{"name": "mine"}, {"name": "yours"}])
    first, *others = run.records
    run.directory.records.write_text(
        "".join(record.line() for record in (replace(first, burrs=first.burrs * 2), *others))
    )
    with pytest.raises(InputError, match="1 true burrs in the record of yours"):
        load_run(run.directory.path)


def test_accepting_on_a_full_disk_leaves_no_half_baseline(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run = written_run(tmp_path / "run").directory

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("bench.baselines.store.append", full)
    assert main(["accept", str(run.path), "--baselines", str(tmp_path / "b")]) == 2
    assert "No space left" in capsys.readouterr().err
    assert not list((tmp_path / "b").glob("*/*"))


@pytest.mark.parametrize(
    "words",
    [
        ["render", "paper", "--out", "x", "--seed", "-1"],
        ["render", "paper", "--out", "x", "--boards", "1", "--square", "0"],
        ["render", "paper", "--out", "x", "--boards", "1", "--square", "nan"],
        ["calibrate", "arm", "--hand-eye", "--square", "1e300"],
        ["calibrate", "arm", "--hand-eye", "--square", "1e-300"],
        ["render", "paper", "--out", "x", "--boards", "1", "--board", "100000x100000"],
    ],
)
def test_options_are_bounded(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2
    assert "--" in capsys.readouterr().err


@pytest.mark.parametrize("rig", ["scale = 1e-9", "camera = {width = 16384, height = 16384, focal_px = 9e3}"])
def test_a_raster_that_cannot_be_traced_is_refused(
    rig: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.toml").write_text(f'wheel = "paper"\n[rig]\n{rig}\n')
    assert main(["render", str(tmp_path / "s.toml"), "--out", str(tmp_path / "out")]) == 2
    assert "can be traced" in capsys.readouterr().err
