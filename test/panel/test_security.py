"""Who gets in: each rule of docs/panel.md, tried by what would break it."""

import http.client
import io
import logging
import os
import re
import socket
import time
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus

from automax_ros.panel import security
from automax_ros.panel.security import PanelOptions, page_files
from automax_ros.panel.server import MOST_CONNECTIONS, PanelServer
from automax_ros.panel.session import PATIENCE_S
from panel.support import Browser, SmallSource, ask, cookie_of, host_of, served

POLICY = (
    "default-src 'none'; script-src 'self'; connect-src 'self'; worker-src 'self'; style-src 'self'; img-src 'self'; "
    "frame-ancestors 'none'; base-uri 'none'; form-action 'none'"
)
UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "dGhlIHNhbXBsZSBub25jZQ==",
}


@pytest.fixture(scope="module")
def server():
    with served(SmallSource(), operate=True) as running:
        yield running


def port_of(server: PanelServer) -> int:
    return int(host_of(server).rpartition(":")[2])


def asked_with(server: PanelServer, method: str, **headers: str) -> int:
    """The status of an answer to another method; websockets ends the connection in place of 400, by its version."""
    try:
        return ask(server, "/", method=method, Cookie=cookie_of(server), **headers).status
    except http.client.RemoteDisconnected:
        return 400


def opened(server: PanelServer, **headers: str) -> int:
    """The status with which the socket's opening is answered."""
    return ask(server, "/socket", **{"Cookie": cookie_of(server), **UPGRADE, **headers}).status


def test_the_address_is_of_this_machine_and_its_token_of_192_bits(server):
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+/\?token=[\w-]{32}", server.address)
    with socket.socket() as other, pytest.raises(OSError, match="refused"):
        # 127.0.0.2 is this machine too: what listens on all addresses would answer.
        other.connect(("127.0.0.2", port_of(server)))


def test_two_servers_have_different_tokens_and_cookies(server):
    with served(SmallSource()) as other:
        assert other.address.partition("=")[2] != server.address.partition("=")[2]
        names = {cookie_of(item).partition("=")[0] for item in (server, other)}
        assert names == {f"automax_panel_{port_of(item)}" for item in (server, other)}
        assert ask(other, "/", Cookie=cookie_of(server)).status == 403


def test_the_token_leaves_the_address_for_a_cookie_that_no_script_reads(server):
    answer = ask(server, server.address.partition(host_of(server))[2])
    assert (answer.status, answer.headers["Location"]) == (303, "/")
    assert re.fullmatch(
        rf"automax_panel_{port_of(server)}=[\w-]{{32}}; Path=/; HttpOnly; SameSite=Strict", answer.headers["Set-Cookie"]
    )
    assert server.address.partition("=")[2] not in str(answer)


def test_with_the_cookie_the_page_is_served_and_nothing_may_be_kept(server):
    answer = ask(server, "/", Cookie=cookie_of(server))
    assert (answer.status, answer.headers["Content-Type"]) == (200, "text/html; charset=utf-8")
    assert answer.body.startswith("<!doctype html>")
    assert answer.headers["Content-Security-Policy"] == POLICY
    assert answer.headers["X-Content-Type-Options"] == "nosniff"
    assert answer.headers["Referrer-Policy"] == "no-referrer"
    assert answer.headers["Cache-Control"] == "no-store"
    assert answer.headers["Server"] is None


@pytest.mark.parametrize("path", ["/", "/app.js", "/socket", "/nowhere", "/?token="])
@pytest.mark.parametrize(
    "cookie", [None, "", "automax_panel={pass}", "automax_panel_{port}=wrong", "automax_panel_{port}=ä"]
)
def test_without_the_cookie_nothing_is_served_but_what_to_do(server, path, cookie):
    given = {} if cookie is None else {"Cookie": cookie.format(port=port_of(server), **{"pass": "x" * 32})}
    answer = ask(server, path, **UPGRADE, Origin=f"http://{host_of(server)}", **given)
    assert (answer.status, answer.headers["Content-Type"]) == (403, "text/plain; charset=utf-8")
    assert "open the address that the panel printed" in answer.body
    assert answer.headers["Content-Security-Policy"] == POLICY
    assert answer.headers["Set-Cookie"] is None


@pytest.mark.parametrize("token", ["wrong", "{token}x", "{token}&x=1", "", "%00", "a" * 7000])
def test_a_wrong_token_is_refused(server, token):
    answer = ask(server, f"/?token={token.format(token=server.address.partition('=')[2])}")
    assert (answer.status, answer.headers["Set-Cookie"]) == (403, None)


def test_the_token_is_no_cookie_and_the_cookie_no_token(server):
    name, _, value = cookie_of(server).partition("=")
    assert ask(server, "/", Cookie=f"{name}={server.address.partition('=')[2]}").status == 403
    assert ask(server, f"/?token={value}").status == 403


def test_a_cookie_of_the_same_name_from_another_port_does_not_lock_out(server):
    cookie = cookie_of(server)
    assert ask(server, "/", Cookie=f"{cookie.partition('=')[0]}=planted; {cookie}").status == 200


def test_secrets_are_compared_in_constant_time():
    text = Path(security.__file__).read_text(encoding="utf-8")
    assert not re.findall(r"self\._(?:token|pass)\b\s*[!=]=|[!=]=\s*self\._(?:token|pass)\b", text)
    assert "hmac.compare_digest" in text


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1",
        "127.0.0.1:1",
        "0.0.0.0:{port}",
        "[::1]:{port}",
        "",
        "127.0.0.1:{port}.evil.example",
    ],
)
@pytest.mark.parametrize("path", ["/", "/socket", "/?token={token}"])
def test_another_name_of_the_host_is_refused_even_with_cookie_and_token(server, host, path):
    """A name that its owner lets point to 127.0.0.1 (DNS rebinding) comes with that name."""
    asked = path.format(token=server.address.partition("=")[2])
    answer = ask(server, asked, Cookie=cookie_of(server), **UPGRADE, Host=host.format(port=port_of(server)))
    assert answer.status in (400, 403)
    assert answer.headers["Set-Cookie"] is None


def test_two_hosts_in_one_request_are_refused(server):
    with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as raw:
        lines = ["GET / HTTP/1.1", f"Host: {host_of(server)}", "Host: evil.example", f"Cookie: {cookie_of(server)}"]
        raw.sendall("\r\n".join([*lines, "", ""]).encode())
        assert b" 403 " in raw.recv(100)


def test_localhost_is_a_name_of_this_machine(server):
    assert ask(server, "/", Cookie=cookie_of(server), Host=f"LOCALHOST:{port_of(server)}").status == 200


def test_the_socket_opens_for_a_page_of_the_same_address(server):
    assert opened(server, Origin=f"http://{host_of(server)}") == 101
    name = f"localhost:{port_of(server)}"
    assert opened(server, Origin=f"http://{name}", Host=name) == 101


@pytest.mark.parametrize(
    "origin",
    ["http://evil.example", "http://127.0.0.1", "http://127.0.0.1:1", "http://localhost:{port}", "null", "", "file://",
     "http://127.0.0.1:{port}.evil.example", "ws://127.0.0.1:{port}", "http://127.0.0.1:{port}/"],
)  # fmt: skip
def test_the_socket_is_refused_to_pages_of_another_address_another_port_too(server, origin):
    assert opened(server, Origin=origin.format(port=port_of(server))) == 403


def test_the_socket_is_refused_to_what_names_no_page(server):
    assert opened(server) == 403


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS", "HEAD", "TRACE", "CONNECT", "get"])
def test_only_get_is_answered(server, method):
    assert asked_with(server, method) in (400, 405)


def test_a_body_is_not_read(server):
    assert asked_with(server, "POST", **{"Content-Length": "1000000000"}) in (400, 405)


@pytest.mark.parametrize(
    "path",
    ["/../security.py", "/..%2fsecurity.py", "/%2e%2e/security.py", "//etc/passwd", "/etc/passwd", "/page/index.html",
     "/vendor/../../source.py", "/vendor", "/vendor/", "/app.js/", "/app.js%00.html", "/\\..\\source.py", "/INDEX.HTML",
     "/.", "/index.html/../index.html", "http://127.0.0.1/index.html", "*", "/C:/", "/app.js;x", "/~root"],
)  # fmt: skip
def test_only_files_of_the_list_exist(server, path):
    assert ask(server, path, Cookie=cookie_of(server)).status in (400, 403, 404)


def test_the_files_are_those_of_the_page_and_read_once(server, monkeypatch):
    files = page_files()
    assert {"/", "/index.html", "/app.js", "/vendor/uplot/uPlot.esm.js"} <= set(files)
    assert not [name for name in files if name.endswith((".py", ".pyc"))]
    cookie = cookie_of(server)
    monkeypatch.setattr(os, "open", lambda *_: pytest.fail("a file is opened for a request"))
    monkeypatch.setattr(io, "open", lambda *_: pytest.fail("a file is opened for a request"))
    for name, (kind, content) in files.items():
        answer = ask(server, name, Cookie=cookie)
        assert (answer.status, answer.headers["Content-Type"]) == (200, kind)
        assert len(answer.body.encode()) == len(content)


def test_a_query_changes_no_file(server):
    assert ask(server, "/app.js?../../security.py", Cookie=cookie_of(server)).status == 200


@pytest.mark.parametrize(
    "head",
    [b"X: " + b"y" * 100_000, b"\r\n".join(b"X%d: y" % n for n in range(5000)), b"X" * 1_000_000, b"\x00\xff: \x01"],
    ids=["a long one", "5000", "no end", "no text"],
)
def test_a_flood_of_headers_is_cut_off(server, head):
    with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as raw:
        try:
            raw.sendall(b"GET / HTTP/1.1\r\nHost: " + host_of(server).encode() + b"\r\n" + head + b"\r\n\r\n")
            answer = raw.recv(100)
        except (ConnectionResetError, BrokenPipeError):
            answer = b""
    assert answer == b"" or answer.startswith(b"HTTP/1.1 4")
    assert ask(server, "/", Cookie=cookie_of(server)).status == 200


def test_those_who_connect_and_say_nothing_keep_nobody_out_for_long(server):
    """More than a process has files for: those beyond the limit end at once, the others after some seconds."""
    idle = [socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) for _ in range(MOST_CONNECTIONS + 20)]
    assert len(os.listdir("/proc/self/fd")) < 400
    end = time.monotonic() + 30
    status = 0
    while status != 200 and time.monotonic() < end:
        try:
            status = ask(server, "/", Cookie=cookie_of(server)).status
        except (ConnectionError, OSError):
            time.sleep(0.2)
    for item in idle:
        item.close()
    assert status == 200


def test_nothing_secret_is_written_anywhere(capfd, caplog):
    """Also not by the logger of the library, which writes the heads of requests."""
    caplog.set_level(logging.DEBUG)
    with served(SmallSource(), operate=True) as server:
        token, cookie = server.address.partition("=")[2], cookie_of(server)
        with Browser(server, cookie) as browser:
            browser.ask("watch", names=["REF%"])
        with socket.create_connection(("127.0.0.1", port_of(server)), timeout=20) as raw:
            raw.sendall(f"NONSENSE {server.address} {cookie}\r\n\r\n".encode())
            raw.recv(100)
        with pytest.raises(InvalidStatus):
            Browser(server, cookie, origin="http://evil.example")
        ask(server, f"/?token={token}x")
    out, err = capfd.readouterr()
    # Our own client's log has them, as a browser's would.
    told = out + err + "".join(record.getMessage() for record in caplog.records if "client" not in record.name)
    assert token not in told
    assert cookie.partition("=")[2] not in told


def test_other_machines_only_by_the_names_of_the_list():
    options = {"host": "0.0.0.0", "allowed": ("PC7.plant.example", "panel.example:443")}
    with served(SmallSource(), **options) as server:
        port = port_of(server)
        assert server.address.startswith(f"http://pc7.plant.example:{port}/?token=")
        cookie = cookie_of(server)
        names = {
            "pc7.plant.example": 403,
            f"pc7.plant.example:{port}": 200,
            "panel.example": 200,
            f"127.0.0.1:{port}": 200,
        }
        for name, status in {**names, f"panel.example:{port}": 403, "evil.example": 403}.items():
            assert ask(server, "/", Cookie=cookie, Host=name).status == status, name
        # A proxy with TLS in front says https.
        assert opened(server, Host="panel.example", Origin="https://panel.example") == 101
        assert opened(server, Host="panel.example", Origin="https://evil.example") == 403


def test_by_default_it_listens_to_this_machine_alone_and_nothing_may_be_operated():
    assert PanelOptions() == PanelOptions(port=None, host="127.0.0.1", allowed=(), operate=False)


def test_a_message_of_a_megabyte_ends_the_connection_that_sent_it_alone(server):
    with Browser(server) as other, Browser(server) as browser:
        with pytest.raises(ConnectionClosed) as closed:
            browser.send("x" * 1_000_000)
        assert closed.value.rcvd is None or closed.value.rcvd.code == 1009
        assert "ok" in other.ask("watch", names=[])


def test_a_ninth_browser_is_told_and_the_eight_go_on(server):
    eight = [Browser(server) for _ in range(8)]
    with Browser(server) as ninth, pytest.raises(ConnectionClosed) as closed:
        ninth.next("hello")
    assert (closed.value.rcvd.code, closed.value.rcvd.reason) == (1013, "8 browsers are open already: close one")
    for browser in eight:
        assert "ok" in browser.ask("watch", names=["REF%"])
        browser.socket.close()
    end = time.monotonic() + 20
    while time.monotonic() < end:
        with Browser(server) as again:
            try:
                again.next("hello")
            except ConnectionClosed:
                continue
            return
    pytest.fail("nobody is let in although all have gone")


def test_a_browser_that_never_reads_is_skipped_then_dropped():
    source = SmallSource()
    with served(source, operate=True) as server, Browser(server) as reading:
        raw = socket.socket()
        raw.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        raw.settimeout(30)
        raw.connect(("127.0.0.1", port_of(server)))
        head = {"Host": host_of(server), "Origin": f"http://{host_of(server)}", "Cookie": cookie_of(server), **UPGRADE}
        raw.sendall("".join(["GET /socket HTTP/1.1\r\n", *(f"{k}: {v}\r\n" for k, v in head.items()), "\r\n"]).encode())
        assert raw.recv(20).startswith(b"HTTP/1.1 101")
        sessions = server._sessions
        while len(sessions) < 2:
            time.sleep(0.01)
        began = time.monotonic()
        for number in range(50):  # each is answered by a megabyte, masked by zeros
            text = f'{{"id":{number},"do":"scan","task":"SPEED"}}'.encode()
            raw.sendall(bytes([0x81, 0x80 | len(text), 0, 0, 0, 0]) + text)
        most = 0
        while len(sessions) > 1 and time.monotonic() < began + 60:
            most = max([most, *(item._waiting() for item in list(sessions))])
            source.time_ns += 1
            assert reading.next("frame")["t"] > 0
        assert len(sessions) == 1
        assert time.monotonic() - began >= PATIENCE_S
        assert most < 5_000_000, "not fifty answers wait"
        raw.close()
