"""The live view beside a run: it changes nothing, and a person's windows become the scenario's."""

import json
import threading
import time
import urllib.error
import urllib.request
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
from ball_scenario import make_scenario, true_poses
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker import load_scenario, simulate
from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.log import load_log
from drake_tracker.core.messages import OperatorCommand
from drake_tracker.core.setting import as_tuple
from drake_tracker.diagrams.parts import arm_of
from drake_tracker.grasp.gate import Gate
from drake_tracker.grasp.train.schema import Phase
from drake_tracker.live.strips_system import add_strips
from drake_tracker.live.view import LiveView
from drake_tracker.run.options import RunOptions
from drake_tracker.tasks.ball.filming import BALL_STRIPS
from drake_tracker.tasks.ball.initialisation import initialise_board
from drake_tracker.tasks.registry import make_diagram, task_named, task_of
from drake_tracker.world.config import OperatorConfig


def control(url, **asked):
    origin = {"Origin": url.rstrip("/")}
    request = urllib.request.Request(f"{url}control", json.dumps(asked).encode(), origin)
    return json.loads(urllib.request.urlopen(request, timeout=10).read())


def events(url, enough):
    """The news of a run, until there is enough of it."""
    for line in urllib.request.urlopen(f"{url}events", timeout=60):
        if line.startswith(b"data: "):
            news = json.loads(line[6:])
            if enough(news):
                return


def test_watching_and_holding_a_run_does_not_change_it(tmp_path):
    overrides = ["vision=!Measured {}"]
    alone = simulate(
        load_scenario("train:learned", duration=1.5, overrides=overrides), tmp_path / "alone", RunOptions(record=False)
    )
    told = {"time": [], "samples": [], "facts": {}}

    def enough(news):
        told["facts"] = news.get("facts", told["facts"])
        told["samples"] += news.get("samples", [])
        if news.get("time", 0.0) > 0.5 and not told["time"]:
            control(live.url, action="pause")
            time.sleep(0.5)
            control(live.url, action="step")
            control(live.url, action="resume")
            told["time"].append(news["time"])
        return told["facts"]["stage"] == "over"

    with LiveView() as live:
        page = threading.Thread(target=events, args=(live.url, enough))
        page.start()
        scenario = load_scenario("train:learned", duration=1.5, overrides=overrides)
        watched = simulate(scenario, tmp_path / "watched", RunOptions(record=False), live=live)
        live.finish({"success": False})
    page.join(10.0)
    assert not page.is_alive() and told["time"]
    for summary in (alone, watched):
        del summary["wall_time_s"], summary["real_time_factor"]
    assert watched == alone
    first, second = (load_log(tmp_path / name / "log.npz") for name in ("alone", "watched"))
    operator = second.pop("operator")
    assert operator.names == OperatorCommand.get_fields() and not operator.data.any() and len(operator.times) > 80
    assert first.keys() == second.keys()
    assert all(np.array_equal(first[name].data, second[name].data, equal_nan=True) for name in first)

    assert told["facts"]["cameras"] is False and told["facts"]["scene"].startswith("http://localhost:")
    times = [sample[0] for sample in told["samples"]]
    assert times == pytest.approx(np.arange(0.0, 1.51, 0.05), abs=1e-3)
    assert told["samples"][-1][2] is not None and told["samples"][-1][-1] == pytest.approx(88.0, abs=1.0)


def test_the_page_gets_the_probability_of_success_while_a_grasp_is_possible():
    train, diagnosis = task_named("train"), np.array([Phase.TRACK, 0.0, Gate.SUCCESS_UNLIKELY, 0.0, 40.0, 0.87654])
    with LiveView(say=lambda line: None) as live:

        def shown(task, vector):
            live.look(1.0, int(vector[0]), task.p_success(task.diagnosis(vector)), lambda: False)
            return live.state.news(None, 0.0)[0]["p_success"]

        assert shown(train, diagnosis) == 0.877
        for phase in (Phase.ACQUIRE, Phase.LIFT, Phase.STOPPED):
            diagnosis[0] = phase
            assert shown(train, diagnosis) is None
        assert shown(task_named("ball"), np.zeros(7)) is None


def test_the_strips_of_a_ball_read_its_ports():
    scenario, samples = make_scenario(seed=4), []
    hand_eye = make_diagram(scenario, true_poses(scenario))
    builder = DiagramBuilder()
    builder.AddSystem(hand_eye)
    model = make_arm_model(arm_of(scenario))
    add_strips(builder, hand_eye=hand_eye, chart=BALL_STRIPS, model=model, add_sample=samples.append)
    Simulator(builder.Build()).Initialize()
    assert samples == [(0.0, 0, None, None, None, None, None)]


def test_an_aborted_run_is_shown_on_the_page():
    facts = []

    def until_over(news):
        facts.append(news["facts"])
        return news["facts"]["stage"] == "over"

    def abort(live):
        with live:
            page.start()
            while not facts:
                time.sleep(0.01)
            raise ZeroDivisionError("by zero")

    live = LiveView()
    page = threading.Thread(target=events, args=(live.url, until_over))
    with pytest.raises(ZeroDivisionError):
        abort(live)
    page.join(10.0)
    assert facts[-1]["outcome"] == {"success": False, "title": "The run was aborted", "reason": "by zero"}


def test_a_person_marks_windows_on_the_page():
    board = np.full((100, 100, 3), 200, np.uint8)
    places = [(20, 20), (80, 22), (22, 80), (78, 78)]
    for place in places:
        cv2.circle(board, place, 5, (10, 10, 10), -1)
    said, answers = [], []
    with LiveView(say=said.append) as live:

        def mark():
            events(live.url, lambda news: news.get("facts", {}).get("stage") == "windows")
            picture = urllib.request.urlopen(f"{live.url}board.png", timeout=10).read()
            assert cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_COLOR).shape == board.shape
            answers.append(control(live.url, action="read", window=[0, 0, 8, 8]))
            answers.extend(control(live.url, action="read", window=[u - 9, v - 9, 18.5, 18]) for u, v in places)
            answers.append(control(live.url, action="mark", windows=[each["window"] for each in answers[1:]]))

        person = threading.Thread(target=mark)
        person.start()
        windows = live.mark_windows([board] * 2, OperatorConfig())
        person.join()
        with pytest.raises(urllib.error.HTTPError):
            control(live.url, action="mark", windows=[])
    assert "no whole circle" in answers[0]["problem"] and answers[-1] == {}
    assert windows == [[u - 9.0, v - 9.0, 18.0, 18.0] for u, v in places]
    assert live.url in said[0]


def test_windows_of_a_person_are_used_and_recorded():
    scenario, windows = make_scenario(seed=4), [[0.0, 0.0, 9.0, 9.0]] * 4
    with pytest.raises(DrakeTrackerError, match="no whole circle"):
        initialise_board(scenario, lambda images, operator: windows)
    resolved = task_of(scenario).resolved(scenario, SimpleNamespace(windows=windows))
    assert resolved.operator.windows == as_tuple(windows) and scenario.operator.windows == ()


def test_a_person_selects_one_of_the_tracks_that_the_page_shows():
    with LiveView(say=lambda line: None) as live:
        live.frames.tracks = lambda: ([{"number": 2}, {"number": 5}], "")
        control(live.url, action="select", number=5)
        assert live.operator.read().selected == 5
        for wrong in ({"number": 3}, {"number": "5"}, {"number": 5, "side": "left"}, {}):
            with pytest.raises(urllib.error.HTTPError):
                control(live.url, action="select", **wrong)
        assert live.operator.read().selected == 5
