"""Where numbers come from: versions, the state of the checkout, the machine."""

from __future__ import annotations

import hashlib
import importlib
import os
import platform
import subprocess
import sys
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path
from typing import Any

from burrscan.documents import printable

_PACKAGES = (
    "burrscan", "mitsuba", "drjit", "numpy", "scipy", "numba", "trimesh", "manifold3d",
    "opencv-python-headless", "pydantic",
)  # fmt: skip


def session(*, workers: int, threads: int, renderer: str) -> dict[str, Any]:
    """What there is to know of one sitting at which a run was worked on."""
    return {
        "started": datetime.now(UTC).isoformat(timespec="seconds"),
        "command": [printable(word) for word in (Path(sys.argv[0]).name, *sys.argv[1:])],
        "workers": workers,
        "threads_per_worker": threads,
        "renderer": renderer,
        "python": platform.python_version(),
        "versions": versions(),
        "git": git_state(Path(__file__).parent),
        "machine": machine(),
    }


def versions() -> dict[str, str]:
    """Installed versions of everything that numbers depend on."""
    found = {}
    for name in _PACKAGES:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:
            found[name] = "not installed"
    return found


def code_digest(*packages: str) -> str:
    """A short hash of every source of packages, and of the tables that come with them."""
    total = hashlib.sha256()
    for package in packages:
        root = Path(str(importlib.import_module(package).__file__)).parent
        for path in sorted([*root.rglob("*.py"), *root.rglob("*.toml")]):
            total.update(f"{package}/{path.relative_to(root).as_posix()}\n".encode() + path.read_bytes())
    return total.hexdigest()[:12]


def git_state(folder: Path) -> dict[str, Any] | None:
    """Commit of the checkout that holds ``folder`` and whether files differ from it; None outside of git."""
    commit = _git(folder, "rev-parse", "HEAD")
    if commit is None:
        return None
    changed = _git(folder, "status", "--porcelain", "--untracked-files=no")
    return {"commit": commit, "modified": bool(changed)}


def machine() -> dict[str, Any]:
    """Processor, cores and system."""
    return {
        "processor": _processor(),
        "cores": os.cpu_count(),
        "system": platform.system(),
        "release": platform.release(),
        "architecture": platform.machine(),
    }


def _git(folder: Path, *arguments: str) -> str | None:
    try:
        done = subprocess.run(  # noqa: S603 (fixed words)
            ["git", "-C", str(folder), *arguments],  # noqa: S607 (git of the user's path)
            capture_output=True, text=True, check=True, timeout=10,
        )  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "")
