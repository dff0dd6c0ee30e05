"""Simulates several objects in front of the cameras, and records what vision says beside the truth.

`watch` simulates world and vision alone: the arm is held high above the track. Several visions see the same images, so
that one tracker can be compared with another. `follow` simulates the whole loop, whose arm gets in the way.
"""

from dataclasses import dataclass

import numpy as np
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Diagram, DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource

from drake_tracker import make_diagram
from drake_tracker.core.constants import SIDES
from drake_tracker.core.messages import (
    TRACK_FIELDS,
    TRACK_SLOTS,
    Centroid,
    Regions,
    TrackPoint,
    TrackPoints,
    Verdict,
    message_rows,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import inputs
from drake_tracker.tasks.train.diagram import make_train_host, make_world
from drake_tracker.tasks.train.setup import resolve
from drake_tracker.tasks.train.vision import object_vision
from drake_tracker.vision.centroid.config import MotionCentroid
from drake_tracker.vision.silhouettes.config import SilhouetteTracker
from drake_tracker.world.config import TRAIN_SIZE

SEVERAL = {"several": SilhouetteTracker()}
TRACKERS = {**SEVERAL, "single": MotionCentroid()}
LIFTED = 0.005
"""Height of the train [m] at which `follow` ends."""
_BEGIN = {name: TRACK_FIELDS.index(name) for name in ("number", "state", "x", "xx", "yy", "zz", "seen")}


@dataclass(frozen=True, eq=False)
class Record:
    """What a vision says of n pairs of images, and the truth about m objects at their capture.

    Attributes:
        stamps: of the images, shape (n,) [s].
        p_WO: centres of the objects, shape (n, m, 3) [m].
        yaw: their headings, shape (n, m) [rad].
        alive: numbers of the confirmed tracks, shape (n, k), 0 in an empty slot.
        numbers: the same, 0 also where the object was not measured in this pair of images.
        points: positions of the tracks, shape (n, k, 3) [m].
        variances: of these along x, y and z, shape (n, k, 3) [m^2].
        usable: whether both images could be used, shape (n,) bool.
        centroids: of the target in both images, shape (n, 2, 3): u and v [px], valid.
    """

    stamps: np.ndarray
    p_WO: np.ndarray
    yaw: np.ndarray
    alive: np.ndarray
    numbers: np.ndarray
    points: np.ndarray
    variances: np.ndarray
    usable: np.ndarray
    centroids: np.ndarray

    def between(self, start, end):
        """Returns the record of the stamps from ``start`` to before ``end`` [s]."""
        kept = (self.stamps >= start) & (self.stamps < end)
        return Record(*(getattr(self, name)[kept] for name in self.__dataclass_fields__))


class WatchingDiagram(Diagram):
    """World and visions of a scenario, whose arm is held above the track.

    The outputs are those of the world's truth, and of each vision, whose names begin with that of the tracker.

    Args:
        scenario: of the train.
        trackers: {name: settings of ``vision.method``}.
    """

    def __init__(self, scenario, trackers):
        super().__init__()
        builder = DiagramBuilder()
        world, held = _held_world(scenario)
        builder.AddSystem(world)
        for name, value in held.items():
            source = builder.AddSystem(ConstantVectorSource(value))
            builder.Connect(source.get_output_port(), world.GetInputPort(name))
        windows = resolve(scenario).windows
        for name, settings in trackers.items():
            own = resolve(scenario.with_settings({"vision.method": settings}))
            vision, host = object_vision(own, windows), make_train_host(own)
            vision.set_name(f"vision_{name}")
            host.set_name(f"host_{name}")
            for part in (vision, host):
                builder.AddSystem(part)
            for port in inputs(vision):
                if world.HasOutputPort(port.get_name()):
                    builder.Connect(world.GetOutputPort(port.get_name()), port)
            if host.HasOutputPort("expected"):
                builder.Connect(vision.GetOutputPort("tracks"), host.GetInputPort("tracks"))
                builder.Connect(host.GetOutputPort("expected"), vision.GetInputPort("expected"))
            else:
                builder.Connect(vision.GetOutputPort("point"), host.GetInputPort("point"))
            for port in _wanted(vision):
                builder.ExportOutput(vision.GetOutputPort(port), f"{name}_{port}")
        for port in ("truth_train_state", "truth_object_states"):
            if world.HasOutputPort(port):
                builder.ExportOutput(world.GetOutputPort(port), port)
        builder.BuildInto(self)


def watch(scenario, seconds, trackers=TRACKERS):
    """Returns {name of the tracker: `Record`} of a scenario that is watched for a while [s]."""
    diagram = WatchingDiagram(scenario, trackers)
    return _recorded(diagram, scenario, seconds, {name: f"{name}_" for name in trackers})


def follow(scenario, seconds):
    """Returns the `Record` of the whole loop until the train is lifted, or for a while [s]."""
    scenario = scenario.with_settings({"cameras.render_processes": "0"})
    return _recorded(make_diagram(scenario), scenario, seconds, {"": ""})[""]


def lap_time(scenario):
    """Returns the time of a lap of the first train [s]."""
    return resolve(scenario).track.length / scenario.track.speed


def train_lengths(scenario):
    """Returns the lengths of all trains of a scenario whose further objects are trains [m]."""
    return TRAIN_SIZE[0] * np.array([scenario.train.scale, *(each.scale for each in scenario.objects)])


def _held_world(scenario):
    """Returns the world of a scenario, and {input: value} that hold its arm above the track."""
    setup = resolve(scenario)
    model, q = setup.reach.model, setup.reach.q_initial
    world = make_world(setup, {f"camera_{side}": window for side, window in setup.windows.items()})
    scratch = model.plant.CreateDefaultContext()
    model.plant.SetPositions(scratch, q)
    gravity = model.plant.CalcGravityGeneralizedForces(scratch)
    held = {
        "arm_desired_state": np.append(q, np.zeros(len(q))),
        "arm_feedforward": -gravity[: len(q)],
        "gripper_desired_state": [0.5 * scenario.grasp.jaw_opening, 0.0],
    }
    return world, held


def _wanted(vision):
    names = ("tracks", "point", "regions_left", "regions_right", "centroid_left", "centroid_right")
    return [name for name in names if vision.HasOutputPort(name)]


def _recorded(diagram, scenario, seconds, prefixes):
    """Returns {name: `Record`} of the visions whose ports begin with the given prefixes."""
    simulator = Simulator(diagram)
    context = simulator.get_mutable_context()
    lag = scenario.vision.lag_cycles
    count = round(seconds / VISION_PERIOD)
    truth, lines = [], {name: {} for name in prefixes}
    for k in range(count + lag + 2):
        simulator.AdvanceTo(k * VISION_PERIOD)
        truth.append(_poses(diagram, context))
        for name, prefix in prefixes.items():
            stamp, line = _line(diagram, context, prefix)
            if stamp is not None and 0 <= round(stamp / VISION_PERIOD) < count:
                lines[name].setdefault(round(stamp / VISION_PERIOD), line)
        if diagram.HasOutputPort("truth_verdict"):
            verdict = Verdict(diagram.GetOutputPort("truth_verdict").Eval(context))
            if verdict.lift > LIFTED:
                break
    records = {}
    for name, found in lines.items():
        indices = sorted(found)
        poses = np.array([truth[k] for k in indices])
        columns = [np.array(column) for column in zip(*(found[k] for k in indices))]
        records[name] = Record(VISION_PERIOD * np.array(indices), poses[..., :3], poses[..., 3], *columns)
    return records


def _poses(diagram, context):
    """Returns position [m] and yaw [rad] of all objects, the first train first, shape (m, 4)."""
    states = [diagram.GetOutputPort("truth_train_state").Eval(context)]
    if diagram.HasOutputPort("truth_object_states"):
        states += [*diagram.GetOutputPort("truth_object_states").Eval(context).reshape(-1, 13)]
    rows = []
    for w, x, y, z, *position in (state[:7] for state in states):
        rows.append([*position, np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))])
    return np.array(rows)


def _line(diagram, context, prefix):
    """Returns the stamp of the newest pair of images and what a `Record` has of it; (None, None) before the first."""

    def read(name, view):
        return view(diagram.GetOutputPort(f"{prefix}{name}").Eval(context).copy())

    seen = [read(f"centroid_{side}", Centroid) for side in SIDES]
    centroids = np.array([[each.u, each.v, each.valid] for each in seen])
    alive, numbers = np.zeros(TRACK_SLOTS, int), np.zeros(TRACK_SLOTS, int)
    points, variances = np.zeros((TRACK_SLOTS, 3)), np.zeros((TRACK_SLOTS, 3))
    usable = True
    if diagram.HasOutputPort(f"{prefix}tracks"):
        tracks = read("tracks", TrackPoints)
        if not tracks.valid:
            return None, None
        stamp = tracks.stamp
        rows = message_rows(np.array(tracks[:]), TRACK_FIELDS)
        alive = rows[:, _BEGIN["number"]].astype(int)
        numbers = np.where(rows[:, _BEGIN["seen"]] >= stamp, alive, 0)
        points = rows[:, _BEGIN["x"] : _BEGIN["x"] + 3]
        variances = rows[:, [_BEGIN["xx"], _BEGIN["yy"], _BEGIN["zz"]]]
        usable = all(read(f"regions_{side}", Regions).usable for side in SIDES)
    else:
        point = read("point", TrackPoint)
        stamp = point.stamp
        if stamp <= 0.0:
            return None, None
        alive[0] = numbers[0] = int(point.valid)
        points[0] = point.x, point.y, point.z
    return stamp, (alive, numbers, points, variances, usable, centroids)
