"""What this machine renders with, why, and what would make it faster."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

from burrscan.errors import InputError
from scenes.renderer.choice import VARIANT_VARIABLE, choose
from scenes.renderer.libraries import PATH_VARIABLE, candidates
from scenes.renderer.probe import Probe, probe_cuda, probe_llvm
from scenes.renderer.threads import THREADS_VARIABLE, default_threads

PACKAGES = (
    "burrscan",
    "mitsuba",
    "drjit",
    "numpy",
    "scipy",
    "numba",
    "opencv-python-headless",
    "trimesh",
    "manifold3d",
    "pydantic",
)

_INSTALL = {
    "apt-get": "apt-get install libllvm19",
    "dnf": "dnf install llvm-libs",
    "pacman": "pacman -S llvm-libs",
    "zypper": "zypper install libLLVM19",
    "apk": "apk add llvm19-libs",
    "brew": "brew install llvm",
}


_STEERING = (VARIANT_VARIABLE, THREADS_VARIABLE, PATH_VARIABLE, "DRJIT_LIBCUDA_PATH", "CUDA_VISIBLE_DEVICES")


@dataclass(frozen=True)
class DoctorReport:
    """The state of the renderer on this machine, ready for JSON by ``dataclasses.asdict``."""

    variant: str | None
    """``None`` when the environment asks for a variant that cannot run."""
    reason: str
    llvm_path: str | None
    llvm_version: str | None
    cuda: Probe
    libraries: tuple[Probe, ...]
    """Every libLLVM found, each probed in a process of its own, in the order of preference."""
    threads: int
    cores: int
    memory_gib: float
    platform: str
    versions: dict[str, str]
    environment: dict[str, str]
    """The environment variables that steer the choice, where they are set."""
    advice: tuple[str, ...]
    """What to do to render faster; empty when there is nothing to gain."""


def doctor() -> DoctorReport:
    """Probe every candidate, also those that the choice never reaches, and say what to install."""
    cuda = probe_cuda()
    libraries = tuple(probe_llvm(library) for library in candidates())
    try:
        renderer = choose()
        variant, reason = renderer.variant, renderer.reason
        path, version = renderer.llvm_path, renderer.llvm_version
    except InputError as error:
        variant, reason, path, version = None, str(error), None, None
    return DoctorReport(
        variant=variant,
        reason=reason,
        llvm_path=path,
        llvm_version=version,
        cuda=cuda,
        libraries=libraries,
        threads=default_threads(),
        cores=os.cpu_count() or 1,
        memory_gib=round(_memory_bytes() / 2**30, 1),
        platform=platform.platform(),
        versions={"python": platform.python_version()} | {name: _version(name) for name in PACKAGES},
        environment={name: os.environ[name] for name in _STEERING if os.environ.get(name)},
        advice=tuple(_advice(cuda, libraries)),
    )


def render_text(report: DoctorReport) -> str:
    """Lay the report out for a terminal, in plain text."""
    rows = [
        ("variant", report.variant or "none can run"),
        ("why", report.reason),
        ("CUDA", f"{report.cuda.verdict}: {report.cuda.detail}"),
        *[("LLVM", _library_line(probe)) for probe in report.libraries],
        *([] if report.libraries else [("LLVM", "no libLLVM found")]),
        ("threads", f"{report.threads} of {report.cores} cores"),
        ("memory", f"{report.memory_gib:g} GiB"),
        ("platform", report.platform),
        ("versions", ", ".join(f"{name} {version}" for name, version in report.versions.items())),
        *[("environment", f"{name}={value}") for name, value in report.environment.items()],
        *[("advice", line) for line in report.advice or ("nothing to install: this is as fast as it gets",)],
    ]
    return _table(rows)


def _table(rows: list[tuple[str, str]]) -> str:
    width = max(len(name) for name, _ in rows)
    lines, last = [], ""
    for name, text in rows:
        lines.append(f"{'' if name == last else name:<{width}}  {text}")
        last = name
    return "\n".join(lines)


def _library_line(probe: Probe) -> str:
    return f"{probe.version or '?':<7} {probe.verdict:<9} {probe.path} ({probe.detail})"


def _advice(cuda: Probe, libraries: tuple[Probe, ...]) -> list[str]:
    lines = []
    if os.environ.get(VARIANT_VARIABLE):
        lines.append(f"unset {VARIANT_VARIABLE} to let burrscan choose the fastest variant")
    if not cuda.ran and not any(probe.ran for probe in libraries):
        lines.append(f"install LLVM 16 or newer for vectorised rendering: {_install_command()}")
    if not cuda.ran and cuda.verdict != "missing":
        lines.append(f"the NVIDIA device cannot be used: {cuda.detail}")
    return lines


def _install_command() -> str:
    known = [command for tool, command in _INSTALL.items() if shutil.which(tool)]
    return known[0] if known else f"then set {PATH_VARIABLE} to the library file"


def _version(package: str) -> str:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return "not installed"


def _memory_bytes() -> int:
    """Memory that this process may use: the machine's, or its container's where that is less."""
    total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") if sys.platform != "win32" else 0
    try:
        limit = int(Path("/sys/fs/cgroup/memory.max").read_text("ascii"))
    except (OSError, ValueError):  # no such limit
        return total
    return min(total, limit)
