"""The page in which the user shows the object."""

import http.client
import json
import threading

import numpy as np
import pytest
from browsing import chromium, until
from films import film, write_images

from drake_tracker import cli
from drake_tracker.commands import track as command
from drake_tracker.own_cameras import pick as picking
from drake_tracker.own_cameras.pick import PickServer

IMAGE = np.full((240, 320, 3), 90, np.uint8)


@pytest.fixture
def server():
    made = PickServer([IMAGE])
    yield made
    made.close()


def ask(server, path="/pick", body=None, **headers):
    """Status and body of a request; a POST with a body."""
    line = http.client.HTTPConnection(*server.server_address, timeout=10)
    own = {"Host": f"127.0.0.1:{server.server_address[1]}"}
    if body is not None:
        own["Origin"] = server.url.rstrip("/")
    line.request("GET" if body is None else "POST", path, body, own | headers)
    answer = line.getresponse()
    return answer.status, answer.read()


def choose(server, **values):
    return ask(server, body=json.dumps({"roi": [], "follow": []} | values))


def test_the_page_and_the_first_image_are_served(server):
    status, page = ask(server, "/")
    assert status == 200 and b"Which object?" in page
    for path in ("/pick.js", "/pick.css"):
        assert ask(server, path)[0] == 200
    assert json.loads(ask(server, "/cameras")[1]) == [[320, 240]]
    assert ask(server, "/image0.png")[1].startswith(b"\x89PNG")
    for path in ("/image1.png", "/../pick.py", "/etc/passwd"):
        assert ask(server, path)[0] == 404


def test_a_choice_ends_the_wait(server):
    assert choose(server, follow=["12,34"], roi=["1,2 100,2 50,90"])[0] == 200
    assert server.picked.is_set() and server.follow == ["12,34"] and server.roi == ["1,2 100,2 50,90"]


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({}, "nothing is drawn yet"),
        ({"follow": ["400,10"]}, "outside of the image"),
        ({"follow": ["1,1", "2,2"]}, "draw in each of the 1 images"),
        ({"roi": ["1,1 2,2"]}, "three corners"),
        ({"roi": 5}, "must be lists of texts"),
        ({"follow": [[1, 2]]}, "must be lists of texts"),
    ],
)
def test_what_cannot_be_used_is_refused(server, values, words):
    status, said = choose(server, **values)
    assert status == 400 and words in said.decode() and not server.picked.is_set()


def test_another_page_cannot_choose(server):
    body = json.dumps({"roi": [], "follow": ["5,5"]})
    assert ask(server, body=body, Origin="http://elsewhere.example")[0] == 403
    assert ask(server, body=body, Host="elsewhere.example")[0] == 403
    assert ask(server, "/", Host="elsewhere.example")[0] == 403
    assert ask(server, body="x" * 70_000)[0] == 413
    assert ask(server, body="[" * 50_000)[0] == 400
    assert not server.picked.is_set()


def test_the_command_tracks_what_was_picked(tmp_path, monkeypatch, capsys):
    source = write_images(tmp_path / "shots", film("left", np.arange(20) / 30.0))
    made = []

    class Serving(PickServer):
        def __init__(self, images):
            super().__init__(images)
            made.append(self)
            threading.Timer(0.1, self.take, [{"roi": ["0,0,320,240"], "follow": []}]).start()

    monkeypatch.setattr(picking, "PickServer", Serving)
    arguments = ["track", source, "--fps", "30", "--no-overlay", "--out", str(tmp_path / "out")]
    assert cli.main([*arguments, "--pick"]) == 0
    said = capsys.readouterr().out
    assert made[0].url in said and "--roi '0,0,320,240'" in said
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["roi"] == ["0,0,320,240"]
    assert cli.main([*arguments[:-1], str(tmp_path / "more"), "--pick", "--follow", "3,3"]) == command.NOT_TAKEN + 1


def test_the_user_clicks_and_drags(server):
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 1000, "height": 900})
        page.goto(server.url)
        canvas = page.wait_for_selector("canvas")
        box = canvas.bounding_box()
        scale = box["width"] / 320

        def at(u, v):
            return box["x"] + scale * (u + 0.5), box["y"] + scale * (v + 0.5)

        assert page.is_disabled("#start")
        page.mouse.click(*at(200, 120))
        page.check("input[value=rectangle]")
        page.mouse.move(*at(20, 30))
        page.mouse.down()
        page.mouse.move(*at(300, 200))
        page.mouse.up()
        page.click("#start")
        until(server.picked.is_set)
        until(lambda: "begun" in page.text_content("#said"))
    assert server.follow == ["200,120"]
    assert server.roi == ["20,30 300,30 300,200 20,200"]
