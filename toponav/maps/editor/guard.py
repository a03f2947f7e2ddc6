"""Who may talk to the editor's server: the page that it served itself, and nobody else."""

import hmac
import secrets
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from typing import Any
from urllib.parse import parse_qs

__all__ = ["HEADERS", "MAX_BODY_BYTES", "Guard", "new_token"]

Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[Message], Awaitable[None]]
App = Callable[[MutableMapping[str, Any], Receive, Send], Awaitable[None]]

MAX_BODY_BYTES = 16 * 1024 * 1024
"""Longest request body that is read: a map of 50,000 nodes fits."""

HEADERS: tuple[tuple[str, str], ...] = (
    (
        "content-security-policy",
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; "
        "connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'",
    ),
    ("x-content-type-options", "nosniff"),
    ("x-frame-options", "DENY"),
    ("referrer-policy", "no-referrer"),
    ("cross-origin-opener-policy", "same-origin"),
    ("cross-origin-resource-policy", "same-origin"),
    ("permissions-policy", "camera=(), microphone=(), geolocation=()"),
    ("cache-control", "no-store"),
)
"""Sent with every answer, refusals too."""

_TOKEN_HEADER = b"x-toponav-token"
_NO_BODY = ("GET", "HEAD", "OPTIONS")


def new_token() -> str:
    """A secret that nobody can guess, for one launch."""
    return secrets.token_urlsafe(32)


class Guard:
    """Refuses requests from other sites, other names, other launches, and endless ones.

    The page is given out for the token in its address, which becomes a cookie that scripts
    cannot read; files of the page need the cookie, and everything under `/api/` needs the token
    in a header, which other sites cannot send.

    Args:
        app: What answers the requests that pass.
        token: The secret of this launch.
        port: The port that the server listens on.
        max_body_bytes: Longest request body.
    """

    def __init__(
        self, app: App, *, token: str, port: int, max_body_bytes: int = MAX_BODY_BYTES
    ) -> None:
        self._app = app
        self._token = token
        self._max_body_bytes = max_body_bytes
        self._cookie = f"toponav_{port}"
        self._hosts = {f"127.0.0.1:{port}", f"localhost:{port}"}
        self._origins = {f"http://{host}" for host in self._hosts}

    async def __call__(
        self, scope: MutableMapping[str, Any], receive: Receive, send: Send
    ) -> None:
        """Answers one request, or closes anything that is not HTTP."""
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
            return

        async def send_guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *self._headers(scope)]
            await send(message)

        refusal = self._refusal(scope)
        body = b""
        if refusal is None and scope["method"] not in _NO_BODY:
            read = await self._read(scope, receive)
            if read is None:
                refusal = 413, f"a request holds at most {self._max_body_bytes:,} bytes"
            else:
                body = read
        if refusal is not None:
            await _refuse(send_guarded, *refusal)
            return
        await self._app(scope, _replay(body, receive), send_guarded)

    def _refusal(self, scope: MutableMapping[str, Any]) -> tuple[int, str] | None:
        """Why this request is not answered, or None."""
        hosts = _values(scope, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 421, "this server answers to 127.0.0.1 only"
        origins = _values(scope, b"origin")
        if any(origin not in self._origins for origin in origins) or len(origins) > 1:
            return 403, "requests from other sites are refused"
        if any(
            site not in ("same-origin", "none") for site in _values(scope, b"sec-fetch-site")
        ) and (scope["path"] != "/" or scope["method"] != "GET"):
            return 403, "requests from other sites are refused"
        if scope["method"] not in _NO_BODY and not origins:
            return 403, "requests that change something name their origin"
        if not self._knows_token(scope):
            return 403, (
                "this page belongs to another launch of the editor; "
                "open the address that `toponav map edit` printed"
            )
        return None

    def _knows_token(self, scope: MutableMapping[str, Any]) -> bool:
        if scope["path"].startswith("/api/"):
            return self._matches(_values(scope, _TOKEN_HEADER))
        if scope["path"] == "/" and self._matches(_tokens_of_query(scope)):
            return True
        return self._matches(_cookies(scope, self._cookie))

    def _matches(self, tokens: Iterable[str]) -> bool:
        wanted = self._token.encode()
        return any(hmac.compare_digest(token.encode(), wanted) for token in tokens)

    def _headers(self, scope: MutableMapping[str, Any]) -> list[tuple[bytes, bytes]]:
        headers = [(name.encode(), value.encode()) for name, value in HEADERS]
        if scope["path"] == "/" and self._matches(_tokens_of_query(scope)):
            cookie = f"{self._cookie}={self._token}; Path=/; HttpOnly; SameSite=Strict"
            headers.append((b"set-cookie", cookie.encode()))
        return headers

    async def _read(self, scope: MutableMapping[str, Any], receive: Receive) -> bytes | None:
        """The request's body, or None when it is too long."""
        for length in _values(scope, b"content-length"):
            if not length.isdecimal() or int(length[:20]) > self._max_body_bytes:
                return None
        parts: list[bytes] = []
        size, more = 0, True
        while more:
            message = await receive()
            if message["type"] != "http.request":
                break
            parts.append(message.get("body", b""))
            size += len(parts[-1])
            more = message.get("more_body", False)
            if size > self._max_body_bytes:
                return None
        return b"".join(parts)


def _replay(body: bytes, receive: Receive) -> Receive:
    """Gives the body that was read once more, then what comes after it."""
    given = False

    async def again() -> Message:
        nonlocal given
        if given:
            return await receive()
        given = True
        return {"type": "http.request", "body": body, "more_body": False}

    return again


async def _refuse(send: Send, status: int, reason: str) -> None:
    text = f"toponav: {reason}\n".encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(text)).encode()),
        (b"connection", b"close"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": text})


def _values(scope: MutableMapping[str, Any], name: bytes) -> list[str]:
    """Every value of a header."""
    return [value.decode("latin-1") for key, value in scope["headers"] if key.lower() == name]


def _tokens_of_query(scope: MutableMapping[str, Any]) -> list[str]:
    try:
        return parse_qs(scope["query_string"].decode("ascii"), max_num_fields=8).get("token", [])
    except ValueError:
        return []


def _cookies(scope: MutableMapping[str, Any], name: str) -> list[str]:
    found = []
    for text in _values(scope, b"cookie"):
        try:
            cookie = SimpleCookie(text).get(name)
        except CookieError:
            continue
        if cookie is not None:
            found.append(cookie.value)
    return found
