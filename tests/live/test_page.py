"""The live view in a real browser: Debian's chromium, driven by Playwright, watches a run of the train."""

import base64
import re
import signal
import sys
import time

import cv2
import numpy as np
import pexpect
import pytest
from browsing import NEVER_GRASPS, PATIENCE, SELECTING, chromium, live_run, until

from drake_tracker.core.log import load_log
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.live.operator import JOG_STEP
from drake_tracker.tasks.style import bgr, track_light
from drake_tracker.vision.silhouettes.target import REASONS, Reason


@pytest.fixture
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture
def run(tmp_path, request):
    """A run of the train that ends when it is interrupted. The parameter is a scenario and a list of options."""
    scenario, options = request.param
    with live_run(tmp_path, options, scenario) as run:
        yield run


def colours(png):
    """The pixels of a PNG file, (n, 3)."""
    return cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR).reshape(-1, 3).astype(float)


def drawn(canvas):
    """The pixels of a canvas, (n, 3)."""
    return colours(base64.b64decode(canvas.evaluate("canvas => canvas.toDataURL('image/png').split(',')[1]")))


def is_a_scene(pixels):
    """Whether more is drawn than a background."""
    return pixels.std() > 10 and len(np.unique(pixels, axis=0)) > 1000


class Page:
    """The page of a run, and what went wrong in it."""

    def __init__(self, browser, url):
        self.page = browser.new_page(viewport={"width": 1280, "height": 800})
        self.troubles, self.hosts = [], set()
        self.page.on("console", self._listen)
        self.page.on("pageerror", lambda error: self.troubles.append(str(error)))
        self.page.on("request", lambda request: self.hosts.add(request.url.split("/")[2].split(":")[0]))
        self.page.goto(url)

    def _listen(self, message):
        if message.type == "error":
            self.troubles.append(message.text)

    def now(self):
        return float(self.page.locator("#time").inner_text())

    def __call__(self, selector):
        return self.page.locator(selector)


def let_it_run(page, seconds):
    start = page.now()
    until(lambda: page.now() > start + seconds)


@pytest.mark.parametrize("run", [("train", ["--set", "grasp.settle_time=60"])], indirect=True)
def test_the_page_shows_a_run_and_holds_it(browser, run):
    page = Page(browser, run.url)
    until(lambda: page.now() > 0.3)
    assert page.page.title() == "train \u00b7 drake_tracker"

    views = page("#views canvas")
    assert views.count() == 4
    frame, before = page("#cameras").get_attribute("data-frame"), drawn(views.first)
    assert before.std() > 10, "the camera's image is blank"
    until(lambda: page.now() > 0.8 and page("#cameras").get_attribute("data-frame") != frame)
    assert np.abs(drawn(views.first) - before).max() > 30, "the train has moved on"

    page("#pause").click()
    until(lambda: page("#stage").inner_text() == "paused")
    time.sleep(0.5)  # the cycle in which it was asked ends first
    held = page.now()
    until(lambda: is_a_scene(colours(page("#scene iframe").screenshot(timeout=1e3 * PATIENCE))))
    assert len(np.unique(drawn(page("#chart")), axis=0)) > 20, "the strips are blank"
    assert page.now() == held, "pause does not pause"

    for k in (1, 2, 3):
        page("#step").click()
        until(lambda after=held + k * VISION_PERIOD: abs(page.now() - after) < 0.011)  # shown with two decimals
    time.sleep(0.3)
    assert abs(page.now() - held - 3 * VISION_PERIOD) < 0.011, "a step is one cycle"

    real_time = page.page.get_by_role("button", name="1\u00d7", exact=True)
    real_time.click()
    until(lambda: real_time.get_attribute("aria-pressed") == "true")
    page("#pause").click()
    until(lambda: page.now() > held + 0.2)
    (scene,) = (frame for frame in page.page.frames if "localhost" in frame.url)
    until(lambda: scene.evaluate("viewer.renderer.getPixelRatio()") == 0.5)  # coarse without a graphics card
    assert page.page.evaluate("document.documentElement.scrollHeight <= innerHeight"), "one page without scrolling"
    assert page.troubles == [] and page.hosts == {"127.0.0.1", "localhost"}

    page.page.close()
    line = re.compile(r"The live view was closed. The run continues; watch it again at (\S+)")
    assert until(lambda: line.search(run.printed()))[1] == run.url

    page = Page(browser, run.url)
    until(lambda: page.now() > held)
    run.send_signal(signal.SIGINT)
    until(lambda: page("#outcome").is_visible())
    assert "The train was not lifted" in page("#outcome").inner_text()
    assert str(run.out) in page("#outcome").inner_text()
    assert run.wait(PATIENCE) == 130 and "Traceback" not in run.printed()
    left = {path.name for path in run.out.iterdir()}
    assert {"summary.json", "log.npz", "cameras.mp4", "recording.html", "scenario.yaml"} <= left


@pytest.mark.parametrize("run", [("train", NEVER_GRASPS)], indirect=True)
def test_the_operator_stops_the_arm_and_takes_it_over(browser, run):
    page = Page(browser, run.url)
    until(lambda: page.now() > 0.1)
    page.page.get_by_role("button", name="1\u00d7", exact=True).click()
    stage, press = page("#stage"), page.page.keyboard.press
    until(lambda: page("#stop").is_enabled() and page.now() > 2.0)
    until(lambda: page("#success").is_visible() and int(page("#p-success").inner_text()) > 0)
    assert page("#release").is_disabled() and page("#jogs button").first.is_disabled()
    press("w")  # nobody has taken over

    press("Escape")
    until(lambda: stage.inner_text() == "arm stopped" and not page("#success").is_visible())
    assert page("#stop").is_disabled() and page("#release").is_enabled()
    page("#scene iframe").click(timeout=1e3 * PATIENCE)  # the keys work after a click into the scene, too
    press("t")
    until(lambda: stage.inner_text() == "arm under your control")
    let_it_run(page, 0.5)
    for key in "www":
        press(key)
    for name in ("down", "down"):
        page.page.get_by_role("button", name=name, exact=True).click()
    let_it_run(page, 1.0)
    press("r")
    until(lambda: stage.inner_text() == "running")
    let_it_run(page, 0.3)  # an order that is replaced before the next cycle of the servo leaves no trace
    page("#stop").click()
    until(lambda: stage.inner_text() == "arm stopped")
    let_it_run(page, 0.3)
    page("#release").click()
    until(lambda: stage.inner_text() == "running")
    let_it_run(page, 0.3)
    page("#take-over").click()
    until(lambda: stage.inner_text() == "arm under your control")
    let_it_run(page, 0.3)
    assert page("#operator-problem").inner_text() == "" and page.troubles == []
    assert page.page.evaluate("document.documentElement.scrollHeight <= innerHeight"), "one page without scrolling"

    run.send_signal(signal.SIGINT)
    until(lambda: page("#outcome").is_visible())
    assert not page("#operator").is_visible()
    assert run.wait(PATIENCE) == 130 and "Traceback" not in run.printed()
    log = load_log(run.out / "log.npz")
    mode = log["operator"]["mode"]
    assert mode[np.append(True, np.diff(mode) != 0.0)].tolist() == [0, 1, 2, 0, 1, 0, 2]
    taken = log["operator"].data[np.argmax(mode == 2) : np.argmax((mode == 0) & (np.cumsum(mode == 2) > 0))]
    assert taken[-1, 1:5] - taken[0, 1:5] == pytest.approx([3 * JOG_STEP, 0.0, -2 * JOG_STEP, 0.0], abs=1e-9)
    assert {Phase.STOPPED, Phase.MANUAL, Phase.RETREAT} <= {Phase(int(phase)) for phase in log["command"]["phase"]}


def place_of(canvas, colour):
    """Centre of the pixels of a colour in a canvas, as shares of its width and height; None without any."""
    png = base64.b64decode(canvas.evaluate("canvas => canvas.toDataURL('image/png').split(',')[1]"))
    image = cv2.imdecode(np.frombuffer(png, np.uint8), cv2.IMREAD_COLOR)
    rows, columns = np.nonzero(np.abs(image.astype(int) - bgr(colour)).max(axis=2) < 45)
    height, width, _ = image.shape
    return (np.median(columns) / width, np.median(rows) / height) if len(rows) > 5 else None


@pytest.mark.parametrize("run", [("train:guided", SELECTING)], indirect=True)
def test_a_click_on_an_object_makes_it_the_target(browser, run):
    page = Page(browser, run.url)
    rows, reason = page("#track-rows tr"), page("#reason")
    until(lambda: rows.count() >= 2 and REASONS[Reason.NOT_SELECTED] in reason.inner_text())
    assert "target" not in rows.nth(0).inner_text() + rows.nth(1).inner_text()
    page("#pause").click()
    until(lambda: page("#stage").inner_text() == "paused")
    time.sleep(1.0)  # the newest frame is shown

    canvas = page("#views canvas").nth(1)  # the present image of the right camera
    x, y = place_of(canvas, track_light(2))
    box = canvas.bounding_box()
    page.page.mouse.click(box["x"] + x * box["width"], box["y"] + y * box["height"])
    page("#pause").click()
    until(lambda: "target" in rows.nth(1).inner_text())
    assert "target" not in rows.nth(0).inner_text()
    until(lambda: "No point" not in reason.inner_text())
    page.page.get_by_label("Make object 1 the target").click()
    until(lambda: "target" in rows.nth(0).inner_text())
    assert page("#operator-problem").inner_text() == "" and page.troubles == []
    assert page.page.evaluate("document.documentElement.scrollHeight <= innerHeight"), "one page without scrolling"

    run.send_signal(signal.SIGINT)
    until(lambda: page("#outcome").is_visible())
    assert run.wait(PATIENCE) == 130 and "Traceback" not in run.printed()
    selected = load_log(run.out / "log.npz")["operator"]["selected"]
    assert selected[np.append(True, np.diff(selected) != 0.0)].tolist() == [0, 2, 1]


def test_at_its_end_the_page_links_to_the_report(browser, tmp_path):
    out = tmp_path / "run"
    options = ["--live", "--set", "vision=Measured", "--duration", "1.5", "--no-record", "--out", str(out)]
    run = pexpect.spawn(sys.executable, ["-m", "drake_tracker", "run", "train", *options], timeout=PATIENCE)
    run.expect(r"Live view: (\S+)")
    page = Page(browser, run.match[1].decode())
    until(lambda: page("#outcome-report").is_visible())
    run.expect(r"(http://\S+)  \(Ctrl-C ends it\)")
    (scene,) = (frame for frame in page.page.frames if "localhost" in frame.url)
    assert not scene.locator("#status-message").is_visible(), "the scene complains that the run is over"
    assert page("#outcome-report").get_attribute("href") == run.match[1].decode()
    with page.page.expect_popup() as popup:
        page("#outcome-report").click()
    until(lambda: "train" in popup.value.title())
    assert "not lifted" in popup.value.locator("body").inner_text()
    run.sendintr()
    run.expect(pexpect.EOF)
    run.close()
    assert run.exitstatus == 1, "the exit code is that of the run"
