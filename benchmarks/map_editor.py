"""Writes benchmarks/results/map_editor.json: frames a second while a large map is edited.

Draws a map of 500 nodes and 1,000 edges in headless Chromium, without a graphics card, and moves
the pointer once a frame: panning, zooming, dragging one node, and dragging a hundred.

    python benchmarks/map_editor.py

Needs the extra `dev` and Debian's chromium.
"""

import argparse
import contextlib
import os
import shutil
import socket
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import uvicorn
from playwright.sync_api import Page, sync_playwright

from toponav.core.vocabulary import Behavior, NodeKind
from toponav.evaluation.benchmarks.record import Benchmark, write_benchmark
from toponav.maps.editor.app import make_app
from toponav.maps.editor.floor import Floor
from toponav.maps.editor.guard import new_token
from toponav.maps.editor.map_file import MapFile
from toponav.maps.editor.serve import listen
from toponav.maps.editor.work import Workshop
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, edge_along, save_map
from toponav.worlds.generate.office import generate_office

NODES, EDGES = 500, 1000
FRAMES = 240
SEED = 4
FLAGS = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)
# Moves the pointer in a circle, one step a frame, and times the frames.
MOVE = """([x, y, radius, frames]) => new Promise((resolve) => {
  const stage = document.getElementById("stage");
  const times = [];
  const step = (time) => {
    times.push(time);
    if (times.length > frames) return resolve(times);
    const angle = (2 * Math.PI * times.length) / 60;
    stage.dispatchEvent(new PointerEvent("pointermove", {
      bubbles: true, pointerId: 1, pointerType: "mouse", buttons: 1,
      clientX: x + radius * Math.sin(angle), clientY: y + radius * (1 - Math.cos(angle)),
    }));
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
})"""
ZOOM = """([x, y, frames]) => new Promise((resolve) => {
  const stage = document.getElementById("stage");
  const times = [];
  const step = (time) => {
    times.push(time);
    if (times.length > frames) return resolve(times);
    stage.dispatchEvent(new WheelEvent("wheel", {
      bubbles: true, cancelable: true, clientX: x, clientY: y,
      deltaY: times.length % 60 < 30 ? -40 : 40,
    }));
    requestAnimationFrame(step);
  };
  requestAnimationFrame(step);
})"""


def large_map() -> TopologicalMap:
    """Two lanes along every line of a lattice, all kinds and behaviours."""
    rng = np.random.default_rng(SEED)
    kinds, behaviors = list(NodeKind), list(Behavior)
    nodes = [
        Node(
            f"node-{number}",
            kinds[int(rng.integers(4))],
            float(number % 25 + rng.uniform(-0.2, 0.2)),
            float(number // 25 + rng.uniform(-0.2, 0.2)),
            f"room-{number}",
        )
        for number in range(NODES)
    ]
    edges: dict[str, Edge] = {}
    while len(edges) < EDGES:
        number = int(rng.integers(NODES))
        other = number + int(rng.choice([1, -1, 25, -25]))
        if 0 <= other < NODES and abs(number % 25 - other % 25) <= 1:
            edge = edge_along(nodes[number], nodes[other], behaviors[int(rng.integers(5))])
            edges[edge.id] = edge
    return TopologicalMap("large", MapFrame(), tuple(nodes), tuple(edges.values()))


def measure(page: Page) -> dict[str, float]:
    """Frames a second of each gesture, and the work of the busiest process for one."""
    found: dict[str, float] = {}
    box = page.locator("#stage").bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def record(name: str, script: str, arguments: list[float]) -> None:
        before = busy_ms()
        times = page.evaluate(script, [*arguments, FRAMES])
        after = busy_ms()
        steps_ms = np.diff(times[5:])
        work_ms = {kind: after[kind] - before.get(kind, 0.0) for kind in after}
        found[f"{name}_fps"] = 1000.0 / float(steps_ms.mean())
        found[f"{name}_frame_ms_p95"] = float(np.quantile(steps_ms, 0.95))
        found[f"{name}_cpu_ms_per_frame"] = max(work_ms.values()) / FRAMES

    for scale, presses in (("all", 0), ("near", 6)):
        for _ in range(presses):
            page.keyboard.press("+")
        page.mouse.move(x, y)
        page.mouse.down(button="right")
        record(f"pan_{scale}", MOVE, [x, y, 120])
        page.mouse.up(button="right")
    page.keyboard.press("Home")
    record("zoom", ZOOM, [x, y])
    page.keyboard.press("Home")
    start = middle_of(page, "node-262")
    page.mouse.move(*start)
    page.mouse.down()
    record("drag_one_node", MOVE, [*start, 40])
    page.mouse.up()
    page.keyboard.press("Escape")
    for numbers, press in (((131, 132, 156, 157), page.mouse.down), ((391, 392, 416, 417), None)):
        # Between four nodes no edge is in the way.
        around = np.mean([middle_of(page, f"node-{number}") for number in numbers], axis=0)
        page.mouse.move(float(around[0]), float(around[1]), steps=3)
        if press is not None:
            press()
    page.mouse.up()
    found["dragged_nodes"] = float(page.locator(".node.selected").count())
    assert found["dragged_nodes"] == 100
    start = middle_of(page, "node-262")
    page.mouse.move(*start)
    page.mouse.down()
    record("drag_many_nodes", MOVE, [*start, 40])
    page.mouse.up()
    return found


def middle_of(page: Page, node: str) -> tuple[float, float]:
    """Where a node is on the page."""
    box = page.locator(f'[data-node="{node}"]').bounding_box()
    assert box is not None
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def busy_ms() -> dict[str, float]:
    """Processor time of the browser's processes so far, by kind; the load does not change it."""
    parents: dict[int, int] = {}
    times_ms: dict[int, float] = {}
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            parents[int(folder.name)] = int(fields[1])
            ticks = int(fields[11]) + int(fields[12])
            times_ms[int(folder.name)] = 1000.0 * ticks / os.sysconf("SC_CLK_TCK")
    found: dict[str, float] = {}
    for process, spent_ms in times_ms.items():
        above = process
        while above not in (0, os.getpid()):
            above = parents.get(above, 0)
        with contextlib.suppress(OSError):
            # Chromium writes the command line of its children as one word.
            words = (
                (Path("/proc") / str(process) / "cmdline").read_text().replace("\0", " ").split()
            )
            kind = next((word for word in words if word.startswith("--type=")), "")
            if above and "chromium" in words[0]:
                found[kind] = found.get(kind, 0.0) + spent_ms
    return found


@contextlib.contextmanager
def served(path: Path, floor: Floor, bound: socket.socket) -> Iterator[str]:
    """The address of an editor of this map."""
    port, token = bound.getsockname()[1], new_token()
    app = make_app(MapFile(path), Workshop(), floor, token=token, port=port)
    server = uvicorn.Server(uvicorn.Config(app, log_level="error", lifespan="off", ws="none"))
    thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
    thread.start()
    try:
        yield f"http://127.0.0.1:{port}/?token={token}"
    finally:
        server.should_exit = True
        thread.join(timeout=10)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "results")
    out: Path = parser.parse_args().out
    scene = generate_office(SEED)
    with tempfile.TemporaryDirectory() as folder, listen(0) as bound:
        path = save_map(large_map(), Path(folder) / "large.topo.json")
        with served(path, Floor.of_scene(scene), bound) as url, sync_playwright() as driver:
            browser = driver.chromium.launch(executable_path=shutil.which("chromium"), args=FLAGS)
            page = browser.new_page(viewport={"width": 1440, "height": 900})
            page.goto(url)
            page.wait_for_selector("body[data-ready=true]")
            page.wait_for_timeout(1500)
            metrics = measure(page)
            version = browser.version
            browser.close()
    settings: dict[str, Any] = {
        "building": f"{NODES} nodes, {EDGES} edges over {scene.name}",
        "browser": f"Chromium {version}, headless, no GPU",
        "viewport": [1440, 900],
        "frames": FRAMES,
        "load_1_minute": round(os.getloadavg()[0], 1),
    }
    print(write_benchmark(Benchmark("map_editor", metrics, settings), out))


if __name__ == "__main__":
    main()
