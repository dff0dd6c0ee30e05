"""Content of the video and the 3-D recording of a run of the conveyor."""

from enum import IntEnum
from typing import Any

import numpy as np

from drake_tracker.core.messages import (
    BELT_FIELDS,
    BeltEstimate,
    PickDiagnosis,
    Prediction,
    message_rows,
    predicted_points,
)
from drake_tracker.core.timing import VISION_PERIOD
from drake_tracker.diagrams.hand_eye import HandEyeDiagram
from drake_tracker.grasp.conveyor.pick_schema import PickPhase
from drake_tracker.tasks.conveyor.scenario import Rendered
from drake_tracker.tasks.conveyor.setup import ConveyorSetup
from drake_tracker.tasks.filming import FRAMES_PER_SECOND, PATH_MARKS, Film, Script, View
from drake_tracker.tasks.strips import (
    BRIGHT,
    FAINT,
    PREDICTION_STRIP,
    Strip,
    StripChart,
    StripInputs,
    horizontal_distance,
    prediction_error,
    rounded,
)
from drake_tracker.vision.parts.part_vision_diagram import belt_window

PREDICTING = (PickPhase.TRACK, PickPhase.INTERCEPT, PickPhase.CLOSE)
"""Phases in which the predicted path of the part is drawn."""
AHEAD = 1.0
"""Time for which it is drawn [s]."""
_VY = 11
"""Velocity along the belt in the state of a free body."""
_SAME = 0.05
"""Distance up to which a true part is assigned to a packet [m]."""
_PLACE = [BELT_FIELDS.index("x"), BELT_FIELDS.index("y")]


def predicted_path(packet: np.ndarray, now: float) -> np.ndarray:
    """Returns points of the predicted path of a part in W [m], shape (PATH_MARKS, 3).

    Args:
        packet: vector of a valid `Prediction`.
        now: present time [s].
    """
    return predicted_points(packet, np.linspace(now, now + AHEAD, PATH_MARKS))


def pick_notes(phase: IntEnum, diagnosis: Any) -> tuple[str, str]:
    """Returns two notes for a frame of the video: how many parts were placed, and how many picks failed.

    Args:
        phase: the present phase.
        diagnosis: a `PickDiagnosis`.
    """
    placed, failed = int(diagnosis.placed), int(diagnosis.failed)
    return f"{placed} placed", f"{failed} failed" if failed else ""


CONVEYOR_SCRIPT = Script(
    phases=PickPhase, predicting=PREDICTING, diagnosis=PickDiagnosis, notes=pick_notes, path=predicted_path
)
CONVEYOR_VIEW = View(
    phases=PREDICTING, path=predicted_path, eye=(1.75, -1.05, 1.55), target=(0.42, 0.02, 0.48), fov_deg=40.0
)


def conveyor_film(setup: ConveyorSetup, hand_eye: HandEyeDiagram) -> Film:
    """Returns the content of the camera video of a run of the conveyor.

    Args:
        setup: of a scenario with ``vision: !Rendered``.
        hand_eye: the diagram of the run.
    """
    config, cameras, belt = setup.scenario.cameras, setup.cameras, setup.seen_belt
    over_belt = setup.belt_cameras
    vision, height = setup.scenario.vision, setup.scenario.belt.height
    return Film(
        title=setup.scenario.name,
        subtitle=f"seed {setup.scenario.seed}, {setup.scenario.belt.speed:g} m/s",
        polygons={side: belt_window(camera, belt, height).polygon for side, camera in over_belt.items()},
        image_size=(config.width, config.height),
        cameras=cameras,
        offsets={side: hand_eye.world.cameras[f"camera_{side}"].window[:2] for side in cameras},
        lag=setup.scenario.vision.lag_cycles * VISION_PERIOD,
        lag_cycles=setup.scenario.vision.lag_cycles,
        every=round(1.0 / (FRAMES_PER_SECOND * VISION_PERIOD)),
        update_cycles=vision.update_cycles if isinstance(vision, Rendered) else 1,
        script=CONVEYOR_SCRIPT,
        image_latency=hand_eye.world.image_latency,
        several=True,
    )


def conveyor_strip_values(inputs: StripInputs) -> list[float | None]:
    """Returns one value for each line of `CONVEYOR_STRIPS`, None for an unknown value.

    The first two are about the part that the newest packet describes, the true one nearest to its prediction; the true
    speed is the mean of the parts that the host knows.

    Args:
        inputs: values of a run; ``states`` are those of all parts, and ``report`` is a `BeltEstimate`.
    """
    tracking = prediction = p_WQ = None
    if Prediction(inputs.packet).valid:
        expected = predicted_points(inputs.packet, np.array([inputs.now]))
        p_WQ = inputs.states[_nearest(inputs.states, expected[:, :2])[0], 4:7]
        if np.linalg.norm(p_WQ[:2] - expected[0, :2]) > _SAME:
            p_WQ = None
    if p_WQ is not None:
        inputs = inputs._replace(p_WQ=p_WQ)
        tracking, prediction = horizontal_distance(inputs.p_WT, inputs.p_WQ), prediction_error(inputs)
    report = inputs.report
    rows = message_rows(np.asarray(report[:]), BELT_FIELDS)
    places = rows[rows[:, 0] > 0.0][:, _PLACE]
    true_speed = speed = None
    if len(places):
        true_speed = 1e3 * float(np.mean(inputs.states[_nearest(inputs.states, places), _VY]))
        speed = 1e3 * report.speed if report.valid else None
    return rounded((tracking, prediction, true_speed, speed, float(len(places))))


def _nearest(states: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Returns which of the parts are nearest to places (x, y) of shape (n, 2) [m], shape (n,)."""
    return np.linalg.norm(states[:, None, 4:6] - places, axis=2).argmin(axis=0)


CONVEYOR_STRIPS = StripChart(
    strips=(
        Strip("Tracking error", "hand to the part", "mm", 200.0),
        PREDICTION_STRIP,
        Strip("Belt speed", "of the parts: true, estimated", "mm/s", 400.0, 1, (("", FAINT), ("", BRIGHT))),
        Strip("Parts", "on the belt, in view", "", 16.0, 0),
    ),
    span=20.0,
    values=conveyor_strip_values,
    state_port="truth_part_states",
    report_port="belt",
    report_view=BeltEstimate,
)
"""Tracking error, prediction error, speed of the belt, and number of parts in view."""
