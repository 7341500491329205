"""Who gets in: the names that a browser may ask for, the token of the printed address, the cookie it is exchanged for.

All is decided from the head of a request; nothing of a request ever names a file of the disk.
"""

from __future__ import annotations

import hmac
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from http import HTTPStatus
from importlib import resources

from websockets.datastructures import Headers
from websockets.http11 import Response

LOOPBACK = ("127.0.0.1", "localhost")
"""Hosts that other machines cannot reach."""
SOCKET = "/socket"
"""The path of the socket."""
_TEXT = "text/plain; charset=utf-8"
_TYPES = {".html": "text/html; charset=utf-8", ".js": "text/javascript; charset=utf-8"}
_TYPES |= {".css": "text/css; charset=utf-8", ".svg": "image/svg+xml"}
_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; script-src 'self'; connect-src 'self'; worker-src 'self'; "
    "style-src 'self'; img-src 'self'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
    "Connection": "close",
}
_LOST = "open the address that the panel printed when it started: it lets this browser in"
_LEFT_OUT = (":80", ":443")
"""Ports that browsers leave out of a name."""


@dataclass(frozen=True)
class PanelOptions:
    """How a panel is served.

    ``port`` None is the first free one from 8470 on. ``allowed`` are names, NAME or NAME:PORT, by which browsers may
    ask for it, apart from those of the loopback. ``operate``: who is let in may operate a rack that allows it.
    """

    port: int | None = None
    host: str = LOOPBACK[0]
    allowed: tuple[str, ...] = ()
    operate: bool = False


def page_files() -> dict[str, tuple[str, bytes]]:
    """Return type and content of each file of the page by its path, ``/`` being the first; they are read only here."""
    with resources.as_file(resources.files("automax_ros.panel") / "page") as page:
        files = {path.relative_to(page).as_posix(): path for path in page.rglob("*") if path.suffix in _TYPES}
        files[""] = page / "index.html"
        return {f"/{name}": (_TYPES[path.suffix], path.read_bytes()) for name, path in files.items()}


class Gate:
    """Decides on each request over HTTP: a file, the cookie, a refusal, or the way to the socket.

    Attributes:
        address: the address that lets a browser in; whoever knows it is let in.
    """

    def __init__(self, options: PanelOptions, port: int, files: Mapping[str, tuple[str, bytes]]) -> None:
        self._hosts = [_host(name.lower(), port) for name in (*options.allowed, *LOOPBACK)]
        self._files, self._cookie = files, f"automax_panel_{port}"
        self._token, self._pass = secrets.token_urlsafe(24), secrets.token_urlsafe(24)
        self.address = f"http://{self._hosts[0]}/?token={self._token}"

    def answer(self, method: str, path: str, headers: Headers) -> Response | None:
        """Return the answer to the head of a request; None: the socket may be opened."""
        hosts, origins = ([value.lower() for value in headers.get_all(name)] for name in ("Host", "Origin"))
        place, _, query = path.partition("?")
        if method != "GET":
            return _reply(HTTPStatus.METHOD_NOT_ALLOWED, "only GET is answered")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return _reply(HTTPStatus.FORBIDDEN, "the panel is not known by this name: --allow-host NAME adds one")
        if place == "/" and _same(query, f"token={self._token}"):
            # The redirection takes the token out of the browser's address and history.
            cookie = f"{self._cookie}={self._pass}; Path=/; HttpOnly; SameSite=Strict"
            return _reply(HTTPStatus.SEE_OTHER, "", **{"Location": "/", "Set-Cookie": cookie})
        if not self._has_cookie(headers):
            return _reply(HTTPStatus.FORBIDDEN, _LOST)
        if place != SOCKET:
            kind, content = self._files.get(place, (_TEXT, b""))
            return _reply(HTTPStatus.OK if content else HTTPStatus.NOT_FOUND, content or "there is no such file", kind)
        # A page of another port is foreign; https is that of a proxy in front.
        if len(origins) != 1 or origins[0] not in (f"http://{hosts[0]}", f"https://{hosts[0]}"):
            return _reply(HTTPStatus.FORBIDDEN, "only pages of this address may open the socket")
        return None

    def _has_cookie(self, headers: Headers) -> bool:
        """Whether one of the cookies is right: servers of other ports may have put more of its name."""
        cookies = [item.strip() for line in headers.get_all("Cookie") for item in line.split(";")]
        return any(_same(item, f"{self._cookie}={self._pass}") for item in cookies)


def _host(name: str, port: int) -> str:
    """Return a name as it stands in requests: with its port, but for the two that browsers leave out."""
    host = name if ":" in name.rpartition("]")[2] else f"{name}:{port}"
    return next((host.removesuffix(end) for end in _LEFT_OUT if host.endswith(end)), host)


def _same(given: str, wanted: str) -> bool:
    return hmac.compare_digest(given.encode(errors="replace"), wanted.encode())


def _reply(status: HTTPStatus, content: str | bytes, kind: str = _TEXT, **more: str) -> Response:
    body = content if isinstance(content, bytes) else f"{content}\n".encode()
    headers = {**_HEADERS, "Content-Type": kind, "Content-Length": str(len(body)), **more}
    return Response(status.value, status.phrase, Headers(headers), body)
