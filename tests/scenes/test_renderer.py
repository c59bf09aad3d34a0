"""The choice of the variant, against libraries that work, that are refused, and that kill the process."""

import dataclasses
import importlib
import json
import logging
import os
import platform
import shutil
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from burrscan import InputError
from scenes import renderer
from scenes.renderer import activation, cache, choice, libraries, probe, threads
from scenes.renderer.libraries import Library

ABORTING = """
#include <stdlib.h>
__attribute__((constructor)) static void die(void) { abort(); }
"""


@pytest.fixture(autouse=True)
def own_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A fresh probe cache, and none of the steering variables."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.delenv(choice.VARIANT_VARIABLE, raising=False)
    monkeypatch.delenv(libraries.PATH_VARIABLE, raising=False)
    activation._warn_once.cache_clear()
    return tmp_path / "cache"


@pytest.fixture
def no_cuda(monkeypatch: pytest.MonkeyPatch) -> None:
    missing = probe.Probe("cuda", "", "", "missing", "no NVIDIA driver or device on this machine")
    monkeypatch.setattr(choice, "probe_cuda", lambda: missing)


@pytest.fixture
def no_system_libraries(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(libraries, "_folders", lambda: iter(()))


def aborting_library(folder: Path) -> Path:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if not compiler:
        pytest.skip("no C compiler to plant an aborting library with")
    source = folder / "die.c"
    source.write_text(ABORTING, "utf-8")
    library = folder / "libLLVM-99.so"
    subprocess.run([compiler, "-shared", "-fPIC", "-o", library, source], check=True)  # noqa: S603
    return library


@pytest.mark.usefixtures("no_cuda", "no_system_libraries")
def test_an_aborting_library_leaves_this_process_alive_and_the_scalar_variant(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
) -> None:
    monkeypatch.setenv(libraries.PATH_VARIABLE, str(aborting_library(tmp_path)))
    chosen = renderer.choose()
    assert chosen.variant == "scalar_rgb"
    assert not chosen.vectorised
    (_, verdict) = chosen.probes
    assert verdict.verdict == "aborted"
    assert "SIGABRT" in verdict.detail
    monkeypatch.setattr(importlib, "import_module", lambda _: FakeMitsuba())
    with caplog.at_level(logging.WARNING):
        renderer.activate()
        renderer.activate()
    (record,) = caplog.records
    assert "scalar_rgb" in record.getMessage()
    assert "\n" not in record.getMessage()
    assert "LLVM 99 aborted" in record.getMessage()


class FakeMitsuba:
    """Stands for both mitsuba and drjit, to leave the variant of the test process alone."""

    chosen: str | None = None

    def variant(self) -> str | None:
        return self.chosen

    def set_variant(self, name: str) -> None:
        self.chosen = name

    def set_thread_count(self, count: int) -> None:
        assert count >= 1


@pytest.mark.parametrize("content", [b"", b"not a library", None])
def test_a_file_that_is_no_library_is_refused_or_missing(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "libLLVM-21.so"
    if content is not None:
        path.write_bytes(content)
    verdict = probe.probe_llvm(Library(path, 21))
    assert verdict.verdict == ("missing" if content is None else "refused")
    assert verdict.detail
    assert "\n" not in verdict.detail


def test_the_real_libraries_get_their_known_verdicts() -> None:
    """LLVM 14 is too old for Dr.Jit 1.5; 15 cannot select fminimum on x86; 19 works."""
    if platform.machine() != "x86_64":
        pytest.skip("the verdicts are known for x86-64")
    known = {14: "refused", 15: "aborted", 19: "ran"}
    verdicts = {
        library.major: probe.probe_llvm(library).verdict
        for library in libraries.candidates()
        if library.major in known
    }
    if not verdicts:
        pytest.skip("none of LLVM 14, 15 and 19 is installed")
    assert verdicts == {major: known[major] for major in verdicts}


def test_a_result_is_asked_for_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "libLLVM-21.so"
    path.write_bytes(b"one")
    monkeypatch.setattr(probe, "_ask", lambda question: dataclasses.replace(question, verdict="ran"))
    first = probe.probe_llvm(Library(path, 21))
    monkeypatch.setattr(probe, "_ask", lambda _: pytest.fail("asked again"))
    assert probe.probe_llvm(Library(path, 21)) == first


def test_another_file_under_the_same_name_is_asked_anew(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "libLLVM-21.so"
    answers = iter(["aborted", "ran"])
    monkeypatch.setattr(probe, "_ask", lambda question: dataclasses.replace(question, verdict=next(answers)))
    path.write_bytes(b"one")
    assert probe.probe_llvm(Library(path, 21)).verdict == "aborted"
    path.write_bytes(b"three")
    assert probe.probe_llvm(Library(path, 21)).verdict == "ran"


def test_a_time_out_is_not_remembered(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "libLLVM-21.so"
    path.write_bytes(b"one")
    answers = iter(["timed out", "ran"])
    monkeypatch.setattr(probe, "_ask", lambda question: dataclasses.replace(question, verdict=next(answers)))
    assert probe.probe_llvm(Library(path, 21)).verdict == "timed out"
    assert probe.probe_llvm(Library(path, 21)).verdict == "ran"


def test_what_was_refused_is_asked_anew_since_what_it_lacked_may_be_there_now(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "libLLVM-21.so"
    path.write_bytes(b"one")
    assert probe.probe_llvm(Library(path, 21)).verdict == "refused"
    monkeypatch.setattr(probe, "_ask", lambda question: dataclasses.replace(question, verdict="ran"))
    assert probe.probe_llvm(Library(path, 21)).verdict == "ran"


@pytest.mark.parametrize(
    "damage", [b"", b"{", b"\xff\xfe", b"[]", b'{"key": {"a": 1}}', b'{"key": {"a": 2}, "value": {}}']
)
def test_a_damaged_cache_file_is_a_miss(damage: bytes) -> None:
    key = {"a": 1}
    cache.store(key, {"b": 2})
    assert cache.load(key) == {"b": 2}
    (file,) = cache.folder().iterdir()
    file.write_bytes(damage)
    assert cache.load(key) is None
    cache.store(key, {"b": 3})
    assert cache.load(key) == {"b": 3}


def test_a_cache_from_another_layout_is_asked_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "libLLVM-21.so"
    path.write_bytes(b"one")
    monkeypatch.setattr(cache, "load", lambda _: {"unknown": "field"})
    assert probe.probe_llvm(Library(path, 21)).verdict == "refused"


def test_a_cache_that_cannot_be_written_costs_nothing_but_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_bytes(b"")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    cache.store({"a": 1}, {"b": 2})
    assert cache.load({"a": 1}) is None


def test_many_writers_leave_one_whole_file() -> None:
    values = [{"b": "x" * 5000 + str(index)} for index in range(40)]
    with ThreadPoolExecutor(8) as pool:
        list(pool.map(lambda value: cache.store({"a": 1}, value), values))
    assert cache.load({"a": 1}) in values
    assert len(list(cache.folder().iterdir())) == 1


def test_the_environment_overrides_the_choice(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(choice.VARIANT_VARIABLE, "scalar_rgb")
    chosen = renderer.choose()
    assert chosen.variant == "scalar_rgb"
    assert choice.VARIANT_VARIABLE in chosen.reason


@pytest.mark.parametrize(
    ("variant", "says"), [("llvm_mono", "llvm_ad_mono"), ("llvm_ad_rgb", r"cannot run here \(no libLLVM")]
)
@pytest.mark.usefixtures("no_system_libraries")
def test_an_override_that_cannot_run_is_refused(
    variant: str, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv(choice.VARIANT_VARIABLE, variant)
    with pytest.raises(InputError, match=says):
        renderer.choose()
    assert renderer.doctor().variant is None


def test_the_users_library_comes_first_then_the_newest_and_links_count_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = [
        "libLLVM-14.so.1", "libLLVM.so.19.1", "libLLVM-9.so", "libLLVMCore.so.15", "libLLVM-15.so.1",
        "libLLVM.so.20.1-rc1", "libLLVMSupport.a",
    ]  # fmt: skip
    for name in names:
        (tmp_path / name).write_bytes(b"")
    (tmp_path / "libLLVM-15.so").symlink_to("libLLVM-15.so.1")
    monkeypatch.setattr(libraries, "_folders", lambda: iter([tmp_path, tmp_path / "absent"]))
    assert [library.major for library in libraries.candidates()] == [20, 19, 15, 14, 9]
    monkeypatch.setenv(libraries.PATH_VARIABLE, str(tmp_path / "libLLVM-15.so"))
    found = libraries.candidates()
    assert [library.major for library in found] == [15, 20, 19, 14, 9]
    assert found[0].path.name == "libLLVM-15.so"


@pytest.mark.usefixtures("no_cuda")
def test_an_aborting_first_choice_gives_way_to_a_library_that_works(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if not renderer.choose().vectorised:
        pytest.skip("no usable LLVM on this machine")
    monkeypatch.setenv(libraries.PATH_VARIABLE, str(aborting_library(tmp_path)))
    chosen = renderer.choose()
    assert chosen.variant == "llvm_ad_mono"
    assert [answer.verdict for answer in chosen.probes][:2] == ["missing", "aborted"]
    assert chosen.probes[-1].ran
    assert renderer.choose(channels="rgb").variant == "llvm_ad_rgb"


def test_activate_switches_the_variant_on_in_a_fresh_process() -> None:
    code = (
        "import scenes.renderer as r; c = r.choose(); mi = r.activate(threads=1);"
        "import drjit; print(mi.variant() == c.variant, drjit.thread_count())"
    )
    run = in_fresh_process(code)
    assert run.stdout.split() == ["True", "1"]


def in_fresh_process(code: str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(  # noqa: S603
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=Path(__file__).parents[2],
        env=os.environ | environment,
    )


def test_the_fallback_says_one_line_and_no_more() -> None:
    """Dr.Jit itself complains about every library that it cannot load."""
    code = (
        "from scenes.renderer import activate, choice; from scenes.renderer.probe import Probe;"
        "choice.probe_cuda = lambda: Probe('cuda', '', '', 'missing', ''); choice.candidates = lambda: [];"
        "print(activate().variant()); activate()"
    )
    run = in_fresh_process(code, **{libraries.PATH_VARIABLE: "missing.so"})
    assert run.stdout.strip() == "scalar_rgb"
    (line,) = run.stderr.splitlines()
    assert "scalar_rgb" in line


@pytest.mark.study
def test_a_library_that_was_loaded_before_is_not_trusted() -> None:
    if not renderer.choose().llvm_path:
        pytest.skip("no usable LLVM on this machine")
    code = (
        "import dataclasses, drjit; from scenes.renderer import activation; real = activation.choose();"
        "activation.choose = lambda **_: dataclasses.replace(real, llvm_version='99.0.0')\n"
        "try: activation.activate()\n"
        "except activation.InputError as error: print(error)"
    )
    assert "activate() first" in in_fresh_process(code).stdout


def test_threads_follow_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(threads.THREADS_VARIABLE, raising=False)
    assert threads.default_threads() == renderer.usable_cores()
    monkeypatch.setenv(threads.THREADS_VARIABLE, "3")
    assert threads.default_threads() == 3
    for wrong in ("0", "-1", "many"):
        monkeypatch.setenv(threads.THREADS_VARIABLE, wrong)
        with pytest.raises(InputError, match="whole number"):
            threads.default_threads()


@pytest.mark.usefixtures("no_system_libraries")
def test_the_doctor_names_every_library_and_survives_json(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "libLLVM-21.so"
    path.write_bytes(b"not a library")
    monkeypatch.setenv(libraries.PATH_VARIABLE, str(path))
    report = renderer.doctor()
    document = json.loads(json.dumps(dataclasses.asdict(report)))
    assert document["libraries"][0]["verdict"] == "refused"
    assert document["versions"]["mitsuba"].startswith("3.9")
    assert document["threads"] == len(os.sched_getaffinity(0))
    text = renderer.render_text(report)
    assert str(path) in text
    if not report.cuda.ran:
        assert document["variant"] == "scalar_rgb"
        assert "install LLVM 16 or newer" in text
