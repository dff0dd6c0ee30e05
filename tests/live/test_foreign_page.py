"""What a page of another origin can do to a run that is watched: nothing. The attacks run in a real browser.

Meshcat itself accepts every connection, and an empty message ends its program, which the run must survive.
"""

import json
import signal
import threading
import urllib.request
from http.server import BaseHTTPRequestHandler, HTTPServer

import psutil
import pytest
from browsing import NEVER_GRASPS, PATIENCE, chromium, live_run, until

CONNECT = """urls => Promise.all(urls.map(url => new Promise(resolve => {
  let got = "nothing";
  const socket = new WebSocket(url);
  socket.onopen = () => { got = "a connection"; socket.send(new Uint8Array(0)); };
  socket.onmessage = () => { got = "the scene"; };
  socket.onclose = () => resolve(got);
  setTimeout(() => resolve(got), 3000);
})))"""
READ = """async url => {
  const load = (tag, key) => new Promise(resolve => {
    const element = document.createElement(tag);
    element.onload = () => resolve("loaded");
    element.onerror = () => resolve("refused");
    element[key] = url;
    document.body.append(element);
  });
  const fetched = await fetch(url).then(() => "loaded", () => "refused");
  return [fetched, await load("img", "src"), await load("script", "src")];
}"""
IS_COMPLETE = "'train' in (viewer.scene_tree.children.drake?.children.laboratory?.children ?? {})"
SEND_FROM_THE_SCENE = "viewer.connection.send(new Uint8Array(0)), viewer.connection.readyState"


class Foreign(BaseHTTPRequestHandler):
    """An empty page."""

    def do_GET(self):
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        self.wfile.write(b"<!DOCTYPE html><body></body>")

    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def browser():
    """A browser for which every name in .example is this machine, as it is after DNS rebinding."""
    with chromium("--host-resolver-rules=MAP *.example 127.0.0.1") as browser:
        yield browser


def facts(run):
    """Yields what the page of a run receives, one dict after the other."""
    for line in urllib.request.urlopen(f"{run.url}events"):
        if line.startswith(b"data: "):
            yield json.loads(line[6:])


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run; ``scene`` is the address of its scene."""
    with live_run(tmp_path_factory.mktemp("foreign"), NEVER_GRASPS) as run:
        run.scene = next(news["facts"]["scene"] for news in facts(run) if "scene" in news.get("facts", {}))
        next(news for news in facts(run) if news.get("time", 0.0) > 0.1)
        yield run


@pytest.fixture
def foreign(browser):
    """A page of another site."""
    server = HTTPServer(("127.0.0.1", 0), Foreign)
    threading.Thread(target=server.serve_forever, args=(0.05,), daemon=True).start()
    page = browser.new_page()
    page.goto(f"http://evil.example:{server.server_address[1]}/")
    yield page
    page.close()
    server.shutdown()
    server.server_close()


def test_it_reads_nothing_of_the_page_and_the_scene(foreign, run):
    for url in (run.url, *(run.url + name for name in ("frame.jpg", "events", "live.js")), run.scene):
        assert set(foreign.evaluate(READ, url)) == {"refused"}, url


def test_it_shows_neither_in_a_frame(foreign, run):
    for url in (run.url, run.scene):
        with foreign.expect_console_message(lambda message: "frame-ancestors" in message.text):
            foreign.evaluate("url => { document.body.innerHTML = `<iframe src=${url}></iframe>` }", url)


def test_a_name_that_was_made_to_resolve_to_this_machine_opens_neither(browser, run):
    page = browser.new_page()
    for url in (run.url, run.scene):
        port = url.rstrip("/").split(":")[-1]
        assert page.goto(f"http://rebound.example:{port}/").status == 403
    page.close()


def test_it_has_no_hold_of_a_page_that_it_opens(foreign, run):
    with foreign.context.expect_page() as opened:
        foreign.evaluate("url => { window.opened = window.open(url) }", run.url)
    until(lambda: foreign.evaluate("window.opened.closed"))
    opened.value.close()


def test_it_connects_to_nothing_and_the_run_survives_what_the_scene_sends(browser, foreign, run):
    listening = [c.laddr for c in psutil.Process(run.pid).net_connections("tcp") if c.status == psutil.CONN_LISTEN]
    urls = [f"ws://{host}:{address.port}/" for address in listening for host in ("127.0.0.1", "localhost", "[::1]")]
    assert set(foreign.evaluate(CONNECT, urls)) == {"nothing"}
    assert len(listening) == 3, "the page, the scene, and Meshcat at an address that nobody knows"

    page = browser.new_page(viewport={"width": 60, "height": 40})
    page.goto(run.scene)
    until(lambda: page.evaluate(IS_COMPLETE))
    assert page.evaluate(SEND_FROM_THE_SCENE) == 1
    page.close()
    times = [news["time"] for news, _ in zip(facts(run), range(20)) if "time" in news]
    assert times[-1] > times[0], "the run is over"
    run.send_signal(signal.SIGINT)
    assert run.wait(PATIENCE) == 130 and "Traceback" not in run.printed()
    assert (run.out / "recording.html").exists()
