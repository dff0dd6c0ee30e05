"""Scenarios of the conveyor that contradict themselves, or cannot be built, are refused in one line."""

import numpy as np
import pytest

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.tasks.conveyor.scenario import ConveyorScenario, Measured
from drake_tracker.tasks.conveyor.setup import resolve
from drake_tracker.tasks.registry import task_of
from drake_tracker.world.conveyor.conveyor_config import cell_centres


@pytest.mark.parametrize(
    "override, key",
    [
        ("window.y_first=0.42", "window.y_first"),
        ("window.y_last=0.6", "window.y_last"),
        ("belt.entry=0.0", None),
        ("tray.cell=0.065", "tray.cell"),
        ("pick.jaw_opening=0.04", "pick.jaw_opening"),
        ("time_step=0.005", "time_step"),
        ("belt.speed=0.5", "belt.speed"),
    ],
)
def test_settings_that_contradict_each_other(override, key):
    if key is None:
        assert load_scenario("conveyor", overrides=[override]).problems() == []
        return
    with pytest.raises(DrakeTrackerError, match=key) as caught:
        load_scenario("conveyor", overrides=[override])
    assert "\n" not in str(caught.value)


def test_the_defaults_have_no_problems():
    assert ConveyorScenario().problems() == []


def test_the_jaws_reach_over_no_cell_that_is_filled_already():
    """Beside an ell they stand over the edge of the next cell towards -y."""
    scenario = ConveyorScenario()
    order, centres = resolve(scenario).filling_order, cell_centres(scenario.tray)
    assert sorted(order) == list(range(len(centres)))
    for place, cell in enumerate(order):
        x, y = centres[cell]
        before = centres[order[:place]]
        assert not np.any((np.abs(before[:, 0] - x) < 1e-6) & (np.abs(before[:, 1] - (y - scenario.tray.pitch)) < 1e-6))
    assert centres[order[0]][1] < 0.0, "the tray on the side of the waiting hand comes first"


def test_an_entry_behind_the_window():
    scenario = ConveyorScenario().with_settings({"belt.entry": -0.2, "window.y_first": -0.6, "window.y_last": -0.3})
    assert [key for key, _ in scenario.problems()] == ["belt.entry"]


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"duration": 0.05}, "duration.*no part arrives"),
        ({"duration": 36000.0}, "duration.*[0-9]+ parts arrive .* at most 300"),
        ({"arrivals.rate": 60.0, "arrivals.gap": 0.4}, "arrivals.rate"),
    ],
)
def test_what_cannot_be_built(changes, words):
    with pytest.raises(DrakeTrackerError, match=words):
        make_diagram(ConveyorScenario(seed=3).with_settings(changes))


def test_runs_that_cannot_be_replayed():
    measured = ConveyorScenario(vision=Measured())
    for scenario, start, words in (
        (measured, "images", "vision of the run is measured"),
        (measured, "centroids", "has no centroids"),
    ):
        with pytest.raises(DrakeTrackerError, match=words):
            task_of(scenario).replay_sources(scenario, start)


@pytest.mark.parametrize(
    "changes, words",
    [
        ({"belt.entry": -0.9}, "camera does not see the whole belt from belt.entry, y = -0.9 m, to window.y_last"),
        ({"cameras.distance": 1.0}, "calibrat"),
    ],
)
def test_cameras_that_do_not_see_the_belt(changes, words):
    with pytest.raises(DrakeTrackerError, match=words) as caught:
        make_diagram(ConveyorScenario(seed=5, duration=9.0).with_settings(changes))
    assert "\n" not in str(caught.value)


def test_a_camera_on_the_hand_is_refused():
    with pytest.raises(DrakeTrackerError, match="cameras.wrist"):
        load_scenario("conveyor", overrides=["cameras.wrist=!WristCamera {}"])


def test_the_encoder_is_connected_only_where_the_belt_has_one():
    for encoder in (False, True):
        hand_eye = make_diagram(ConveyorScenario(seed=5, duration=9.0).with_settings({"belt.encoder": encoder}))
        assert hand_eye.HasOutputPort("encoder") is encoder
        assert [hand_eye.get_input_port(k).get_name() for k in range(hand_eye.num_input_ports())] == ["operator"]
