"""Tests of the common part of the servers: requests that are not what they seem."""

import json
import socket

import pytest

from drake_tracker.core.processes.loopback_server import BackgroundServer, LoopbackHandler


class Handler(LoopbackHandler):
    timeout = 0.3

    def do_GET(self):
        if self.is_addressed():
            self.refuse(404, "there is no such page")

    def do_POST(self):
        self.answer_own_request("/set", 100, "not from this page", lambda value: {"got": value})


@pytest.fixture(scope="module")
def server():
    with BackgroundServer(Handler, 0, "test") as server:
        server.start()
        yield server


def ask(server, head, body=b"", more=b""):
    """Sends a request, and returns the answers until the server closes the connection."""
    host = server.url.removeprefix("http://").rstrip("/")
    text = f"{head}\r\nHost: {host}\r\nOrigin: http://{host}\r\n".encode() + more + b"\r\n" + body
    with socket.create_connection(host.split(":"), timeout=10.0) as connection:
        connection.sendall(text)
        said = b""
        while part := connection.recv(65536):
            said += part
    return said


def post(server, body, length=None):
    return ask(server, "POST /set HTTP/1.1", body, b"Content-Length: %s\r\n" % (length or str(len(body)).encode()))


@pytest.mark.parametrize("value", [{"speed": 1.5}, [1, "\u00e9"], None])
def test_a_request_of_the_page_is_answered(server, value):
    answer = post(server, json.dumps(value).encode())  # without keep-alive in the request, the time-out ends it
    assert answer.startswith(b"HTTP/1.1 200 ") and json.loads(answer.split(b"\r\n\r\n")[1]) == {"got": value}


@pytest.mark.parametrize("length", [b"9" * 5000, b"-1", b"1e3", "\u0661".encode(), b"101", b""])
def test_a_length_that_is_none_is_refused(server, length):
    assert post(server, b"{}", length or b" ").startswith(b"HTTP/1.1 413 ")


@pytest.mark.parametrize(
    "body", [b'"\\ud800"', b'{"\\udfff": 1}', b"NaN", b"[Infinity]", b"\xff", b"{", b"[" * 90, b"1" * 99]
)
def test_what_is_no_json_is_refused(server, body):
    answer = post(server, body)
    assert answer.startswith((b"HTTP/1.1 400 ", b"HTTP/1.1 200 ")) and (b"200" in answer[:13]) == (body == b"1" * 99)


SECOND = b"POST /set HTTP/1.1\r\nHost: there\r\nContent-Length: 2\r\n\r\n{}"


@pytest.mark.parametrize(
    "head, more",
    [
        ("GET / HTTP/1.1", b"Content-Length: %d\r\n" % len(SECOND)),
        ("HEAD / HTTP/1.1", b"Content-Length: 5\r\n"),
        ("GET / HTTP/1.1", b"Transfer-Encoding: chunked\r\n"),
        ("POST /set HTTP/1.1", b"Transfer-Encoding: chunked\r\n"),
        ("POST /set HTTP/1.1", b"Content-Length: 2\r\nContent-Length: 40\r\n"),
    ],
)
def test_a_body_is_never_taken_for_the_next_request(server, head, more):
    answer = ask(server, head, SECOND, more)
    assert answer.startswith(b"HTTP/1.1 400 ") and answer.count(b"HTTP/1.1 ") == 1
    assert b"Connection: close" in answer


def test_a_connection_that_does_not_move_is_closed(server, capfd):
    host = server.url.removeprefix("http://").rstrip("/")
    for begin in (
        b"",
        b"GET / HT",
        b"GET / HTTP/1.1\r\nHost: a\r\n",
        b"POST /set HTTP/1.1\r\nContent-Length: 50\r\n\r\n{",
    ):
        with socket.create_connection(host.split(":"), timeout=10.0) as connection:
            connection.sendall(begin)
            while connection.recv(65536):
                pass
    assert capfd.readouterr().err == ""


def test_the_servers_of_the_package_have_a_time_out():
    assert 0.0 < LoopbackHandler.timeout <= 60.0
