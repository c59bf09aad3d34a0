"""A small cache of probe results on disk: one JSON file per key, safe against other processes and damage."""

from __future__ import annotations

import hashlib
import json
import os
from contextlib import suppress
from pathlib import Path
from typing import Any

from burrscan.files import written_whole


def folder() -> Path:
    """``$XDG_CACHE_HOME/burrscan/probes``, or the same under ``~/.cache``."""
    named = os.environ.get("XDG_CACHE_HOME", "")
    base = Path(named) if Path(named).is_absolute() else Path.home() / ".cache"
    return base / "burrscan" / "probes"


def load(key: dict[str, Any]) -> dict[str, Any] | None:
    """What was stored under ``key``; ``None`` when there is nothing, or nothing that can be trusted."""
    with suppress(OSError, RuntimeError, ValueError):
        document = json.loads(_path(key).read_text("utf-8"))
        if isinstance(document, dict) and document.get("key") == key:
            value = document.get("value")
            return value if isinstance(value, dict) else None
    return None


def store(key: dict[str, Any], value: dict[str, Any]) -> None:
    """Keep ``value``; a cache that cannot be written costs time, not the run."""
    with suppress(OSError, RuntimeError), written_whole(_path(key)) as path:
        path.write_text(json.dumps({"key": key, "value": value}, indent=1), "utf-8")


def _path(key: dict[str, Any]) -> Path:
    digest = hashlib.sha256(json.dumps(key, sort_keys=True).encode()).hexdigest()
    return folder() / f"{digest[:32]}.json"
