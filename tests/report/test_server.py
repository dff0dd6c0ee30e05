"""The server: it serves listed files and ranges of them, on loopback only."""

import http.client
import socket
import threading

import pytest

from drake_tracker import cli
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.report.run_files import read_run
from drake_tracker.report.server import make_server

VIDEO = bytes(range(256)) * 4


@pytest.fixture
def server(run_folder):
    (run_folder.parent / "secret.txt").write_text("secret")
    (run_folder / "notes.txt").write_text("not of the run")
    (run_folder / "motion.png").unlink()
    (run_folder / "motion.png").symlink_to(run_folder.parent / "secret.txt")
    with make_server("<p>the page</p>", run_folder, ("cameras.mp4", "log.npz", "motion.png"), 0) as server:
        threading.Thread(target=server.serve_forever, args=(0.01,), daemon=True).start()
        yield server
        server.shutdown()


def ask(server, path, method="GET", host=None, **headers):
    """Returns (status, headers, body) of a request whose path is sent as it is."""
    port = server.server_address[1]
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=5)
    connection.putrequest(method, path, skip_host=True)
    if host is None:
        host = f"127.0.0.1:{port}"
    if host:
        connection.putheader("Host", host)
    for name, value in headers.items():
        connection.putheader(name, value)
    connection.endheaders()
    answer = connection.getresponse()
    found = answer.status, dict(answer.getheaders()), answer.read()
    connection.close()
    return found


def test_the_page_and_its_files_are_served(server):
    assert server.server_address[0] == "127.0.0.1"
    status, headers, body = ask(server, "/")
    assert (status, body) == (200, b"<p>the page</p>")
    assert headers["Content-Type"].startswith("text/html")
    assert headers["Content-Security-Policy"].startswith("default-src 'self'")
    status, headers, body = ask(server, "/cameras.mp4")
    assert (status, headers["Content-Type"], body) == (200, "video/mp4", VIDEO)
    assert ask(server, "/cameras.mp4", "HEAD")[2] == b""
    assert ask(server, f"/?port={server.server_address[1]}", host=f"localhost:{server.server_address[1]}")[0] == 200


@pytest.mark.parametrize(
    "path",
    [
        "/../secret.txt",
        "/%2e%2e/secret.txt",
        "/..%2fsecret.txt",
        "//etc/passwd",
        "/etc/passwd",
        "/notes.txt",
        "/.",
        "/cameras.mp4/../../secret.txt",
        "/./cameras.mp4",
        "cameras.mp4",
        "/cameras.mp4%00",
        "http://elsewhere/log.npz",
    ],
)
def test_no_path_leads_out_of_the_directory(server, path):
    status, _, body = ask(server, path)
    assert (status, body) == (404, b"there is no such file\n")


def test_a_link_out_of_the_directory_is_not_followed(server, run_folder):
    assert (run_folder / "motion.png").read_text() == "secret"
    assert ask(server, "/motion.png")[0] == 404
    assert "motion.png" not in read_run(run_folder).names


@pytest.mark.parametrize("host", ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1:1", ""])
def test_another_host_is_refused(server, host):
    status, _, body = ask(server, "/", host=host)
    assert (status, body) == (403, b"this is not the host that was asked for\n")


@pytest.mark.parametrize("method", ["POST", "PUT", "DELETE", "OPTIONS"])
def test_only_get_and_head_are_allowed(server, method):
    assert ask(server, "/", method)[0] == 501


@pytest.mark.parametrize(
    ("asked", "status", "first", "last"),
    [
        ("bytes=10-19", 206, 10, 19),
        ("bytes=1000-", 206, 1000, 1023),
        ("bytes=-24", 206, 1000, 1023),
        ("bytes=0-99999", 206, 0, 1023),
        ("bytes=-99999", 206, 0, 1023),
        ("bytes=5-2", 416, None, None),
        ("bytes=1024-", 416, None, None),
        ("bytes=-0", 416, None, None),
        ("bytes=1-2,5-6", 200, 0, 1023),
        ("lines=1-2", 200, 0, 1023),
        ("bytes=-", 200, 0, 1023),
    ],
)
def test_ranges_of_a_video_are_served(server, asked, status, first, last):
    found, headers, body = ask(server, "/cameras.mp4", Range=asked)
    assert found == status
    if status == 416:
        assert headers["Content-Range"] == "bytes */1024" and VIDEO[:8] not in body
        return
    assert body == VIDEO[first : last + 1]
    if status == 206:
        assert headers["Content-Range"] == f"bytes {first}-{last}/1024"


def test_a_taken_port_is_one_line(run_folder, capsys):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert cli.main(["view", str(run_folder), "--no-browser", "--port", str(port)]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and f"--port {port}: cannot listen there (Address already in use)" in error
    assert not (run_folder / "report.html").exists()


@pytest.mark.parametrize("port", [-1, 65536])
def test_a_port_that_does_not_exist_is_refused(run_folder, port):
    with pytest.raises(DrakeTrackerError, match=f"port {port}"):
        make_server("", run_folder, (), port)


def test_the_command_writes_the_page_and_serves_it(run_folder, capsys, monkeypatch):
    from http.server import ThreadingHTTPServer

    def interrupted(self):
        raise KeyboardInterrupt

    monkeypatch.setattr(ThreadingHTTPServer, "serve_forever", interrupted)
    assert cli.main(["view", str(run_folder), "--no-browser", "--port", "0"]) == 0
    assert "http://127.0.0.1:" in capsys.readouterr().out
    assert "Attempt 1 missed" in (run_folder / "report.html").read_text()


def test_a_missing_run_is_one_line(tmp_path, capsys):
    assert cli.main(["view", str(tmp_path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith("drake-tracker: ") and error.count("\n") == 1
