"""The editor's page by what a user sees: places in metres, nodes by name."""

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from toponav.maps.spec import TopologicalMap, load_map

if TYPE_CHECKING:
    from playwright.sync_api import Page

_DEADLINE_S = 30.0


@dataclass
class EditorPage:
    """A page that shows an editor of a map file."""

    page: "Page"
    path: Path

    def open(self, url: str) -> "EditorPage":
        """Opens the editor and waits until it can be used."""
        self.page.goto(url)
        self.page.wait_for_selector("body[data-ready=true]")
        return self

    def press(self, *keys: str) -> None:
        """Presses keys one after the other."""
        for key in keys:
            self.page.keyboard.press(key)
        self.drawn()

    def drawn(self) -> None:
        """Waits until the page has drawn what was done: it draws once a frame."""
        self.page.evaluate(
            "() => new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))"
        )

    def middle(self, selector: str) -> tuple[float, float]:
        """The middle of an element in pixels."""
        box = self.page.locator(selector).bounding_box()
        assert box is not None, selector
        return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2

    def node_at(self, node: str) -> tuple[float, float]:
        """Where a node is on the page."""
        return self.middle(f'[data-node="{node}"]')

    def click_node(self, node: str, **more: Any) -> None:
        """Clicks a node."""
        self.page.mouse.click(*self.node_at(node), **more)
        self.drawn()

    def connect(self, *nodes: str) -> None:
        """Draws edges from node to node with the edge tool, and puts the tool down."""
        self.press("e")
        for node in nodes:
            self.click_node(node)
        self.press("Escape", "Escape")

    def click_at(self, x: float, y: float) -> None:
        """Clicks the stage at a share of its width and height."""
        box = self.page.locator("#stage").bounding_box()
        assert box is not None
        self.page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
        self.drawn()

    def text(self, selector: str) -> str:
        """What an element says once all is drawn."""
        self.drawn()
        return self.page.locator(selector).inner_text()

    def wait(self, holds: Callable[[], object], what: str) -> None:
        """Waits until something holds."""
        deadline = time.monotonic() + _DEADLINE_S
        while not holds():
            assert time.monotonic() < deadline, f"never: {what}"
            self.page.wait_for_timeout(30)

    def saved(self) -> TopologicalMap:
        """The map in the file once the page says that it is saved."""
        self.press("Control+s")
        self.wait(
            lambda: (
                self.page.locator("#file-status[data-state=saved]").count() and self.path.exists()
            ),
            "saved",
        )
        return load_map(self.path)

    def faults(self) -> list[str]:
        """The rules that the checks' list names."""
        return self.page.locator("#checks .fault small").all_inner_texts()
