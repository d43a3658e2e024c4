"""The live page as a user feels it: frames per second, delays, what being watched costs, and the weight of the page.

python -m benchmarks.live

It drives a real Chromium, which must be installed, and JupyterLab, if it is installed. The load of the machine is told,
because a browser, a server and a renderer share its processors.
"""

import contextlib
import os
import re
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import taichi_tracer as tt
from benchmarks.measure import describe_machine, interleaved
from taichi_tracer.apps.server import FOLDER, PAGES
from taichi_tracer.apps.session import Session

sys.path.append(str(Path(__file__).parents[1] / "tests"))
import browser  # noqa: E402 (the browser of the tests)

CANVAS = "document.querySelector('.tt-live canvas')"
FRAME = f"Number({CANVAS}.dataset.frame)"
SECONDS, RUNS = 4.0, 5  # of dragging
WATCHED, WATCHED_RUNS = 150, 3  # samples with and without somebody who watches: ten seconds of each
MOVES = 1 / 60  # seconds between two movements of the mouse
NORMAL = ("cornell_box", "--size", "512x512", "--view", "normal")
PATIENCE = 120.0
CODE = """import taichi_tracer as tt
renderer = tt.A1Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("normal")
picture = tt.show(renderer)
picture"""
# Milliseconds from the press of a key to another frame on the canvas, and from its release to the lossless picture.
PRESS = """new Promise(done => {
  const canvas = CANVAS, begin = performance.now(), first = canvas.dataset.frame;
  let changed = 0, released = 0;
  const watch = new MutationObserver(() => {
    const now = performance.now();
    if (!changed && canvas.dataset.frame !== first) changed = now - begin;
    if (released && canvas.dataset.kind === "png") { watch.disconnect(); done([changed, now - released]); }
  });
  watch.observe(canvas, { attributes: true });
  const press = type => canvas.dispatchEvent(new KeyboardEvent(type, { key: "d", code: "KeyD", bubbles: true }));
  canvas.focus();
  press("keydown");
  setTimeout(() => { press("keyup"); released = performance.now(); }, 150);
  setTimeout(() => done(null), 5000);
})""".replace("CANVAS", CANVAS)


def main() -> None:
    """Measure everything."""
    print(describe_machine())
    weight = sum((FOLDER / name).stat().st_size for name, _ in PAGES.values())
    rows = [("page weight", "≤ 60 KB", f"{weight / 1e3:.1f} KB")]
    if browser.path_of_browser() is None:
        print("no browser was found: the rows of the page are missing\n")
    else:
        with tempfile.TemporaryDirectory() as folder, browser.started(Path(folder)) as page:
            rows += in_browser(page)
    rows += [watched(), explained()]
    print("| what | asked | measured |\n|---|---|---|")
    for row in rows:
        print(f"| {' | '.join(row)} |")
    loads = " and ".join(f"{load:.1f}" for load in os.getloadavg()[:2])
    print(f"\nLoad of the machine over the last minute and over the last five: {loads}.")


def in_browser(page: browser.Browser) -> list[tuple[str, str, str]]:
    """The rows of the page of the package's own server."""
    program, address = served(*NORMAL)
    try:
        page.open(address, 1280, 900)
        until(lambda: page.evaluate(f"Boolean({CANVAS} && {CANVAS}.dataset.frame)"))
        others = [url for url in page.requests if not url.startswith((address.partition("?")[0], "blob:"))]
        rates = [frames_per_second(page) for _ in range(RUNS)]
        pressed = [found for _ in range(15) if (found := press(page)) is not None]
    finally:
        program.send_signal(signal.SIGINT)
        program.communicate(timeout=PATIENCE)
    return [
        ("requests to others", "none", str(len(others))),
        ("frames per second while orbiting, browser", "≥ 30", told(rates)),
        ("from key press to the changed picture", "≤ 80 ms", told([one[0] for one in pressed], " ms")),
        ("lossless picture after the camera rests", "≤ 300 ms", told([one[1] for one in pressed], " ms")),
    ]


def frames_per_second(page: browser.Browser) -> float:
    """Different pictures per second on the canvas, while the mouse drags it."""
    left, top = page.evaluate(f"(() => {{ const b = {CANVAS}.getBoundingClientRect(); return [b.left, b.top]; }})()")

    def mouse(kind: str, x: float, buttons: int = 1) -> None:
        place = {"x": left + x, "y": top + 200}
        page.ask("Input.dispatchMouseEvent", type=kind, button="left", buttons=buttons, clickCount=1, **place)

    mouse("mousePressed", 100)
    first, begin, k = page.evaluate(FRAME), time.perf_counter(), 0
    while time.perf_counter() - begin < SECONDS:
        k += 1
        mouse("mouseMoved", 100 + 3 * k % 300)
        time.sleep(max(0.0, begin + k * MOVES - time.perf_counter()))
    rate = (page.evaluate(FRAME) - first) / (time.perf_counter() - begin)
    mouse("mouseReleased", 100, 0)
    time.sleep(1.0)
    return rate


def press(page: browser.Browser) -> list[float] | None:
    """(ms to the changed picture, ms to the lossless one) of a key."""
    time.sleep(0.5)
    found = page.ask("Runtime.evaluate", expression=PRESS, awaitPromise=True, returnByValue=True)
    return found["result"].get("value")


def watched() -> tuple[str, str, str]:
    """What being watched costs the renderer: samples per second of a program that takes every frame, and of none."""
    renderer = tt.A3Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("mis")
    renderer.eye_rays.use_packets = None
    session = Session(renderer)
    session.warm_up(lambda text: None)
    stop = threading.Event()

    def take() -> None:
        number = 0
        while not stop.is_set():
            frame = session.wait_for_frame(number, 1.0)
            number = number if frame is None else frame.number

    def steps() -> None:
        end = renderer.film.samples + WATCHED
        while renderer.film.samples < end:
            session.step(0.0)

    def alone() -> None:
        renderer.render(WATCHED)

    def watching() -> None:
        stop.clear()
        thread = threading.Thread(target=take)
        thread.start()
        steps()
        stop.set()
        thread.join()

    seconds = interleaved({"alone": alone, "watched": watching}, WATCHED_RUNS)
    share = 100 * (1 - seconds["alone"] / seconds["watched"])
    return "cost of being watched", "≤ 10 %", f"{share:.1f} % of samples per second"


def explained() -> tuple[str, str, str]:
    """How long a pixel takes, once the renderer's explanation is compiled."""
    renderer = tt.A3Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("mis").render(16)
    renderer.explain(200, 300)
    seconds = []
    for k in range(9):
        begin = time.perf_counter()
        renderer.explain(40 * k, 500 - 30 * k, k)._repr_html_()
        seconds.append(1e3 * (time.perf_counter() - begin))
    return "explain a pixel, warm", "≤ 1 s", told(seconds, " ms")


def told(values: list[float], unit: str = "") -> str:
    """The median, and the smallest and the largest value."""
    if not values:
        return "nothing was measured"
    return f"{statistics.median(values):.3g}{unit} ({min(values):.3g} to {max(values):.3g})"


def served(*words: str) -> tuple[subprocess.Popen, str]:
    """A running ``view --browser`` and its address."""
    command = [sys.executable, "-m", "taichi_tracer", "view", *words, "--browser"]
    pipes: dict[str, Any] = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT, "text": True}
    program = subprocess.Popen(command, env=os.environ | {"PYTHONUNBUFFERED": "1"}, **pipes)
    for line in program.stdout:
        if found := re.search(r"http://\S+", line):
            return program, found[0]
    raise SystemExit("the server did not start")


def until(condition: Callable[[], object]) -> None:
    """Wait until a condition holds."""
    end = time.monotonic() + PATIENCE
    while not condition():
        if time.monotonic() > end:
            raise SystemExit("the page shows no picture")
        time.sleep(0.2)


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        main()
