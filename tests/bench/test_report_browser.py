"""A browser opens the page: everything is there, nothing fails to load, nothing sticks out."""

from __future__ import annotations

import http.server
import json
import queue
import shutil
import subprocess
import threading
from pathlib import Path
from typing import Any, ClassVar

import pytest

from bench.compare import compare_runs
from bench.report import build_comparison, build_report
from bench.run import load_run
from tests.bench.report_run import made_up_run

WATCH = """<script>window.failures = [];
addEventListener("error", e => failures.push(e.message || e.target.outerHTML.slice(0, 80)), true);
addEventListener("unhandledrejection", e => failures.push(String(e.reason)));
console.error = text => failures.push(String(text));</script>"""

PROBE = """<script>
addEventListener("load", async () => {
  const found = { errors: failures, width: innerWidth };
  for (const image of document.images) image.decode().catch(() => failures.push("a broken picture"));
  const boxes = [...document.querySelectorAll("figure img, figure svg, .forest svg, .stagebar, .solid")];
  const shown = boxes.filter(box => !box.hidden && !box.closest("details:not([open]), [hidden]"));
  const size = box => box.getBoundingClientRect();
  found.figures = shown.length;
  found.empty = shown.filter(b => size(b).width < 8 || size(b).height < 8).map(b => b.outerHTML.slice(0, 80));
  found.overflow = document.documentElement.scrollWidth - innerWidth;
  found.sections = [...document.querySelectorAll("section")].map(one => [one.id, size(one).height]);
  const entries = performance.getEntriesByType("resource").map(one => one.name);
  found.loaded = entries.filter(name => !name.startsWith("data:"));
  const solid = document.querySelector(".solid"), view = solid.view;
  const pixels = () => {
    view.draw();
    const { width, height } = view.canvas, data = new Uint8Array(4 * width * height);
    view.gl.readPixels(0, 0, width, height, view.gl.RGBA, view.gl.UNSIGNED_BYTE, data);
    return data;
  };
  try {
    await view.start();
    const before = pixels();
    solid.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" }));
    const after = pixels();
    found.drawn = before.filter((v, k) => k % 4 === 3 && v > 0).length / (before.length / 4);
    found.changed = before.filter((v, k) => v !== after[k]).length;
  } catch (error) { found.still = String(error); }
  fetch("/found", { method: "POST", body: JSON.stringify(found) });
});
</script>"""

SECTIONS = ["difference", "detection", "where", "cases", "budget", "speed", "failures", "provenance", "read"]
FLAGS = (
    "--headless", "--no-sandbox", "--disable-gpu", "--use-gl=angle", "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync", "--remote-debugging-port=0", "--window-size=1500,1000",
)  # fmt: skip


class Told(http.server.BaseHTTPRequestHandler):
    """Serves the pages it is given and keeps what they say of themselves."""

    pages: ClassVar[dict[str, str]] = {}
    told: ClassVar[queue.Queue[dict[str, Any]]] = queue.Queue()

    def do_GET(self) -> None:
        """A page."""
        body = self.pages.get(self.path, "").encode()
        self.send_response(200 if body else 204)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def do_POST(self) -> None:
        """What a page found."""
        self.told.put(json.loads(self.rfile.read(int(self.headers["Content-Length"]))))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *words: object) -> None:
        """Say nothing."""


def opened(page: Path, folder: Path, width: int) -> dict[str, Any]:
    """What the page says of itself in a browser, in a frame of this width: windows are never below 500."""
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if not browser:
        pytest.skip("no chromium on this machine")
    head, end, tail = page.read_text("utf-8").replace("<head>", "<head>" + WATCH, 1).rpartition("</body>")
    frame = f'<iframe src="/page" style="width:{width}px;height:900px;border:0"></iframe>'
    Told.pages.update({"/page": head + PROBE + end + tail, "/frame": frame})
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Told) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/frame"
        arguments = [browser, *FLAGS, f"--user-data-dir={folder / 'profile'}", address]
        with subprocess.Popen(arguments, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:  # noqa: S603
            try:
                return Told.told.get(timeout=120)
            finally:
                process.terminate()
                server.shutdown()


@pytest.fixture(scope="module")
def run_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return made_up_run(tmp_path_factory.mktemp("run"), fail=True, budget=True)


@pytest.mark.parametrize("width", [1400, 390])
@pytest.mark.parametrize("kind", ["run", "comparison"])
def test_a_browser_shows_all_of_the_page(run_folder: Path, tmp_path: Path, width: int, kind: str) -> None:
    page = build_report(run_folder)
    if kind == "comparison":
        run = load_run(run_folder)
        names = ("adaptive", "fixed")
        page = build_comparison(run, run, compare_runs(run, run, variants=names), tmp_path / "ab.html")
    found = opened(page, tmp_path, width)
    assert found["errors"] == []
    assert found["loaded"] == []
    assert found["width"] == width
    assert found["overflow"] <= 0
    assert found["empty"] == []
    assert found["figures"] > 30
    assert [name for name, _height in found["sections"]] == SECTIONS
    assert all(height > 60 for _name, height in found["sections"])
    if "still" not in found:  # a browser without WebGL keeps the still picture, which was looked at above
        assert 0.05 < found["drawn"] < 0.95
        assert found["changed"] > 100
