"""Opens pages in a browser without a window, and asks each what it shows.

``python -m tests.bench.browser`` says which browser the tests will use, and ends with 1 where there is none.
"""

from __future__ import annotations

import http.server
import json
import os
import queue
import shutil
import subprocess
import sys
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

WATCH = """<script>window.failures = [];
addEventListener("error", e => failures.push(e.message || e.target.outerHTML.slice(0, 80)), true);
addEventListener("unhandledrejection", e => failures.push(String(e.reason)));
addEventListener("securitypolicyviolation", e => failures.push("refused " + e.blockedURI + e.sample));
</script>"""
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--remote-debugging-port=0", "--window-size=1500,1000",
    "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "--enable-logging=stderr",
)  # fmt: skip
DRIVER = "GL Driver Message"  # of the software renderer, on its own slowness
PATIENCE_S = 120.0
VARIABLE = "BURRSCAN_BROWSER"
NAMES = (
    "chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge",
    "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
    "/Applications/Chromium.app/Contents/MacOS/Chromium",
)  # fmt: skip
"""Browsers that take Chromium's switches, as they are called on Linux and macOS."""
HOW = f"install Chromium or Chrome, or name one by the variable {VARIABLE}"


@dataclass(frozen=True)
class Seen:
    """What pages said of themselves, what they asked the server for, and what stood on the console."""

    told: Mapping[str, Mapping[str, Any]]
    asked: tuple[str, ...]
    console: tuple[str, ...]


@dataclass
class Served:
    """Pages by name, and what comes back of them."""

    pages: Mapping[str, bytes]
    told: queue.Queue[tuple[str, dict[str, Any]]] = field(default_factory=queue.Queue)
    asked: list[str] = field(default_factory=list)


def find_browser() -> str | None:
    """Path of a browser that can be driven; the one that the environment names goes first, and alone."""
    named = os.environ.get(VARIABLE)
    return next(filter(None, map(shutil.which, [named] if named else NAMES)), None)


def look(pages: Mapping[str, tuple[Path, int]], probe: str, folder: Path) -> Seen:
    """Open pages, all in one browser, each in a frame of its own width: windows are never below 500 pixels.

    Parameters
    ----------
    pages
        Name to file and width in pixels.
    probe
        Body of an async function that is run in each page once it is loaded; what it returns is told.
    folder
        For what the browser writes.

    """
    program = find_browser()
    if not program:
        pytest.skip(f"no browser on this machine: {HOW}")
    served = Served({f"/{name}": _probed(page, name, probe) for name, (page, _) in pages.items()})
    served.pages = {**served.pages, "/": _frames({name: width for name, (_, width) in pages.items()})}
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), _handler(served)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        command = [program, *FLAGS, f"--user-data-dir={folder / 'profile'}", address]
        with (folder / "console.txt").open("w") as console:
            told = _told(command, console.fileno(), served, len(pages))
        server.shutdown()
    lines = (folder / "console.txt").read_text("utf-8", "replace").splitlines()
    words = tuple(line for line in lines if ":CONSOLE" in line and DRIVER not in line)
    return Seen(told, tuple(served.asked), words)


def _told(words: list[str], console: int, served: Served, count: int) -> dict[str, Mapping[str, Any]]:
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=console) as process:  # noqa: S603
        try:
            return dict(served.told.get(timeout=PATIENCE_S) for _ in range(count))
        finally:
            process.terminate()


def _probed(page: Path, name: str, probe: str) -> bytes:
    """The page with the watch before everything and the probe at its end."""
    head, end, tail = page.read_text("utf-8").replace("<head>", "<head>" + WATCH, 1).rpartition("</body>")
    call = f"""<script>addEventListener("load", async () => {{
      const probe = async () => {{ {probe} }};
      const found = await probe().catch(error => ({{ probe: String(error) }}));
      parent.postMessage({{ name: {json.dumps(name)}, found }}, "*");
    }});</script>"""
    return (head + call + end + tail).encode()


def _frames(widths: Mapping[str, int]) -> bytes:
    frames = (
        f'<iframe src="/{name}" style="width:{width}px;height:900px;border:0"></iframe>'
        for name, width in widths.items()
    )
    tell = 'onmessage = e => fetch("/", { method: "POST", body: JSON.stringify(e.data) });'
    return f'<script>{tell}</script><link rel="icon" href="data:,">{"".join(frames)}'.encode()


def _handler(served: Served) -> type[http.server.BaseHTTPRequestHandler]:
    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            served.asked.append(self.path)
            body = served.pages.get(self.path, b"")
            self.send_response(200 if body else 404)
            self.send_header("Content-Type", "text/html; charset=utf-8")
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def do_POST(self) -> None:
            told = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
            self.send_response(204)
            self.end_headers()
            served.told.put((told["name"], told["found"]))

        def log_message(self, *words: object) -> None:
            """Say nothing."""

    return Handler


if __name__ == "__main__":
    found = find_browser()
    sys.stdout.write(f"{found or HOW}\n")
    sys.exit(not found)
