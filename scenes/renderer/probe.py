"""Does Mitsuba really compile and run with this library? Asked in a process that may die of it."""

from __future__ import annotations

import ctypes.util
import hashlib
import importlib.metadata
import json
import os
import platform
import signal
import subprocess
import sys
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Literal

from scenes.renderer import cache
from scenes.renderer.libraries import PATH_VARIABLE, Library

KERNEL = Path(__file__).with_name("kernel.py")
TIMEOUT_S = 180.0  # CUDA may compile for a minute on first use; LLVM takes about a second

Verdict = Literal["ran", "refused", "aborted", "timed out", "missing", "not tried"]


@dataclass(frozen=True)
class Probe:
    """What became of one backend with one library."""

    backend: Literal["llvm", "cuda"]
    path: str
    version: str
    """By the library itself when it ran, else by its file name; empty when unknown."""
    verdict: Verdict
    detail: str

    @property
    def ran(self) -> bool:
        """Whether the representative kernel ran and its numbers were right."""
        return self.verdict == "ran"


def probe_llvm(library: Library) -> Probe:
    """Run the kernel on LLVM with ``library``, or remember how that ended last time."""
    version = str(library.major or "")
    if not library.path.is_file():
        return Probe("llvm", str(library.path), version, "missing", "no such file")
    return _remembered(Probe("llvm", str(library.path), version, "not tried", ""), library.path.resolve())


def probe_cuda() -> Probe:
    """Run the kernel on CUDA if there is a driver, or remember how that ended last time."""
    named = os.environ.get("DRJIT_LIBCUDA_PATH") or ctypes.util.find_library("cuda")
    devices = sorted(str(path) for path in Path("/dev").glob("nvidia*"))
    if not named or (sys.platform == "linux" and not devices and not Path("/dev/dxg").exists()):
        return Probe("cuda", named or "", "", "missing", "no NVIDIA driver or device on this machine")
    return _remembered(Probe("cuda", named, "", "not tried", ""), Path(named))


def _remembered(question: Probe, library: Path) -> Probe:
    key = _key(question, library)
    known = cache.load(key)
    if known is not None:
        with suppress(TypeError):  # another layout: ask again
            return Probe(**known)
    answer = _ask(question)
    # A time-out may mean a busy machine, a refusal what can be installed.
    if answer.verdict in {"ran", "aborted"}:
        cache.store(key, asdict(answer))
    return answer


def _key(question: Probe, library: Path) -> dict[str, Any]:
    """Everything that the outcome may depend on."""
    status = library.stat() if library.is_file() else None
    return {
        "backend": question.backend,
        "path": question.path,
        "file": [str(library), status.st_size, status.st_mtime_ns] if status else [str(library)],
        "devices": os.environ.get("CUDA_VISIBLE_DEVICES", "") if question.backend == "cuda" else "",
        "versions": [importlib.metadata.version(name) for name in ("mitsuba", "drjit")],
        "kernel": hashlib.sha256(KERNEL.read_bytes()).hexdigest(),
        "processor": [platform.machine(), _processor()],
    }


def _processor() -> str:
    """The processor's model and abilities: LLVM compiles for the machine that it runs on."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8", "replace").split("\n\n")[0].splitlines()
    except OSError:
        return platform.processor()
    kept = [line for line in lines if line.startswith(("model name", "flags", "Features", "CPU part"))]
    return hashlib.sha256("\n".join(kept).encode()).hexdigest()[:16]


def _ask(question: Probe) -> Probe:
    """Run the kernel in a fresh process with an empty kernel cache: a cached kernel proves nothing."""
    with tempfile.TemporaryDirectory(prefix="burrscan-probe-") as empty:
        environment = os.environ | {"DRJIT_CACHE_DIR": empty}
        if question.backend == "llvm":
            environment[PATH_VARIABLE] = question.path
        command = [sys.executable, "-P", str(KERNEL), f"{question.backend}_ad_mono"]
        try:
            run = subprocess.run(  # noqa: S603 (our own script)
                command,
                env=environment,
                cwd=empty,
                capture_output=True,
                text=True,
                errors="replace",
                timeout=TIMEOUT_S,
                check=False,
            )
        except subprocess.TimeoutExpired:
            return _answer(question, "timed out", f"no answer within {TIMEOUT_S:.0f} s")
    return _judge(question, run)


def _judge(question: Probe, run: subprocess.CompletedProcess[str]) -> Probe:
    if run.returncode < 0:
        return _answer(question, "aborted", f"{_signal_name(-run.returncode)}: {_complaint(run.stderr)}")
    try:
        result = json.loads(run.stdout.splitlines()[-1])
    except (IndexError, ValueError):
        return _answer(question, "refused", _complaint(run.stderr))
    if run.returncode != 0 or not result.get("ran"):
        return _answer(question, "refused", _complaint(run.stderr))
    version = result["llvm"] or question.version
    return Probe(question.backend, question.path, version, "ran", "the representative kernel ran")


def _answer(question: Probe, verdict: Verdict, detail: str) -> Probe:
    return Probe(question.backend, question.path, question.version, verdict, detail)


def _signal_name(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:
        return f"signal {number}"


def _complaint(stderr: str) -> str:
    """The one line of an error output that says most: the library's own, else the last."""
    lines = [line.strip() for line in stderr.splitlines() if line.strip()]
    telling = [line for line in lines if line.startswith(("jit_", "jitc_", "LLVM ERROR"))]
    return (telling or lines[-1:] or ["no message"])[0][:300]
