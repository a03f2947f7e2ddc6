"""The editor's web application: its own page, one map, and questions about that map."""

import functools
from collections.abc import Awaitable, Callable
from importlib import resources
from pathlib import Path
from typing import Any

import anyio
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, Response
from starlette.routing import Route

from toponav.core.errors import InputError
from toponav.core.files import parse_json
from toponav.maps.editor.floor import Floor
from toponav.maps.editor.guard import MAX_BODY_BYTES, Guard
from toponav.maps.editor.map_file import ChangedOnDiskError, MapFile, map_of_document
from toponav.maps.editor.work import Workshop, ids_of

__all__ = ["make_app"]

_FILES = {
    "/editor.js": ("editor.js", "text/javascript"),
    "/editor.css": ("editor.css", "text/css"),
    "/icon.svg": ("icon.svg", "image/svg+xml"),
}
_TOKEN_PLACE = "{{token}}"

Answer = Callable[[Request], Awaitable[Response]]


def make_app(
    file: MapFile,
    workshop: Workshop,
    floor: Floor | None,
    *,
    token: str,
    port: int,
    max_body_bytes: int = MAX_BODY_BYTES,
) -> Guard:
    """The application for one map and one launch, guarded.

    Args:
        file: The map.
        workshop: Answers questions about it.
        floor: What to draw under it.
        token: The secret of this launch.
        port: The port that the server listens on.
        max_body_bytes: Longest request body.
    """
    pages = _Pages(file, workshop, floor, token)
    routes = [
        Route("/", pages.page),
        *(Route(path, functools.partial(_static, *named)) for path, named in _FILES.items()),
        Route("/api/map", _guarded(pages.read), methods=["GET"]),
        Route("/api/map", _guarded(pages.save), methods=["PUT"]),
        Route("/api/version", _guarded(pages.version), methods=["GET"]),
        Route("/api/copy", _guarded(pages.save_copy), methods=["POST"]),
        Route("/api/faults", _guarded(pages.faults), methods=["POST"]),
        Route("/api/suggestions", _guarded(pages.suggestions), methods=["POST"]),
        Route("/api/repair", _guarded(pages.repair), methods=["POST"]),
        Route("/api/plans", _guarded(pages.plans), methods=["POST"]),
        Route("/api/construct", _guarded(pages.construct), methods=["POST"]),
        Route("/api/floor/{theme}", _guarded(pages.floor_image), methods=["GET"]),
    ]
    return Guard(Starlette(routes=routes), token=token, port=port, max_body_bytes=max_body_bytes)


class _Pages:
    def __init__(self, file: MapFile, workshop: Workshop, floor: Floor | None, token: str) -> None:
        self._file = file
        self._workshop = workshop
        self._floor = floor
        self._token = token
        self._images: dict[bool, bytes] = {}

    async def page(self, request: Request) -> Response:
        """The page, which carries the token that its requests send."""
        html = _static_text("index.html").replace(_TOKEN_PLACE, self._token)
        return HTMLResponse(html)

    async def read(self, request: Request) -> Response:
        """The map on disk and what is known of its building."""
        opened = await anyio.to_thread.run_sync(self._file.open)
        return JSONResponse(
            {
                "map": opened.document,
                "version": opened.version,
                "file": self._file.name,
                "floor": None if self._floor is None else self._floor.to_document(),
                "can_construct": self._workshop.can_construct,
            }
        )

    async def version(self, request: Request) -> Response:
        """Which version is on disk: the page asks every few seconds."""
        return JSONResponse({"version": await anyio.to_thread.run_sync(self._file.version)})

    async def save(self, request: Request) -> Response:
        """Writes the map, unless somebody else did meanwhile."""
        body = await _body(request)
        drawn = map_of_document(body.get("map"), self._file.name)
        base, overwrite = body.get("base"), body.get("overwrite", False)
        if not isinstance(base, str) or not isinstance(overwrite, bool):
            raise InputError(
                "a save names its base version", where="base", remedy="reload the page"
            )
        save = functools.partial(self._file.save, drawn, base, overwrite=overwrite)
        try:
            version = await anyio.to_thread.run_sync(save)
        except ChangedOnDiskError:
            return JSONResponse({"changed_on_disk": True}, status_code=409)
        return JSONResponse({"version": version})

    async def save_copy(self, request: Request) -> Response:
        """Writes the map beside the file, under a free name."""
        drawn = map_of_document((await _body(request)).get("map"), self._file.name)
        path = await anyio.to_thread.run_sync(self._file.save_copy, drawn)
        return JSONResponse({"file": path.name})

    async def faults(self, request: Request) -> Response:
        """Every fault of the map that was sent."""
        document = (await _body(request)).get("map")
        found = await anyio.to_thread.run_sync(self._workshop.faults, document)
        return JSONResponse({"faults": found})

    async def suggestions(self, request: Request) -> Response:
        """Edges that the geometry suggests another behaviour for."""
        body = await _body(request)
        drawn = map_of_document(body.get("map"), "the page's map")
        edges = ids_of(body.get("edges"), "edges")
        found = await anyio.to_thread.run_sync(self._workshop.suggestions, drawn, edges)
        return JSONResponse({"suggestions": found})

    async def repair(self, request: Request) -> Response:
        """The map with what needs no decision put right; nothing is written."""
        drawn = map_of_document((await _body(request)).get("map"), "the page's map")
        return JSONResponse(await anyio.to_thread.run_sync(self._workshop.repaired, drawn))

    async def plans(self, request: Request) -> Response:
        """Plans from one node to another."""
        body = await _body(request)
        drawn = map_of_document(body.get("map"), "the page's map")
        start, goal = body.get("start"), body.get("goal")
        if not isinstance(start, str) or not isinstance(goal, str):
            raise InputError(
                "a plan has a start and a goal", where="start, goal", remedy="click two nodes"
            )
        found = await anyio.to_thread.run_sync(self._workshop.plans, drawn, start, goal)
        return JSONResponse({"plans": found})

    async def construct(self, request: Request) -> Response:
        """The building's map, drawn by machine; nothing is written."""
        drawn = map_of_document((await _body(request)).get("map"), "the page's map")
        made = await anyio.to_thread.run_sync(self._workshop.construct, drawn)
        return JSONResponse({"map": made})

    async def floor_image(self, request: Request) -> Response:
        """The floor plan for a light or a dark page."""
        theme = request.path_params["theme"]
        if self._floor is None or theme not in ("light", "dark"):
            raise InputError("there is no such floor plan", where=theme, remedy="reload the page")
        dark = theme == "dark"
        if dark not in self._images:
            draw = functools.partial(self._floor.png, dark=dark)
            self._images[dark] = await anyio.to_thread.run_sync(draw)
        return Response(self._images[dark], media_type="image/png")


def _guarded(answer: Answer) -> Answer:
    """The answer, or a user's mistake as JSON."""

    @functools.wraps(answer)
    async def wrapped(request: Request) -> Response:
        try:
            return await answer(request)
        except InputError as error:
            fault = {"rule": error.rule, "where": error.where, "remedy": error.remedy}
            return JSONResponse({"error": fault}, status_code=422)

    return wrapped


async def _body(request: Request) -> dict[str, Any]:
    document = parse_json(await request.body(), "the request")
    if not isinstance(document, dict):
        raise InputError("must be a JSON object", where="the request", remedy="reload the page")
    return document


async def _static(name: str, media_type: str, request: Request) -> Response:
    return Response(_static_text(name), media_type=media_type)


@functools.cache
def _static_text(name: str) -> str:
    path = resources.files("toponav.maps.editor").joinpath("static", name)
    assert isinstance(path, Path)
    return path.read_text("utf-8")
