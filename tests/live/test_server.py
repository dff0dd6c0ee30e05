"""The server of the live view, on a real socket: what it answers and what it refuses."""

import http.client
import json
import socket
import time

import pytest

from drake_tracker import cli
from drake_tracker.live.server import FILES, LARGEST_REQUEST, Server
from drake_tracker.live.state import LiveState


class Site:
    """A server, the requests that it acted on, and a way to send requests."""

    def __init__(self):
        self.state, self.asked = LiveState(), []
        self.server = Server(self.state, self._act, {"/frame.jpg": b"jpeg", "/board.png": None}.get)
        self.port = self.server.server_address[1]
        self.host = f"127.0.0.1:{self.port}"

    def _act(self, action, values):
        if action != "pause":
            raise ValueError("there is no such action")
        self.asked.append((action, values))
        return {"paused": True}

    def ask(self, method, path, body=None, **headers):
        """Returns (status, body) of a request; ``headers`` with _ for -."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=5)
        connection.putrequest(method, path, skip_host="Host" in headers, skip_accept_encoding=True)
        if body is not None:
            headers.setdefault("Content_Length", str(len(body)))
        for name, value in headers.items():
            connection.putheader(name.replace("_", "-"), value)
        connection.endheaders(body)
        answer = connection.getresponse()
        found = answer.status, answer.read()
        connection.close()
        return found

    def listen(self):
        """Returns a socket that gets events, after the head of the answer."""
        connection = socket.create_connection(("127.0.0.1", self.port), timeout=5)
        connection.sendall(f"GET /events HTTP/1.1\r\nHost: {self.host}\r\n\r\n".encode())
        stream = connection.makefile("rb")
        while stream.readline().strip():
            pass
        return connection, stream


@pytest.fixture
def site():
    site = Site()
    yield site
    site.state.close()
    site.server.close()


def event(stream):
    """The next event of a stream that says something."""
    for line in stream:
        if line.startswith(b"data: "):
            return json.loads(line[6:])
    return None


def wait_until(condition):
    until = time.monotonic() + 5.0
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.01)


@pytest.mark.parametrize("path", FILES)
def test_the_page_and_its_parts_are_served_from_the_package(site, path):
    status, body = site.ask("GET", path)
    assert status == 200 and len(body) > 500


def test_the_page_names_no_other_host(site):
    for path in FILES:
        body = site.ask("GET", path)[1]
        assert b"http://" not in body and b"https://" not in body and b"//cdn" not in body


def test_pictures_are_there_or_not_yet(site):
    assert site.ask("GET", "/frame.jpg") == (200, b"jpeg")
    assert site.ask("GET", "/board.png")[0] == 404


@pytest.mark.parametrize(
    "path",
    ["/server.py", "/index.html", "/../server.py", "/page/../../cli.py", "/..%2fserver.py", "/%2e%2e/cli.py",
     "//etc/passwd", "/live.js?x=/etc/passwd", "/live.css/../live.js", "/frame.jpg/..", "*", "/control"],
)  # fmt: skip
def test_nothing_else_is_served_whatever_the_path(site, path):
    assert site.ask("GET", path)[0] == 404
    assert site.ask("POST", path if path != "/control" else "/", b"{}", Origin=f"http://{site.host}")[0] == 404


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1", "evil.example:{port}", "127.0.0.1:{port}.example", ""])
def test_another_host_is_refused(site, host):
    host = host.format(port=site.port)
    assert site.ask("GET", "/", Host=host)[0] == 403
    assert site.ask("GET", "/events", Host=host)[0] == 403
    body = json.dumps({"action": "pause"}).encode()
    assert site.ask("POST", "/control", body, Host=host, Origin=f"http://{host}")[0] == 403
    assert site.asked == []


def test_the_name_localhost_is_accepted(site):
    assert site.ask("GET", "/", Host=f"localhost:{site.port}")[0] == 200


@pytest.mark.parametrize(
    "origin",
    [None, "null", "http://evil.example", "http://127.0.0.1:1", "https://{host}", "http://{host}.evil.example"],
)
def test_a_page_of_another_origin_may_not_control_the_run(site, origin):
    headers = {} if origin is None else {"Origin": origin.format(host=site.host)}
    status, words = site.ask("POST", "/control", b'{"action": "pause"}', **headers)
    assert status == 403 and b"own page" in words and site.asked == []


def test_its_own_page_may_control_the_run(site):
    origin = f"http://{site.host}"
    assert site.ask("POST", "/control", b'{"action": "pause", "more": 1}', Origin=origin) == (200, b'{"paused": true}')
    assert site.asked == [("pause", {"more": 1})]


@pytest.mark.parametrize(
    "body, status",
    [
        (b"", 400), (b"pause", 400), (b"[]", 400), (b"{}", 400), (b'{"action": "fly"}', 400), (b"\xff", 400),
        (b"[" * LARGEST_REQUEST, 400), (b" " * (LARGEST_REQUEST + 1), 413),
    ],
)  # fmt: skip
def test_invalid_requests_are_refused(site, body, status):
    assert site.ask("POST", "/control", body, Origin=f"http://{site.host}")[0] == status
    assert site.asked == []


def test_a_length_that_is_not_a_number_is_refused(site):
    for length in ("-1", "x", "1e3"):
        assert site.ask("POST", "/control", b"", Origin=f"http://{site.host}", Content_Length=length)[0] == 413


def test_events_have_what_is_new_and_end_with_the_run(site):
    connection, stream = site.listen()
    assert event(stream)["facts"] == {"stage": "preparing"}
    site.state.set_values(time=1.0)
    assert event(stream) == {"time": 1.0}
    site.state.set_facts(stage="over")
    assert event(stream)["facts"]["stage"] == "over"
    site.state.close()
    assert event(stream) is None
    connection.close()


def test_a_page_that_goes_away_harms_nothing(site, capfd):
    connection, stream = site.listen()
    event(stream)
    assert site.state.watchers == 1
    stream.close()
    connection.close()
    for k in range(10):
        site.state.set_values(time=k)
        time.sleep(0.06)
    wait_until(lambda: site.state.watchers == 0)
    assert site.state.left
    _, again = site.listen()
    assert event(again)["time"] == 9
    assert capfd.readouterr().err == ""


def test_it_listens_on_127_0_0_1_only(site):
    assert site.server.server_address[0] == "127.0.0.1"
    with pytest.raises(OSError):
        socket.create_connection(("127.0.0.2", site.port), timeout=1).close()


@pytest.mark.parametrize("port", ["taken", "70000"])
def test_a_port_that_is_taken_is_one_line_and_leaves_nothing(site, port, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    port = str(site.port) if port == "taken" else port
    assert cli.main(["run", "train", "--live", "--port", port]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert f"--port {port}: cannot listen there" in line and "choose another port" in line
    assert list(tmp_path.iterdir()) == []


def test_a_port_without_live_is_refused(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run", "train", "--port", "8000"]) == 2
    assert "add --live" in capsys.readouterr().err and list(tmp_path.iterdir()) == []
