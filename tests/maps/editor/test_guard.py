"""The editor's server answers its own page and nobody else."""

import asyncio

import pytest

pytest.importorskip("starlette", reason="the editor needs the extra 'editor'")

from tests.maps.editor.served import HEADERS, PORT, TOKEN, client, document
from toponav.maps.editor.guard import HEADERS as ALWAYS
from toponav.maps.editor.guard import new_token
from toponav.maps.editor.serve import listen

API = ("/api/map", "/api/version", "/api/floor/light")
FILES = ("/", "/editor.js", "/editor.css", "/icon.svg")


@pytest.fixture
def stranger(tmp_path):
    """Somebody who reaches the port but has nothing else."""
    bare = client(tmp_path / "map.topo.json")
    for name in HEADERS:
        del bare.headers[name]
    return bare


def test_server_listens_on_loopback_only():
    with listen(0) as bound:
        assert bound.getsockname()[0] == "127.0.0.1"


@pytest.mark.parametrize("path", [*API, *FILES, "/nothing"])
def test_nothing_is_served_without_the_token(stranger, path):
    assert stranger.get(path).status == 403


@pytest.mark.parametrize("token", ["", "wrong", TOKEN[:-1], TOKEN + "x", "ü"])
def test_another_token_is_refused(stranger, token):
    assert stranger.get("/", params={"token": token}).status == 403
    header = {"X-Toponav-Token": token.encode("utf-8")}
    assert stranger.get("/api/map", headers=header).status == 403


def test_tokens_of_two_launches_differ_and_cannot_be_guessed():
    assert new_token() != new_token()
    assert len(new_token()) >= 43


def test_token_in_the_address_gives_the_page_and_a_strict_cookie(stranger):
    page = stranger.get("/", params={"token": TOKEN})
    assert page.status == 200
    assert TOKEN in page.text
    cookie = page.headers["set-cookie"]
    assert {"HttpOnly", "SameSite=Strict"} <= set(cookie.split("; "))
    assert f"toponav_{PORT}=" in cookie
    assert all(stranger.get(path).status == 200 for path in FILES)


def test_cookie_alone_opens_no_api(stranger):
    stranger.get("/", params={"token": TOKEN})
    assert [stranger.get(path).status for path in API] == [403, 403, 403]


@pytest.mark.parametrize(
    "host",
    ["evil.example", f"evil.example:{PORT}", "127.0.0.1", "127.0.0.1:1", f"0.0.0.0:{PORT}",
     f"127.0.0.1.evil.example:{PORT}", f"[::1]:{PORT}", ""],
)  # fmt: skip
def test_other_host_names_are_refused(tmp_path, host):
    answer = client(tmp_path / "map.topo.json").get("/api/map", headers={"Host": host})
    assert answer.status == 421


def test_localhost_is_this_machine(tmp_path):
    header = {"Host": f"localhost:{PORT}", "Origin": f"http://localhost:{PORT}"}
    assert client(tmp_path / "map.topo.json").get("/api/map", headers=header).status == 200


@pytest.mark.parametrize(
    "origin", ["http://evil.example", "null", "https://127.0.0.1:8123", "http://127.0.0.1:8124"]
)
@pytest.mark.parametrize("method", ["GET", "PUT"])
def test_other_origins_are_refused(tmp_path, origin, method):
    answer = client(tmp_path / "map.topo.json").request(
        method, "/api/map", headers={"Origin": origin}, json={"map": document(), "base": ""}
    )
    assert answer.status == 403
    assert not (tmp_path / "map.topo.json").exists()


def test_changes_without_an_origin_are_refused(tmp_path):
    editor = client(tmp_path / "map.topo.json")
    del editor.headers["Origin"]
    assert editor.get("/api/map").status == 200
    answer = editor.put("/api/map", json={"map": document(), "base": ""})
    assert answer.status == 403


@pytest.mark.parametrize("site", ["cross-site", "same-site"])
def test_browsers_say_when_another_site_asks(tmp_path, site):
    editor = client(tmp_path / "map.topo.json")
    assert editor.get("/api/map", headers={"Sec-Fetch-Site": site}).status == 403
    assert editor.get("/editor.js", headers={"Sec-Fetch-Site": site}).status == 403


@pytest.mark.parametrize(
    "path",
    ["/../map.topo.json", "/static/../secret.txt", "/%2e%2e/secret.txt", "/map.topo.json",
     "/index.html", "/manifest.json", "/api/floor/..%2f..%2fsecret.txt", "/api/../secret.txt"],
)  # fmt: skip
def test_no_other_file_is_served(tmp_path, path):
    (tmp_path / "secret.txt").write_text("secret")
    editor = client(tmp_path / "map.topo.json")
    editor.get("/", params={"token": TOKEN})
    answer = editor.get(path)
    assert answer.status in (404, 422)
    assert "secret" not in answer.text


@pytest.mark.parametrize("method", ["DELETE", "PATCH", "POST", "TRACE"])
def test_other_methods_are_refused(tmp_path, method):
    assert client(tmp_path / "map.topo.json").request(method, "/api/map").status == 405


def test_long_bodies_are_refused_before_they_are_read(tmp_path):
    editor = client(tmp_path / "map.topo.json", max_body_bytes=1000)
    assert editor.post("/api/faults", content=b"x" * 1001).status == 413
    assert editor.post("/api/faults", content=b"x" * 1000).status == 422


def test_long_bodies_without_a_length_are_refused(tmp_path):
    editor = client(tmp_path / "map.topo.json", max_body_bytes=1000)
    answer = editor.post("/api/faults", content=iter([b"x" * 600, b"x" * 600]))
    assert answer.status == 413


@pytest.mark.parametrize("length", ["-1", "1e3", "²", "9" * 40])
def test_odd_lengths_are_refused(tmp_path, length):
    header = {"Content-Length": length.encode("utf-8")}
    answer = client(tmp_path / "map.topo.json").post("/api/faults", content=b"", headers=header)
    assert answer.status == 413


@pytest.mark.parametrize("path", ["/", "/api/map", "/editor.js", "/nothing"])
def test_every_answer_has_the_safe_headers(tmp_path, stranger, path):
    known = client(tmp_path / "map.topo.json")
    known.get("/", params={"token": TOKEN})
    for one in (known, stranger):
        answer = one.get(path)
        for name, value in ALWAYS:
            assert answer.headers[name] == value


def test_policy_allows_no_inline_script_and_no_other_site():
    policy = dict(ALWAYS)["content-security-policy"]
    assert "unsafe" not in policy
    assert "http" not in policy
    assert policy.startswith("default-src 'none'")


def test_websockets_are_closed(tmp_path):
    said = []

    async def send(message):
        said.append(message)

    app = client(tmp_path / "map.topo.json").app
    asyncio.run(app({"type": "websocket", "path": "/api/map", "headers": []}, None, send))
    assert said == [{"type": "websocket.close", "code": 1008}]
