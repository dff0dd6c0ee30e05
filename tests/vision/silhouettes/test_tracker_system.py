import numpy as np
import pytest
from cuboids import CAMERAS, PERIOD, WORK_VOLUME, Cuboid, Stage, oval
from pydrake.common.value import AbstractValue
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

from drake_tracker.core.messages import (
    EXPECTED_FIELDS,
    REGION_FIELDS,
    REGION_SLOTS,
    TRACK_FIELDS,
    Centroid,
    Regions,
    TrackPoint,
    TrackPoints,
    TrackPredictions,
    TrackState,
    message_rows,
    message_size,
)
from drake_tracker.core.timing import PROJECTOR_SLOT, vision_slot
from drake_tracker.vision.silhouettes.target import Reason
from drake_tracker.vision.silhouettes.target_config import First, Nearest
from drake_tracker.vision.silhouettes.tracker import Tracker, TrackerState
from drake_tracker.vision.silhouettes.tracker_system import TrackerSystem, pack_regions, unpack_expected

VECTORS = ("point", "tracks", "regions_left", "regions_right", "centroid_left", "centroid_right")


def opposite(time):
    """The far side of the oval."""
    return oval(time, start=0.5)


TWO = [(Cuboid(), oval), (Cuboid(colour=(50, 80, 190)), opposite)]


class Film(LeafSystem):
    """Outputs the foregrounds of a stage, those of each cycle once; none in the cycles of ``gaps``."""

    def __init__(self, stage, count, gaps=(), late=0.0, dark=()):
        super().__init__()
        self._images = [stage.foregrounds(k * PERIOD, k not in dark) for k in range(count)]
        self._gaps, self._late = gaps, late
        for side, name in enumerate(("left", "right")):

            def calc(context, output, side=side):
                cycle = round(context.get_time() / PERIOD)
                output.set_value(None if cycle in self._gaps else self._images[cycle][side])

            self.DeclareAbstractOutputPort(name, lambda: AbstractValue.Make(object()), calc)


class Laboratory:
    """A film, and the tracker that watches it."""

    def __init__(self, objects=TWO, count=40, target=First(), film=None, **settings):
        builder = DiagramBuilder()
        self.film = builder.AddSystem(film or Film(Stage(objects), count))
        tracker = Tracker(CAMERAS, work_volume=WORK_VOLUME)
        self.system = builder.AddSystem(TrackerSystem(tracker, target, **settings))
        for side in ("left", "right"):
            builder.Connect(self.film.GetOutputPort(side), self.system.GetInputPort(f"foreground_{side}"))
        builder.ExportInput(self.system.GetInputPort("expected"), "expected")
        self.diagram = builder.Build()
        self.simulator = Simulator(self.diagram)

    def after(self, cycle, name):
        """The output after the update of a cycle."""
        self.simulator.AdvanceTo((cycle + 0.5) * PERIOD)
        context = self.system.GetMyContextFromRoot(self.simulator.get_context())
        return self.system.GetOutputPort(name).Eval(context).copy()

    def tracks(self, cycle):
        """(header, {number: {field: value}}) of the message of all tracks."""
        message = self.after(cycle, "tracks")
        rows = (dict(zip(TRACK_FIELDS, row)) for row in message_rows(message, TRACK_FIELDS))
        return TrackPoints(message), {int(row["number"]): row for row in rows if row["number"]}


def test_all_outputs_are_zeros_before_the_first_pair():
    laboratory = Laboratory(film=Film(Stage(TWO), 5, gaps=(0, 1, 2)))
    for name in VECTORS:
        assert not laboratory.after(2, name).any(), name
    assert TrackPoints(laboratory.after(3, "tracks")).valid == 1.0


def test_the_point_is_that_of_the_target():
    laboratory = Laboratory()
    header, tracks = laboratory.tracks(30)
    point = TrackPoint(laboratory.after(30, "point"))
    assert header.stamp == point.stamp == pytest.approx(30 * PERIOD) and header.valid == point.valid == 1.0
    assert set(tracks) == {1, 2} and header.target == 1 and header.reason == Reason.NONE
    assert [tracks[1][axis] for axis in "xyz"] == [point.x, point.y, point.z]
    assert tracks[1]["gap"] == point.gap and tracks[1]["seen"] == point.stamp
    errors = [np.hypot(point.x - path(30 * PERIOD)[0][0], point.y - path(30 * PERIOD)[0][1]) for _, path in TWO]
    assert min(errors) < 0.015


def test_another_target_is_chosen_by_the_settings():
    place = tuple(opposite(0.4)[0])
    laboratory = Laboratory(target=Nearest(point=place))
    laboratory.after(30, "point")
    point = TrackPoint(laboratory.after(30, "point"))
    assert np.hypot(point.x - place[0], point.y - place[1]) < 0.1


def test_the_tracks_in_the_message():
    _, tracks = Laboratory().tracks(35)
    for row in tracks.values():
        position = np.array([row[axis] for axis in "xyz"])
        truth, velocity = min(
            (path(35 * PERIOD) for _, path in TWO), key=lambda state: np.linalg.norm(state[0] - position)
        )
        assert np.linalg.norm(position - truth) < 0.015
        np.testing.assert_allclose([row[name] for name in ("vx", "vy", "vz")], velocity, atol=0.08)
        assert row["state"] == TrackState.MOVING
        covariance = np.array([[row["xx"], row["xy"], row["xz"]], [row["xy"], row["yy"], row["yz"]],
                               [row["xz"], row["yz"], row["zz"]]])  # fmt: skip
        assert np.linalg.eigvalsh(covariance).min() > 0.0
        assert 0.03 < row["size"] < 0.2
    assert sorted(round(row["blue"] / 10) for row in tracks.values()) == [6, 19]


def test_regions_and_centroids():
    laboratory = Laboratory()
    for side, camera in zip(("left", "right"), CAMERAS):
        message = laboratory.after(30, f"regions_{side}")
        header = Regions(message)
        assert header.stamp == pytest.approx(30 * PERIOD) and header.count == 2.0 and header.usable == 1.0
        rows = message_rows(message, REGION_FIELDS)
        assert not rows[2:].any() and set(rows[:2, REGION_FIELDS.index("track")]) == {1.0, 2.0}
        centroid = Centroid(laboratory.after(30, f"centroid_{side}"))
        assert centroid.valid == 1.0 and centroid.stamp == header.stamp
        mine = next(row for row in rows if row[REGION_FIELDS.index("track")] == 1.0)
        assert (centroid.u, centroid.v, centroid.pixel_count) == tuple(mine[:3])
        distances = [np.hypot(*(camera.project(path(30 * PERIOD)[0])[0] - (centroid.u, centroid.v))) for _, path in TWO]
        assert min(distances) < 4.0


def test_without_objects_the_messages_say_so():
    laboratory = Laboratory(objects=[])
    header, tracks = laboratory.tracks(10)
    assert header.valid == 1.0 and tracks == {} and header.target == 0.0 and header.reason == Reason.NO_OBJECT
    point = TrackPoint(laboratory.after(10, "point"))
    assert point.valid == 0.0 and point.stamp == pytest.approx(10 * PERIOD)
    assert Regions(laboratory.after(10, "regions_left")).count == 0.0
    assert Centroid(laboratory.after(10, "centroid_left")).valid == 0.0


def test_images_that_cannot_be_used():
    laboratory = Laboratory(film=Film(Stage(TWO), 40, dark=range(25, 40)))
    header, tracks = laboratory.tracks(30)
    assert header.reason == Reason.UNUSABLE_IMAGE and set(tracks) == {1, 2}
    assert TrackPoint(laboratory.after(30, "point")).valid == 0.0
    assert Regions(laboratory.after(30, "regions_right")).usable == 0.0
    assert all(row["seen"] < 25 * PERIOD and row["gap"] == 0.0 for row in tracks.values())


def test_a_cycle_without_images_changes_nothing():
    laboratory = Laboratory(film=Film(Stage(TWO), 40, gaps=(30,)))
    before = {name: laboratory.after(29, name) for name in VECTORS}
    for name in VECTORS:
        np.testing.assert_array_equal(laboratory.after(30, name), before[name])
    assert TrackPoint(laboratory.after(31, "point")).valid == 1.0


class Unequal(Film):
    """The right images are captured a millisecond after the left ones."""

    def __init__(self, stage, count):
        super().__init__(stage, count)
        from dataclasses import replace

        self._images = [[left, replace(right, stamp=right.stamp + 0.001)] for left, right in self._images]


def test_stamps_of_the_two_images():
    strict = Laboratory(film=Unequal(Stage(TWO), 12))
    assert not strict.after(10, "tracks").any()
    loose = Laboratory(film=Unequal(Stage(TWO), 12), stamp_tolerance=0.002)
    assert TrackPoints(loose.after(10, "tracks")).stamp == pytest.approx(10 * PERIOD + 0.0005)


def test_the_update_is_in_its_slot():
    laboratory = Laboratory()
    slot = vision_slot(PROJECTOR_SLOT)
    context = laboratory.system.GetMyContextFromRoot(laboratory.simulator.get_context())
    for time, stamp in ((10 * PERIOD + 0.5 * slot, 9), (10 * PERIOD + 1.5 * slot, 10)):
        laboratory.simulator.AdvanceTo(time)
        message = laboratory.system.GetOutputPort("tracks").Eval(context)
        assert TrackPoints(message).stamp == pytest.approx(stamp * PERIOD)


def predictions(time, rows):
    message = np.zeros(message_size(TrackPredictions))
    TrackPredictions(message).time = time
    for slot, row in zip(message_rows(message, EXPECTED_FIELDS), rows):
        slot[:] = row
    return message


def test_an_expectation_is_taken_to_the_stamp():
    message = predictions(2.0, [(3, 0.5, 0.1, 0.48, 0.1, -0.2, 0.0, 0.004), (7, 0.6, 0.0, 0.48, 0.0, 0.0, 0.0, 0.01)])
    found = unpack_expected(message, 2.1)
    assert set(found) == {3, 7}
    np.testing.assert_allclose(found[3].p_WQ, [0.51, 0.08, 0.48])
    np.testing.assert_allclose(found[3].v_WQ, [0.1, -0.2, 0.0])
    assert found[3].std == 0.004 and found[7].std == 0.01
    assert unpack_expected(np.zeros(message_size(TrackPredictions)), 1.0) == {}


def test_an_expectation_moves_a_track_that_is_not_seen():
    def vanishing(time):
        return oval(time) if time < 0.5 else None

    place = np.array([0.6, 0.0, 0.475])
    for given in (False, True):
        laboratory = Laboratory(objects=[(Cuboid(), vanishing)], count=60)
        if given:
            message = predictions(0.0, [(1, *place, 0.0, 0.0, 0.0, 0.004)])
            context = laboratory.simulator.get_mutable_context()
            laboratory.diagram.GetInputPort("expected").FixValue(context, message)
        header, tracks = laboratory.tracks(50)
        position = np.array([tracks[1][axis] for axis in "xyz"])
        assert np.allclose(position, place, atol=1e-6) == given
        assert header.reason == Reason.NOT_OBSERVED and header.target == 1.0
        assert TrackPoint(laboratory.after(50, "point")).valid == 0.0


def test_a_cloned_context_goes_on_in_the_same_way():
    laboratory = Laboratory()
    kept = {name: laboratory.after(20, name) for name in VECTORS}
    clone = laboratory.simulator.get_context().Clone()
    first = {name: laboratory.after(35, name) for name in VECTORS}
    laboratory.simulator = Simulator(laboratory.diagram, clone)
    for name in VECTORS:
        np.testing.assert_array_equal(laboratory.after(20, name), kept[name])
    for name in VECTORS:
        np.testing.assert_array_equal(laboratory.after(35, name), first[name])


def test_more_regions_than_slots_are_counted():
    region = Laboratory()
    region.after(20, "tracks")
    context = region.system.GetMyContextFromRoot(region.simulator.get_context())
    one = context.get_abstract_state(0).get_value().tracker.regions[0][0]
    many = TrackerState(stamp=1.0, regions=((one,) * (REGION_SLOTS + 4), ()))
    message = pack_regions(many, 0)
    assert Regions(message).count == REGION_SLOTS + 4
    assert message_rows(message, REGION_FIELDS)[:, 2].all()
    assert Regions(pack_regions(many, 1)).count == 0
