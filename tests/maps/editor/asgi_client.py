"""A client that calls a web application in the same process, with any bytes for headers."""

import asyncio
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any
from urllib.parse import quote, unquote, urlencode

__all__ = ["Answer", "Client"]


@dataclass(frozen=True)
class Answer:
    """What the application said."""

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def text(self) -> str:
        """The body as text."""
        return self.body.decode("utf-8")

    def json(self) -> Any:
        """The body as JSON."""
        return json.loads(self.body)


@dataclass
class Client:
    """Sends requests with headers of its own, and keeps cookies as a browser does."""

    app: Any
    headers: dict[str, str] = field(default_factory=dict)
    cookies: dict[str, str] = field(default_factory=dict)

    def get(self, path: str, **more: Any) -> Answer:
        """Asks for something."""
        return self.request("GET", path, **more)

    def post(self, path: str, **more: Any) -> Answer:
        """Asks a question about what is sent."""
        return self.request("POST", path, **more)

    def put(self, path: str, **more: Any) -> Answer:
        """Sends something to be kept."""
        return self.request("PUT", path, **more)

    def request(
        self,
        method: str,
        path: str,
        *,
        params: Mapping[str, str] | None = None,
        headers: Mapping[str, str | bytes] | None = None,
        json: Any = None,
        content: bytes | Iterable[bytes] = b"",
    ) -> Answer:
        """Sends one request: a body in one piece with its length, or in pieces without."""
        chunks = [encoded(json)] if json is not None else None
        chunks = chunks or ([content] if isinstance(content, bytes) else list(content))
        wanted: dict[str, str | bytes] = dict(self.headers)
        if isinstance(content, bytes):
            wanted["Content-Length"] = str(len(chunks[0]))
        if self.cookies:
            wanted["Cookie"] = "; ".join(f"{name}={value}" for name, value in self.cookies.items())
        wanted |= headers or {}
        scope = {
            "type": "http",
            "asgi": {"version": "3.0"},
            "http_version": "1.1",
            "method": method,
            "scheme": "http",
            "path": unquote(path),
            "raw_path": quote(path).encode(),
            "root_path": "",
            "query_string": urlencode(params or {}).encode(),
            "headers": [
                (name.lower().encode(), value if isinstance(value, bytes) else value.encode())
                for name, value in wanted.items()
            ],
            "client": ("127.0.0.1", 40000),
            "server": ("127.0.0.1", 80),
        }
        return asyncio.run(self._send(scope, chunks))

    async def _send(self, scope: dict[str, Any], chunks: list[bytes]) -> Answer:
        left = list(chunks)
        said: list[dict[str, Any]] = []

        async def receive() -> dict[str, Any]:
            if not left:
                return {"type": "http.disconnect"}
            return {"type": "http.request", "body": left.pop(0), "more_body": bool(left)}

        async def send(message: dict[str, Any]) -> None:
            said.append(message)

        await self.app(scope, receive, send)
        headers = {key.decode(): value.decode() for key, value in said[0]["headers"]}
        for part in [headers.get("set-cookie", "").partition(";")[0]]:
            name, found, value = part.partition("=")
            if found:
                self.cookies[name] = value
        body = b"".join(message.get("body", b"") for message in said[1:])
        return Answer(said[0]["status"], headers, body)


def encoded(document: Any) -> bytes:
    """JSON as a browser sends it."""
    return json.dumps(document).encode()
