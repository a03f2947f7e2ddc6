"""Editors for tests: one without a socket, and one that a browser can open."""

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import uvicorn

from tests.maps.editor.asgi_client import Client
from toponav.maps.editor.app import make_app
from toponav.maps.editor.map_file import MapFile
from toponav.maps.editor.serve import listen
from toponav.maps.editor.work import Workshop
from toponav.maps.spec import Edge, MapFrame, Node, TopologicalMap, map_to_document

PORT = 8123
TOKEN = "a-secret-of-one-launch"
ORIGIN = f"http://127.0.0.1:{PORT}"
HEADERS = {"X-Toponav-Token": TOKEN, "Origin": ORIGIN}


def client(path: Path, workshop: Workshop | None = None, **more: Any) -> Client:
    """A client with the token, of an editor of this map."""
    app = make_app(
        MapFile(path),
        workshop or Workshop(),
        more.pop("floor", None),
        token=TOKEN,
        port=PORT,
        **more,
    )
    return Client(app, HEADERS | {"Host": ORIGIN.removeprefix("http://")})


@contextlib.contextmanager
def running(path: Path, workshop: Workshop | None = None, **more: Any) -> Iterator[str]:
    """The address of an editor of this map on a port of this machine."""
    with listen(0) as bound:
        port = bound.getsockname()[1]
        app = make_app(
            MapFile(path), workshop or Workshop(), more.get("floor"), token=TOKEN, port=port
        )
        config = uvicorn.Config(app, log_level="error", lifespan="off", ws="none")
        server = uvicorn.Server(config)
        thread = threading.Thread(target=server.run, kwargs={"sockets": [bound]}, daemon=True)
        thread.start()
        try:
            yield f"http://127.0.0.1:{port}/?token={TOKEN}"
        finally:
            server.should_exit = True
            thread.join(timeout=10)


def document(nodes: tuple[Node, ...] = (), edges: tuple[Edge, ...] = ()) -> dict[str, Any]:
    """A map as the page sends it."""
    return map_to_document(TopologicalMap("tiny", MapFrame(), nodes, edges))
