"""Measured vision of several objects: identities, drop-outs, the target, and errors of its own for each object."""

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_tracker import load_scenario, make_diagram
from drake_tracker.core.errors import DrakeTrackerError
from drake_tracker.core.messages import TRACK_FIELDS, TRACK_SLOTS, TrackPoint, TrackPoints, TrackState, message_rows
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.measured.config import SeveralObjects
from drake_tracker.measured.measured_error import MeasuredError, object_seed
from drake_tracker.measured.measured_error_system import MeasuredErrorSystem
from drake_tracker.measured.measured_tracks import MeasuredTracker, MeasuredTracks, ObjectLook
from drake_tracker.measured.measured_tracks_system import MeasuredTracksSystem
from drake_tracker.measured.measured_vision_diagram import MeasuredVisionDiagram
from drake_tracker.tasks.train.scenario import WORK_VOLUME
from drake_tracker.vision.silhouettes.target import Reason
from drake_tracker.vision.silhouettes.target_config import Coloured, Largest

YELLOW, RED = ObjectLook((0.12, 0.04, 0.05), (250.0, 212.0, 76.0)), ObjectLook((0.04, 0.04, 0.04), (192.0, 48.0, 40.0))
OVERRIDE = "vision=!Measured {method: !SeveralObjects {}}"


def error_of(along=0.003, across=0.001):
    """Jitter of 3 mm along and 1 mm across the heading, nothing else."""
    jitter = np.zeros((1, 3, 1))
    jitter[0, :, 0] = along, across, 0.0005
    zeros = np.zeros
    return MeasuredError(np.array([0.1]), zeros((1, 2, 4, 3)), zeros((1, 3)), jitter, zeros((1, 2)), 0.003, 0.01)


def tracked(visible, settings=SeveralObjects(confirm_after=3, coast_time=0.2), looks=(YELLOW, RED)):
    """Returns the states after each cycle, for objects that run along y; ``visible`` is (cycles, objects)."""
    tracker, state, states = MeasuredTracker(error_of(), looks, settings), MeasuredTracks(), []
    for cycle, row in enumerate(visible, 1):
        points = [
            TrackPoint([cycle * VISION_PERIOD, 0.5 + 0.1 * k, 0.1 * cycle * VISION_PERIOD, 0.48, 0.0, float(seen)])[:]
            for k, seen in enumerate(row)
        ]
        state = tracker.update(state, points)
        states.append(state)
    return states


def numbers(states):
    return [[track.number if track else None for track in state.tracks] for state in states]


def test_tracks_are_confirmed_in_order_and_numbers_are_never_used_again():
    visible = np.ones((60, 2), bool)
    visible[:5, 0] = visible[20:40, 1] = False  # the first is seen later, the second is lost for 0.33 s
    states = tracked(visible)
    found = numbers(states)
    assert found[2] == [None, 1] and found[7] == [2, 1] and found[25] == [2, 1]
    assert found[35] == [2, None] and found[-1] == [2, 3]
    assert states[25].tracks[1].state == TrackState.NOT_OBSERVED and states[25].tracks[1].measurement is None
    assert states[-1].tracks[0].mean[3:5] == pytest.approx([0.0, 0.1], abs=1e-3)
    assert [track.number for track in states[-1].as_state().confirmed()] == [2, 3]


def test_more_objects_than_slots_are_counted():
    count = TRACK_SLOTS + 2
    (*_, last) = tracked(np.ones((5, count), bool), looks=[YELLOW] * count)
    assert len(last.as_state().tracks) == TRACK_SLOTS and last.as_state().overflow == 2


def test_the_covariance_is_that_of_the_error_along_the_heading():
    covariance = error_of().covariance(np.deg2rad(90.0), 0.1)
    assert np.sqrt(np.diag(covariance)) == pytest.approx([0.001, 0.003, 0.0005])
    turned = error_of().covariance(np.deg2rad(45.0), 0.1)
    assert turned[0, 1] == pytest.approx(0.5 * (0.003**2 - 0.001**2))


def state_of(x, y, speed):
    return [1.0, 0, 0, 0, x, y, 0.485, 0, 0, 0, speed, 0, 0]


def outputs_of(vision, cycles, states):
    """Returns (points, tracks) of a vision, one row each cycle."""
    builder = DiagramBuilder()
    builder.AddSystem(vision)
    for name, values in states.items():
        source = builder.AddSystem(ConstantVectorSource(values))
        builder.Connect(source.get_output_port(), vision.GetInputPort(name))
    simulator, rows = Simulator(builder.Build()), []
    for cycle in range(cycles):
        simulator.AdvanceTo((cycle + 0.5) * VISION_PERIOD)
        context = vision.GetMyContextFromRoot(simulator.get_context())
        rows.append([vision.get_output_port(k).Eval(context).copy() for k in range(vision.num_output_ports())])
    return rows


def vision_of(settings, looks, lag):
    """Measured vision of several objects."""
    sources = [
        MeasuredErrorSystem(error_of(), WORK_VOLUME, 4, number=k, further=len(looks) - 1) for k in range(len(looks))
    ]
    tracker = MeasuredTracker(error_of(), looks, settings)
    return MeasuredVisionDiagram(sources, lag, tracking=MeasuredTracksSystem(tracker, len(looks), settings.target))


@pytest.mark.parametrize("lag", [0, 3])
def test_the_first_train_has_the_errors_that_it_has_alone(lag):
    train, others = state_of(0.5, 0.1, 0.1), np.ravel([state_of(0.6, 0.0, 0.1), state_of(0.6, 0.1, 0.1)])
    several = vision_of(SeveralObjects(confirm_after=1), [YELLOW, RED, RED], lag)
    alone = MeasuredVisionDiagram([MeasuredErrorSystem(error_of(), WORK_VOLUME, 4)], lag)
    rows = outputs_of(several, 30, {"truth_train_state": train, "truth_object_states": others})
    expected = [row[0] for row in outputs_of(alone, 30, {"truth_train_state": train})]
    np.testing.assert_array_equal([row[0] for row in rows], expected)
    tracks = rows[-1][1]
    assert TrackPoints(tracks).stamp == expected[-1][0] > 0.0 and TrackPoints(tracks).target == 1.0
    first, second, third = message_rows(tracks, TRACK_FIELDS)[:3]
    x, y, size, red = (TRACK_FIELDS.index(name) for name in ("x", "y", "size", "red"))
    assert [row[size] for row in (first, second)] == [0.12, 0.04] and second[red] == 192.0
    offsets = [first[[x, y]] - [0.5, 0.1], second[[x, y]] - [0.6, 0.0], third[[x, y]] - [0.6, 0.1]]
    assert len({tuple(np.round(offset, 6)) for offset in offsets}) == 3


def test_seeds_of_objects_differ_and_the_first_is_that_of_the_run():
    assert object_seed(7, 0) == 7
    assert len({object_seed(seed, number) for seed in range(5) for number in range(5)}) == 25


class Newest:
    """A rule of a user."""

    reason = Reason.NO_MATCH

    def choose(self, tracks):
        return tracks[-1]


@pytest.mark.parametrize("target, number", [(Largest(), 1.0), (Coloured(colour="#c03028"), 2.0), (Newest(), 2.0)])
def test_the_target_is_chosen_by_the_rules_of_the_tracker(target, number):
    vision = vision_of(SeveralObjects(confirm_after=1, target=target), [YELLOW, RED], 1)
    states = {"truth_train_state": state_of(0.5, 0.1, 0.1), "truth_object_states": state_of(0.6, 0.0, 0.1)}
    (*_, (point, tracks)) = outputs_of(vision, 5, states)
    assert TrackPoints(tracks).target == number and TrackPoint(point).valid
    assert TrackPoint(point).x == pytest.approx(0.5 if number == 1.0 else 0.6, abs=0.02)


def test_a_wrong_setting_of_the_target_is_refused_when_the_diagram_is_built():
    with pytest.raises(DrakeTrackerError, match="colour is 'gold'"):
        vision_of(SeveralObjects(target=Coloured("gold")), [YELLOW], 1)


def test_a_scenario_without_further_objects_has_one_track():
    hand_eye = make_diagram(load_scenario("train:learned", overrides=[OVERRIDE]))
    simulator = Simulator(hand_eye)
    simulator.AdvanceTo(0.5)
    tracks = hand_eye.GetOutputPort("tracks").Eval(simulator.get_context())
    assert message_rows(tracks, TRACK_FIELDS)[:2, 0].tolist() == [1.0, 0.0]


def test_each_scenario_keeps_its_tracker_with_measured_vision():
    assert isinstance(load_scenario("train:two", overrides=["vision=!Measured {}"]).vision.method, SeveralObjects)
    assert not isinstance(
        load_scenario("train:learned", overrides=["vision=!Measured {}"]).vision.method, SeveralObjects
    )


def test_faults_act_on_the_points_of_all_objects():
    overrides = [OVERRIDE, "objects=[!Train {}]", "faults=[!CameraDark {at: 1.0, for: 2.0}]", "vision.lag_cycles=2"]
    hand_eye = make_diagram(load_scenario("train:learned", seed=1, overrides=overrides))
    simulator, states = Simulator(hand_eye), []
    for time in (0.9, 1.3):
        simulator.AdvanceTo(time)
        tracks = hand_eye.GetOutputPort("tracks").Eval(simulator.get_context())
        states.append(message_rows(tracks, TRACK_FIELDS)[:2, 1].tolist())
    assert states == [[TrackState.MOVING] * 2, [TrackState.NOT_OBSERVED] * 2]
