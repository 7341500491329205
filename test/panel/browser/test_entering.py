"""The rules of who gets in, tried in a real browser: by pages of other addresses, and by names that point here."""

import http.server
import threading
from collections.abc import Iterator
from typing import Any

import pytest

from automax_ros.panel.server import PanelServer
from panel.browser.conftest import chromium
from panel.support import Browser, SmallSource, host_of, served

NAMES = {"names": [], "plants": [], "webs": [], "tasks": [], "switches": [], "watch": [], "other": None, "kind": "rack"}
FOREIGN = """
async (address) => {
  const said = {};
  const opened = await new Promise((done) => {
    const socket = new WebSocket(`ws://${address}/socket`);
    socket.onopen = () => done(true);
    socket.onerror = () => done(false);
  });
  said.socket = opened;
  for (const mode of ["cors", "no-cors"])
    said[mode] = await fetch(`http://${address}/app.js`, { mode, credentials: "include" }).then(
      () => true,
      () => false,
    );
  for (const kind of ["script", "img", "iframe"])
    said[kind] = await new Promise((done) => {
      const element = document.createElement(kind);
      element.onload = () => done(kind !== "iframe" || element.contentDocument !== null);
      element.onerror = () => done(false);
      element.src = kind === "iframe" ? `http://${address}/` : `http://${address}/app.js`;
      document.body.append(element);
    });
  return said;
}
"""


class PageSource(SmallSource):
    """What a page needs to greet."""

    def hello(self) -> Any:
        return {**super().hello(), **NAMES, "title": "PM1", "version": "0"}


@pytest.fixture
def server() -> Iterator[PanelServer]:
    with served(PageSource()) as running:
        yield running


@pytest.fixture
def elsewhere() -> Iterator[str]:
    """The address of an empty page of another port of this machine."""

    class Empty(http.server.BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            self.send_response(200)
            self.send_header("Content-Type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><body></body>")

        def log_message(self, *_: Any) -> None:
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Empty) as other:
        threading.Thread(target=other.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{other.server_port}/"
        other.shutdown()


def test_the_token_leaves_the_address_and_no_script_sees_the_cookie(page, server):
    answer = page.goto(server.address)
    assert answer.status == 200
    assert page.url == f"http://{host_of(server)}/"
    assert page.evaluate("document.cookie") == ""
    assert page.evaluate("performance.getEntries().map((entry) => entry.name).join()").count("token") == 0
    page.reload()
    assert page.url == f"http://{host_of(server)}/"


def test_without_the_address_a_browser_is_told_what_to_open(page, server):
    answer = page.goto(f"http://{host_of(server)}/")
    assert answer.status == 403
    assert "open the address that the panel printed" in page.inner_text("body")


def test_a_page_of_another_port_gets_nothing_although_its_cookie_is_sent(browser, server, elsewhere):
    """127.0.0.1 is one site to a browser, whatever the port: SameSite alone would let it in."""
    context = browser.new_context()
    opened = context.new_page()
    opened.goto(server.address)
    opened.goto(elsewhere)
    said = opened.evaluate(FOREIGN, host_of(server))
    context.close()
    assert said == dict.fromkeys(said, False)
    assert {"socket", "cors", "no-cors", "script", "img", "iframe"} == set(said)
    with Browser(server) as other:
        assert "ok" in other.ask("watch", names=[])


def test_a_name_that_points_to_this_machine_gets_nothing(browser, server):
    """As DNS rebinding does: the browser believes that the panel is evil.example."""
    rules = "--host-resolver-rules=MAP evil.example 127.0.0.1"
    started = browser.browser_type.launch(executable_path=chromium(), args=["--no-sandbox", rules])
    try:
        opened = started.new_page()
        port = host_of(server).rpartition(":")[2]
        token = server.address.partition("?")[2]
        answer = opened.goto(f"http://evil.example:{port}/?{token}")
        assert answer.status == 403
        assert started.contexts[0].cookies() == []
    finally:
        started.close()


def test_nothing_inline_runs_in_the_page(browser, server):
    context = browser.new_context()
    opened = context.new_page()
    opened.goto(server.address)
    opened.evaluate(
        """() => {
          const script = document.createElement("script");
          script.textContent = "window.ran = true";
          document.body.append(script);
          document.body.insertAdjacentHTML("beforeend", '<img src="x" onerror="window.ran = true">');
        }"""
    )
    opened.wait_for_timeout(300)
    assert opened.evaluate("window.ran === undefined")
    context.close()
