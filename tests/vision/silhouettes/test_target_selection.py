"""The choice of the target, and the selection by the operator."""

from dataclasses import replace

import numpy as np
import pytest
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from drake_tracker.core.messages import (
    TARGET_STRIDE,
    TRACK_FIELDS,
    Prediction,
    TrackPoints,
    message_rows,
    message_size,
    packet_target,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.estimation.estimator_bank_system import EstimatorBankSystem
from drake_tracker.estimation.parts.turn_filter import TurnFilter
from drake_tracker.vision.silhouettes.foreground import Foreground
from drake_tracker.vision.silhouettes.object_shape import ObjectShape
from drake_tracker.vision.silhouettes.target import REASONS, Reason, choose_target, reason_of
from drake_tracker.vision.silhouettes.target_config import First, Nearest, Selected
from drake_tracker.vision.silhouettes.target_rules import FirstRule, NearestRule, SelectedRule
from drake_tracker.vision.silhouettes.track_3d import Measurement, new_track
from drake_tracker.vision.silhouettes.tracker import TrackerState
from drake_tracker.vision.silhouettes.tracker_system import TrackerSystem

FIRST, SELECTED = FirstRule(First()), SelectedRule(Selected())


def track(number, x=0.5):
    """A confirmed track that is seen now."""
    shape = ObjectShape.guess(np.ones((2, 2, 3)), np.ones((2, 2)))
    measurement = Measurement(np.array([x, 0.0, 0.485]), 1e-6 * np.eye(3), 0.0, 1.0)
    return replace(new_track(0.0, measurement, shape, (200.0, 0.0, 0.0)), number=number)


def test_the_operator_changes_the_target_and_it_stays_until_its_track_ends():
    tracks = [track(1), track(2), track(3)]
    assert choose_target(FIRST, tracks, 1, selected=3) == 3
    assert choose_target(FIRST, tracks, 3, selected=0) == 3, "it stays"
    assert choose_target(FIRST, tracks[:2], 3, selected=3) == 1, "its track has ended: the settings choose"
    assert choose_target(NearestRule(Nearest(point=(0.5, 0.0, 0.485))), tracks, 2, selected=1) == 1


@pytest.mark.parametrize("selected", [-1, 4, 10**6])
def test_the_number_of_no_track_is_ignored(selected):
    assert choose_target(FIRST, [track(1), track(2)], 2, selected) == 2
    assert choose_target(SELECTED, [track(1)], 0, selected) == 0


def test_nothing_is_followed_until_it_is_selected():
    assert choose_target(SELECTED, [track(1), track(2)], 0) == 0
    assert choose_target(SELECTED, [track(1), track(2)], 0, selected=2) == 2
    assert reason_of(None, True, True, SELECTED.reason) == Reason.NOT_SELECTED
    assert reason_of(None, False, True, SELECTED.reason) == Reason.NO_OBJECT, "there is nothing to select"
    assert set(REASONS) == set(Reason)


class Tracks:
    """Stands for a `Tracker`: the tracks change at given stamps [s]."""

    def __init__(self, changes):
        self._changes = changes

    def update(self, state, foregrounds, expected):
        stamp = foregrounds[0].stamp
        return TrackerState(stamp, [tracks for start, tracks in self._changes if start <= stamp + 1e-9][-1])


def test_the_system_reads_the_selection_at_a_port():
    system = TrackerSystem(Tracks([(0.0, (track(1), track(2))), (0.5, (track(1),))]), Selected())
    simulator = Simulator(system)
    context = simulator.get_mutable_context()
    image = np.zeros((4, 4, 3), np.uint8)

    def target(stamp, selected=None):
        foreground = Foreground(stamp, image, image[:, :, 0], image[:, :, 0], (0, 0))
        for side in ("left", "right"):
            system.GetInputPort(f"foreground_{side}").FixValue(context, AbstractValue.Make(foreground))
        if selected is not None:
            system.GetInputPort("selected").FixValue(context, [selected])
        simulator.AdvanceTo(stamp + 1.5 * VISION_PERIOD)
        header = TrackPoints(system.GetOutputPort("tracks").Eval(context))
        return int(header.target), Reason(int(header.reason))

    assert target(0.0) == (0, Reason.NOT_SELECTED), "the port is not connected"
    assert target(0.1, 7.0) == (0, Reason.NOT_SELECTED)
    assert target(0.2, 2.0) == (2, Reason.NONE)
    assert target(0.3, 0.0) == (2, Reason.NONE)
    assert target(0.6, 2.0) == (0, Reason.NOT_SELECTED), "the track has ended"
    assert target(0.7, 1.0) == (1, Reason.NONE)


def test_packets_say_which_track_they_are_about():
    def message(stamp, target):
        vector = np.zeros(message_size(TrackPoints))
        header = TrackPoints(vector)
        header.stamp, header.target, header.valid = stamp, target, 1.0
        for number, row in zip((1, 2), message_rows(vector, TRACK_FIELDS)):
            named = dict(zip(TRACK_FIELDS, row))
            named |= {
                "number": number,
                "state": 1,
                "x": 0.5 + 0.1 * stamp,
                "y": 0.1 * number,
                "z": 0.485,
                "seen": stamp,
            }
            row[:] = list(named.values())
        return vector

    system = EstimatorBankSystem(TurnFilter(), offset=0.0)
    builder = DiagramBuilder()
    builder.AddSystem(system)
    builder.ExportInput(system.GetInputPort("tracks"), "tracks")
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    seqs = []
    for cycle in range(1, 180):
        now = cycle * VISION_PERIOD
        diagram.GetInputPort("tracks").FixValue(context, message(now - 0.25 if now > 0.25 else 0.0, 1 + (cycle > 120)))
        simulator.AdvanceTo(now + 0.5 * VISION_PERIOD)
        packet = Prediction(system.GetOutputPort("prediction").Eval(system.GetMyContextFromRoot(context)))
        if packet.valid:
            seqs.append(packet.seq)
    numbers = [packet_target(seq) for seq in seqs]
    assert numbers[0] == 1 and numbers[-1] == 2 and sorted(numbers) == numbers
    counts = np.mod(seqs, TARGET_STRIDE)
    assert (np.diff(counts) >= 0).all() and counts[-1] > 100, "the number of packets goes on counting"
